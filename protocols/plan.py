"""A study compiled for one participant: an immutable, numbered tuple of trials with a digest."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import lcm
from typing import TYPE_CHECKING, Any

from palpate.protocols.canonical import digest
from palpate.protocols.forms import (
    AnchorForm,
    Consent,
    Demographics,
    Eligibility,
    Form,
    Interview,
    LabForms,
    Lexicon,
    Likert,
)
from palpate.protocols.keyed import Key, shuffled
from palpate.protocols.orders import Design, latin_row, rows_of, williams_row
from palpate.protocols.study import Stimulus, Study
from palpate.protocols.tasks import TASKS
from palpate.protocols.tracks import PRACTICE, Slot, practice_slots, slots_of, tracks_in
from palpate.protocols.trial import ParticipantRow, Recording, Trial

if TYPE_CHECKING:
    from palpate.protocols.intervals import Intervals
    from palpate.protocols.pairs import Pairs

LARGEST_ROW, LARGEST_SEED = 2**31, 2**63
"""The largest numbers that the databases of collected sessions can hold."""
Felt = tuple[str, tuple[Stimulus, ...]]
"""The block of a trial, and its stimulus, its pair, or its set."""


@dataclass(frozen=True)
class Plan:
    """The session plan of one participant. The same study, participant row and seed give the same plan and digest
    everywhere.
    """

    study: Study
    who: ParticipantRow
    seed: int
    trials: tuple[Trial, ...]
    lab_forms: LabForms | None = None
    session: int = 1

    @property
    def occasion(self) -> tuple[Key, ...]:
        """Return the part of random keys that is specific to this session; empty for a participant's first session."""
        return () if self.session == 1 else ("session", self.session)

    @cached_property
    def digest(self) -> str:
        """Return the SHA-256 over the participant's part of the study, the row, the seed, the order, and the lab's
        forms.

        It also covers the number of a session after the first.
        """
        return digest(
            {
                "plan": 1,
                "study": self.study.conditions(),
                "who": [self.who.participant, self.who.group, self.who.row],
                "seed": self.seed,
                "order": [
                    [t.number, t.block, t.practice, t.stimulus.id, t.rest_before]
                    + ([[stimulus.id for stimulus in t.stimuli]] if t.stimuli else [])
                    + ([[t.track.name, t.catch, t.index]] if t.track is not None else [])
                    for t in self.trials
                ],
            }
            | ({} if self.lab_forms is None else {"lab_forms": self.lab_forms.definition()})
            | ({} if self.session == 1 else {"session": self.session})
        )

    @cached_property
    def anchors(self) -> Mapping[int, tuple[Trial, ...]]:
        """Return the references that are felt before a trial, as trials, by the trial's place in `trials`.

        Their numbers count down from -1, so no trial has them.
        """
        if (anchors := self.study.anchors) is None:
            return {}
        blocks = [trial.block for trial in self.trials]
        begins = [place for place, block in enumerate(blocks) if place == 0 or block != blocks[place - 1]]
        begins = {"trial": [*range(len(blocks))], "block": begins, "session": begins[:1]}[anchors.before]
        count = len(anchors.stimuli)
        return {
            place: tuple(_anchor(self.study, blocks[place], n, turn * count + n) for n in range(1, count + 1))
            for turn, place in enumerate(begins)
        }

    @property
    def presented(self) -> tuple[Trial, ...]:
        """Return all that is felt: the stimuli of the trials, and the references before their blocks."""
        return (*self.felt_in_trials, *(anchor for several in self.anchors.values() for anchor in several))

    @cached_property
    def possible(self) -> tuple[Stimulus, ...]:
        """Return every stimulus that may be presented, at every level that a procedure may choose, each once."""
        trials = [trial for trial in self.presented if trial.track is None]
        stimuli = {trial.stimulus.id: trial.stimulus for trial in trials}
        tracks = {trial.track.name: trial.track for trial in self.trials if trial.track is not None}
        at_levels = [track.stimulus_at(n) for track in tracks.values() for n in range(len(track.levels))]
        standards = [track.standard for track in tracks.values() if track.standard is not None]
        several = [*stimuli.values(), *at_levels, *standards]
        return tuple({(s.id, *sorted(s.columns.items())): s for s in several}.values())

    @property
    def interval_s(self) -> float | None:
        """Return how long an interval of a trial lasts; None if there are none, or the stimuli decide."""
        intervals: Intervals | None = self.study.intervals
        return None if intervals is None else intervals.seconds

    @property
    def felt_in_trials(self) -> tuple[Trial, ...]:
        """Return the trials, each once for every stimulus that is felt in it."""
        return tuple(part for trial in self.trials for part in trial.each())

    @property
    def opening(self) -> tuple[Form, ...]:
        """Return the forms before the first trial, without questions if the lab has none.

        Raises PlanError if the study has opening forms and the lab's forms were not given.
        """
        if not self.study.opening:
            return ()
        if self.lab_forms is None:
            raise PlanError(
                f"{self.study.study} opens with {', '.join(self.study.opening)}: the lab's forms are missing"
            )
        forms: dict[str, Form] = {
            "consent": Consent(self.lab_forms.consent),
            "eligibility": Eligibility(self.study.eligible),
            "demographics": Demographics(self.lab_forms.questions),
        }
        names = [name for name in self.study.opening if name != "demographics" or self.lab_forms.questions]
        return tuple(forms[name] for name in names)

    @property
    def closing(self) -> tuple[Form, ...]:
        """Return the forms after the last trial."""
        forms: dict[str, Form] = {"suggestions": Lexicon(0, "suggestions")}
        if self.study.questionnaire is not None:
            forms["questionnaire"] = Likert(self.study.questionnaire)
        forms["interview"] = Interview(self.study.interview)
        return tuple(forms[name] for name in self.study.closing)


