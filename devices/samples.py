"""Physical samples: the experimenter puts a sample in place and confirms it (thesis 3.3.2, 4.7.1)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from palpate.devices.acts import Act, going_on, page_of
from palpate.devices.desk import Desk, Pages, Prompt
from palpate.devices.device import Presents
from palpate.protocols.events import Aside, Part, Present, Reply, WorldEvent
from palpate.protocols.study import Stimulus
from palpate.protocols.trial import Trial

TELLING = ("label", "material", "position")
"""Columns of a stimulus table that identify the sample and its place."""


def described(stimulus: Stimulus, blind: Sequence[str] = ()) -> str:
    """Return the stimulus by its id and its columns: T07 (sandpaper P60, box 3).

    If columns are `blind`, neither they nor the id, which may reveal them, are shown: sandpaper P60, box 3.
    """
    seen = [name for name in TELLING if name not in blind]
    texts = [text for name in seen if (text := stimulus.columns.get(name, "")) not in ("", stimulus.id)]
    if blind:
        return ", ".join(texts) or "a stimulus that the study keeps blind"
    return f"{stimulus.id} ({', '.join(texts)})" if texts else stimulus.id


def mounting(stimulus: Stimulus, blind: Sequence[str] = ()) -> Prompt:
    """Return the prompt to put the stimulus in place before the participant can feel it."""
    return Prompt(f"Put in place: {described(stimulus, blind)}")


def mounting_for(request: Present, blind: Sequence[str] = ()) -> Prompt:
    """Return the prompt to put in place what the request presents: in which interval, or on which side."""
    part, trial = request.part, request.trial
    if part is None:
        return mounting(trial.stimulus, blind)
    if part.sides:
        names = ("left", "right") if part.of == 2 else tuple(f"place {n}" for n in range(1, part.of + 1))
        sides = zip(names, _at_once(request, part), strict=True)
        placed = (f"{name}: {'nothing' if one is None else _at_level(trial, one, blind)}" for name, one in sides)
        return Prompt(f"Put in place {', '.join(placed)}")
    interval = f"Interval {part.interval} of {part.of}"
    if part.blank:
        return Prompt(f"{interval}: put nothing in place")
    return Prompt(f"{interval}: put in place {_at_level(trial, trial.stimulus, blind)}")


def _at_once(request: Present, part: Part) -> list[Stimulus | None]:
    """Return what lies on each side: a stimulus of a pair; or that of the trial, its standard, or nothing."""
    trial = request.trial
    if trial.stimuli:
        pair = {stimulus.id: stimulus for stimulus in trial.stimuli}
        return [pair[name] for name in part.sides]
    other = None if trial.track is None else trial.track.standard
    return [trial.stimulus if n == part.interval else other for n in range(1, part.of + 1)]


def _at_level(trial: Trial, stimulus: Stimulus, blind: Sequence[str]) -> str:
    """Return the stimulus with the levels that a procedure put into its columns, where they are not blind."""
    grids = () if trial.track is None else trial.track.procedure.grids
    columns = [grid.column for grid in grids if grid.of is None and grid.column not in blind]
    levels = [f"{column} {stimulus.columns[column]}" for column in columns if column in stimulus.columns]
    return ", ".join([described(stimulus, blind), *levels])


@dataclass
class HandMounted:
    """A presenter of samples that a person mounts, while the participant is asked to wait.

    The participant explores without a time limit and answers while feeling, so the presentation ends when the
    experimenter confirms: `seconds` is how long the change took.
    """

    act: Act | None = None
    blind: Sequence[str] = ()

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: Callable[[], int]) -> Reply | Aside:
        """Prompt for the sample and wait for the confirmation; the prompt stays after an aside."""
        self.act = act = going_on(self.act, request, now_ns)
        desk.demand(mounting_for(request, self.blind))
        aside = act.wait("changing_sample", window, desk, now_ns, lambda: desk.answer() is not None)
        if aside is not None:
            return aside
        desk.demand(None)
        self.act = None
        return Reply({"presented": True, "by": "experimenter", "seconds": act.seconds(now_ns())})


@dataclass
class FeltInIntervals:
    """A presenter of samples that are felt one after the other: `hand` mounts each, then the participant feels it.

    The page of the interval stays for its seconds, or until the experimenter confirms that the sample was felt.
    """

    hand: Presents
    mounted: tuple[Present, Reply] | None = None
    act: Act | None = None

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: Callable[[], int]) -> WorldEvent:
        """Have the sample mounted, then felt; `seconds` of the reply are those of both."""
        part = request.part
        if part is None or part.sides:
            return self.hand.perform(request, window, desk, now_ns)
        if self.mounted is None or self.mounted[0] is not request:
            event = self.hand.perform(request, window, desk, now_ns)
            if not isinstance(event, Reply):
                return event
            self.mounted = (request, event)
        self.act = act = going_on(self.act, request, now_ns)
        if part.seconds is None:
            desk.demand(Prompt(f"Interval {part.interval} of {part.of}: confirm when it was felt"))
        aside = act.wait(page_of(request), window, desk, now_ns, lambda: self._is_over(part, act, desk, now_ns))
        if aside is not None:
            return aside
        desk.demand(None)
        by_hand, self.mounted, self.act = self.mounted[1], None, None
        return Reply({**by_hand.value, "seconds": round(by_hand.value["seconds"] + act.seconds(now_ns()), 3)})

    @staticmethod
    def _is_over(part: Part, act: Act, desk: Desk, now_ns: Callable[[], int]) -> bool:
        return desk.answer() is not None if part.seconds is None else act.seconds(now_ns()) >= part.seconds