def block_page(block: str) -> str:
    """Return the name of the page that is shown before a block."""
    return f"block {block}"


class PlanError(ValueError):
    """A participant's row that does not fit the study."""


def compile_plan(
    study: Study, who: ParticipantRow, seed: int = 0, lab_forms: LabForms | None = None, session: int = 1
) -> Plan:
    """Order the study's stimuli for one session of a participant: practice first, then the counterbalanced trials.

    `lab_forms` are needed to run a study that opens with them; they do not affect the order. Raises PlanError for an
    unknown group, a group where the study has none, or a row, seed or session out of range.
    """
    if not 0 <= who.row < LARGEST_ROW:
        raise PlanError(f"participant {who.participant}: row {who.row}; a row from 0 to {LARGEST_ROW - 1} is expected")
    if not -LARGEST_SEED <= seed < LARGEST_SEED:
        raise PlanError(f"seed {seed}: a whole number of at most 63 bits is expected")
    if study.groups and who.group not in study.groups:
        known = ", ".join(sorted(study.groups))
        raise PlanError(f"participant {who.participant}: group {who.group!r}; {study.study} has groups {known}")
    if not study.groups and who.group is not None:
        raise PlanError(f"participant {who.participant}: group {who.group!r}, but {study.study} has no groups")
    if not 1 <= session < LARGEST_ROW:
        raise PlanError(f"participant {who.participant}: session {session}; sessions count from 1")
    task = TASKS[study.task]
    form = None if task.form is None else task.form(study, who, seed, session)
    if study.procedure:
        in_tracks = _of_tracks(study, form, who, seed, session)
        return Plan(study, who, seed, in_tracks, lab_forms if study.opening else None, session)
    gathered = list if task.block_form is None else _in_sets
    practice = gathered(_practised(study))
    main = gathered(main_order(study, who, seed, session))
    trials = [
        _trial(study, form, number, block, stimuli, number - 1 - len(practice))
        for number, (block, stimuli) in enumerate([*practice, *main], start=1)
    ]
    return Plan(study, who, seed, tuple(trials), lab_forms if study.opening else None, session)


def _of_tracks(study: Study, form: Form | None, who: ParticipantRow, seed: int, session: int) -> tuple[Trial, ...]:
    """Return the trials of a study whose levels are chosen by procedures: those of several tracks, interleaved.

    A block goes through its tracks again and again, each time in the study's order, until all have had as many trials
    as they may have.
    """
    occasion: tuple[Key, ...] = () if session == 1 else ("session", session)
    key = ("track", study.study, seed, who.participant, *occasion)
    standard = study.intervals.standard
    by_id = {s.id: s for s in study.stimuli_of(who.group) if standard is None or s.id != str(standard)}
    first = session - 1 if study.over_sessions == "next_row" else 0
    label = ("deal", study.study, who.group, study.order.seed)
    absent, easy = study.intervals.catch_every
    tracks, main = [], list[Slot]()
    chance: tuple[Key, ...] = ("order", study.study, seed, who.participant, first)
    for block, members, row in _blocks(study, by_id, who.row + first, label, chance):
        within = tracks_in(study, block, [by_id[name] for name in members], key)
        tracks += within
        queues = {track.name: slots_of(track, block, absent, easy) for track in within}
        names = list(queues)
        for turn in range(max(map(len, queues.values()), default=0)):
            drawn = ordered(study.order.design, names, row + turn, (*label, block), (*chance, block, turn))
            main += [queues[name][turn] for name in drawn if turn < len(queues[name])]
    main = main[::-1] if study.is_mirrored(session) else main
    practice = list(practice_slots(study, tracks))
    return tuple(
        replace(
            _trial(study, form, number, slot.block, (slot.stimulus,), number - 1 - len(practice)),
            track=slot.track, catch=slot.catch, index=slot.index,
        )
        for number, slot in enumerate([*practice, *main], start=1)
    )  # fmt: skip


def _practised(study: Study) -> Iterator[Felt]:
    if study.practice is None:
        return
    by_id = {stimulus.id: stimulus for stimulus in study.stimuli}
    names = iter(study.practice.stimuli)
    for together in zip(names) if study.pairs is None else zip(names, names, strict=True):
        yield PRACTICE, tuple(by_id[name] for name in together)


def main_order(study: Study, who: ParticipantRow, seed: int = 0, session: int = 1) -> Iterator[Felt]:
    """Yield the block of every counted trial, and its stimulus or pair; a repeat takes the next row of the square.

    The study's rule orders later sessions: `next_row` goes on with the rows after those of the session before,
    `mirrored` reverses the first session's order in every second session, `same` repeats it.
    """
    stimuli, repeats = study.stimuli_of(who.group), study.order.repeats
    first = (session - 1) * repeats if study.over_sessions == "next_row" else 0
    trials = [trial for turn in range(first, first + repeats) for trial in _one_pass(study, who, seed, turn, stimuli)]
    yield from reversed(trials) if study.is_mirrored(session) else trials


def _in_sets(felt: Iterable[Felt]) -> list[Felt]:
    """Return the consecutive stimuli in sets: a set ends with its block, and before a stimulus that it already has."""
    sets = list[Felt]()
    for block, stimuli in felt:
        last, together = sets[-1] if sets else ("", ())
        if sets and block == last and stimuli[0] not in together:
            sets[-1] = (block, (*together, *stimuli))
        else:
            sets.append((block, stimuli))
    return sets


def count_trials(study: Study, stimuli: Sequence[Stimulus]) -> int:
    """Return the number of trials, without practice, in a session with these stimuli; the cap of procedures."""
    blocks = study.by_block(stimuli)
    if study.procedure:
        every = [n for n in study.intervals.catch_every if n is not None]
        tracks = [track for name, several in blocks.items() for track in tracks_in(study, name, several, ())]
        return sum(track.trials + sum(track.trials // n for n in every) for track in tracks)
    if study.pairs is not None:
        pairs: Pairs = study.pairs
        return sum(pairs.count(len(several)) for several in blocks.values()) * study.order.repeats
    return (len(stimuli) if TASKS[study.task].block_form is None else len(blocks)) * study.order.repeats


def ordered(
    design: Design, items: Sequence[str], row: int, label: tuple[Any, ...], chance: tuple[Any, ...]
) -> list[str]:
    """Return the items in the order of a design's row.

    A square's item numbers are assigned to the items by the key `label`, once for the whole study; `random` draws by
    the key `chance`, which includes the participant.
    """
    if design == "as_listed":
        return list(items)
    if design == "random":
        return list(shuffled(items, *chance))
    row_of = williams_row if design == "williams" else latin_row
    dealt = shuffled(items, *label)
    return [dealt[number] for number in row_of(len(items), row % rows_of(design, len(items)))]


def _one_pass(study: Study, who: ParticipantRow, seed: int, turn: int, stimuli: Sequence[Stimulus]) -> Iterator[Felt]:
    """Yield the order of one pass; `turn` is the number of rows that the participant has used before."""
    by_id = {stimulus.id: stimulus for stimulus in stimuli}
    label = ("deal", study.study, who.group, study.order.seed)
    chance = ("order", study.study, seed, who.participant, turn)
    row = who.row + turn
    for name, members, inner_row in _blocks(study, by_id, row, label, chance):
        items = {member: (member,) for member in members}
        if study.pairs is not None:
            items = {str(n): pair for n, pair in enumerate(study.pairs.of(members, row, (*label, name)))}
        for item in ordered(study.order.design, list(items), inner_row, (*label, name), (*chance, name)):
            yield name, tuple(by_id[member] for member in items[item])


def _blocks(
    study: Study, by_id: Mapping[str, Stimulus], row: int, label: tuple[Any, ...], chance: tuple[Any, ...]
) -> Iterator[tuple[str, list[str], int]]:
    """Yield (name, stimulus ids, row within) of every block in order.

    The row within a block advances once more after each common round of the two designs, so that every block order is
    combined with every order within equally often in rows(blocks) x rows(within) participants.
    """
    blocks = study.order.blocks
    if blocks is None:
        yield "main", list(by_id), row
        return
    members = {name: [stimulus.id for stimulus in several] for name, several in study.by_block(by_id.values()).items()}
    outer_rows = rows_of(blocks.design, len(members))
    for name in ordered(blocks.design, list(members), row, (*label, "blocks"), (*chance, "blocks")):
        size = len(members[name]) if study.pairs is None else study.pairs.count(len(members[name]))
        common = lcm(outer_rows, rows_of(study.order.design, size))
        yield name, members[name], row + row // common


def _anchor(study: Study, block: str, number: int, met: int) -> Trial:
    """Return the study's anchor of this number before a block, as the `met`-th reference of the session."""
    several = study.anchors.stimuli if study.anchors is not None else ()
    anchor = several[number - 1]
    wish = None
    if anchor.wish is not None and study.scale is not None:
        neutral = study.scale.nearest((study.scale.low + study.scale.high) / 2)
        wish = {attribute.name: float(anchor.wish.get(attribute.name, neutral)) for attribute in study.attributes}
    stimulus = next(stimulus for stimulus in study.stimuli if stimulus.id == anchor.id)
    form = AnchorForm(anchor, block, number, len(several), wish)
    return Trial(-met, block, False, stimulus, form, may_go_back=False, rest_before=False)


def _trial(
    study: Study, form: Form | None, number: int, block: str, stimuli: tuple[Stimulus, ...], counted: int
) -> Trial:
    """Return a trial; `counted` is its 0-based place among the counted trials, negative in practice."""
    make = TASKS[study.task].block_form
    first_of_phase = number == 1 or counted == 0
    every = study.rest.every if study.rest is not None else None
    recording = None
    if study.capture is not None:
        seconds = study.capture.seconds
        seconds = stimuli[0].columns[seconds] if isinstance(seconds, str) else seconds
        recording = Recording(study.capture.device, float(seconds))
    return Trial(
        number=number,
        block=block,
        practice=counted < 0,
        stimulus=stimuli[0],
        form=form if make is None else make(study, stimuli),
        may_go_back=study.navigation == "back_and_forward" and not first_of_phase,
        rest_before=every is not None and counted > 0 and counted % every == 0,
        recording=recording,
        stimuli=() if make is None and len(stimuli) == 1 else stimuli,
    )
