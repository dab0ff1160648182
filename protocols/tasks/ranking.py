"""The task that orders the stimuli of a set: each is felt, and placed among those that were felt before."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import floor
from typing import Any, Literal

from palpate.protocols.complaints import Problem
from palpate.protocols.events import Ask, Present, Reply
from palpate.protocols.forms import FormKind, OwnColumn, OwnTable
from palpate.protocols.keyed import normal, uniform
from palpate.protocols.strict import Strict
from palpate.protocols.study import Attribute, Stimulus, Study
from palpate.protocols.tasks.steps import Steps, Task, TaskError, form_of, outcome_of
from palpate.protocols.trial import Trial

MOST = 12
"""Greatest number of stimuli in a set: the row of their places is one line on the smallest screen."""
FELT_AGAIN = 0.3
"""Probability that a simulated participant feels a stimulus again before the order is final."""


class Settings(Strict):
    """The settings of this task in a study file: `again` lets a stimulus be felt again while the order is made."""

    again: bool = True


@dataclass(frozen=True)
class Ranking:
    """A set in the order in which it is felt: {stimulus: rank}, from 1 at the attribute's low end; 0 for no place yet.

    Ranks count only the stimuli that have a place. While some have none, the reply goes on to feel another (go: try,
    feel: stimulus); with `again` any other reply may do so too.
    """

    stimuli: tuple[str, ...]
    attribute: Attribute
    again: bool = True
    tries: Literal[True] = True
    name: Literal["ranking"] = "ranking"

    def items(self) -> list[str]:
        """Return the stimuli, by their ids."""
        return list(self.stimuli)

    def problem(self, answers: Any) -> str | None:
        """Return why the answers are not valid, or None."""
        if not isinstance(answers, Mapping) or sorted(answers) != sorted(self.stimuli):
            return f"ranks of {self.items()} expected, found {answers!r:.200}"
        if not all(type(rank) is int for rank in answers.values()):
            return f"whole numbers expected as ranks, found {answers!r:.200}"
        ranks = sorted(rank for rank in answers.values() if rank != 0)
        good = ranks == list(range(1, len(ranks) + 1))
        return None if good else f"ranks from 1 to {len(ranks)}, each once, expected, found {answers!r:.200}"

    def unfinished(self, answers: Mapping[str, Any]) -> str | None:
        """Return why these answers are not complete enough to go on, or None."""
        without = [stimulus for stimulus in self.stimuli if not answers[stimulus]]
        return f"these have no rank yet: {', '.join(without)}" if without else None

    def new(self, ranks: Mapping[str, int]) -> str | None:
        """Return the stimulus that is felt next or was just felt, the first without a rank; else None."""
        return next((stimulus for stimulus in self.stimuli if not ranks.get(stimulus)), None)


def put_in_order(trial: Trial) -> Steps:
    """Feel the stimuli one after another, each placed before the next is felt, then again as often as the participant
    likes.

    With `trial.previous`, the order of an earlier attempt, the form starts from it and stimuli with a place in it are
    not felt again.
    """
    form = form_of(trial)
    ranks: Mapping[str, Any] | None = trial.previous
    feel = form.new(ranks or {}) if isinstance(form, Ranking) else None
    while True:
        if feel is not None:
            yield Present(replace(trial, stimulus=_stimulus(trial, feel)))
        reply = yield Ask(form, trial, ranks)
        if reply.value.get("go") != "try":
            return outcome_of(reply)
        ranks, feel = reply.value["answers"], reply.value.get("feel", "")


def _stimulus(trial: Trial, name: str) -> Stimulus:
    for stimulus in trial.stimuli:
        if stimulus.id == name:
            return stimulus
    raise TaskError(f"trial {trial.number}: {name!r} is to be felt, which is not of its set")


def simulated(person: Any, ask: Ask, form: Ranking) -> tuple[Reply, float]:
    """Place the stimulus that was just felt by its percept; sometimes feel one again at the end.

    `person` is a simulated participant of the kind `perceiver`.
    """
    ranks = {name: int((ask.previous or {}).get(name, 0)) for name in form.stimuli}
    if (new := form.new(ranks)) is None:
        return _reply(person, ask, form, ranks, {})
    placed = [name for name in form.stimuli if ranks[name]]
    felt = _perceived(person, ask, form, new)
    rank = 1 + sum(_perceived(person, ask, form, name) < felt for name in placed)
    if uniform(*person.moment("lapse", ask, new)) < person.simulation.lapse_rate:
        rank = 1 + floor(uniform(*person.moment("anywhere", ask, new)) * (len(placed) + 1))
    ranks = {name: r + 1 if r >= rank else r for name, r in ranks.items()} | {new: rank}
    following = form.new(ranks)
    if following is None and form.again and uniform(*person.moment("again", ask, "")) < FELT_AGAIN:
        following = form.stimuli[floor(uniform(*person.moment("again which", ask, "")) * len(form.stimuli))]
    go = {} if following is None else {"go": "try", "feel": following}
    return _reply(person, ask, form, ranks, go)


def _reply(
    person: Any, ask: Ask, form: Ranking, ranks: Mapping[str, int], go: Mapping[str, str]
) -> tuple[Reply, float]:
    seconds = round(person.seconds(ask, f"rank {sum(map(bool, ranks.values()))} of {len(form.stimuli)}"), 3)
    return Reply({**go, "answers": dict(ranks), "seconds": seconds}), seconds


def _perceived(person: Any, ask: Ask, form: Ranking, name: str) -> float:
    """Return the percept of a stimulus in units of the simulation's latents, the same throughout a trial."""
    if ask.trial is None:
        raise ValueError("a ranking needs a trial")
    latent = person.latent(form.attribute.name, _stimulus(ask.trial, name))
    noise = normal(*person.moment("noise", ask, name))
    return float(person.gain(form.attribute) * latent + person.simulation.noise_sd * noise)


def _rows(
    form: Ranking, answers: Mapping[str, Any], _reply: Mapping[str, Any], _request: Mapping[str, Any]
) -> Iterator[dict[str, Any]]:
    for position, stimulus in enumerate(form.stimuli, start=1):
        yield {
            "attribute": form.attribute.name, "rank": answers[stimulus], "stimulus": stimulus,
            "set_size": len(form.stimuli), "position": position,
        }  # fmt: skip


def _form(study: Study, stimuli: tuple[Stimulus, ...]) -> Ranking | None:
    if not study.attributes:
        return None
    settings = study.settings if isinstance(study.settings, Settings) else Settings()
    return Ranking(tuple(stimulus.id for stimulus in stimuli), study.attributes[0], settings.again)


def _sets(study: Study) -> Iterator[Problem]:
    """Yield problems unless the study has one attribute, and sets that can be ordered.

    Missing columns are reported elsewhere.
    """
    if len(study.attributes) > 1:
        yield Problem(
            ("attributes",), f"one pair to put stimuli in order by is expected, found {len(study.attributes)}"
        )
    by = study.order.blocks.by if study.order.blocks is not None else None
    if by is not None and any(by not in stimulus.columns for stimulus in study.stimuli):
        return
    for group in study.groups or (None,):
        if group is not None and any(c not in s.columns for c in study.groups[group] for s in study.stimuli):
            return
        sizes = {name: len(several) for name, several in study.by_block(study.stimuli_of(group)).items()}
        yield from _size(("stimuli",), sizes, "" if group is None else f"group {group}: ")
    if study.practice is not None:
        if len(set(study.practice.stimuli)) < len(study.practice.stimuli):
            yield Problem(("practice", "stimuli"), "different stimuli are expected, which are put in order")
        yield from _size(("practice", "stimuli"), {"practice": len(set(study.practice.stimuli))}, "")


def _size(path: tuple[str, ...], sizes: Mapping[str, int], where: str) -> Iterator[Problem]:
    for name, size in sorted(sizes.items()):
        if not 2 <= size <= MOST:
            yield Problem(path, f"{where}from 2 to {MOST} stimuli to put in order are expected, found {size} ({name})")


TASK = Task(
    "The stimuli of a set are felt one after another and put in order.",
    put_in_order, keys=("attributes", "settings"), required=("attributes",), block_form=_form, settings=Settings,
    answers="rankings", check=_sets,
    summary=lambda study: " and ".join(f"an order from {pair.low} to {pair.high}" for pair in study.attributes),
)  # fmt: skip
FORM = FormKind(
    "putting {n} stimuli in order",
    simulated,
    table=OwnTable(
        "rankings",
        "One row for each stimulus of an order, revised ones too.",
        (
            OwnColumn("attribute", "The attribute that stimuli are put in order by."),
            OwnColumn("rank", "The place in the order: 1 at the low end of the attribute.", "whole"),
            OwnColumn("stimulus", "The stimulus, as in the table of stimuli.", key=True),
            OwnColumn("set_size", "How many stimuli were put in order.", "whole"),
            OwnColumn("position", "The how-manieth of the set it was felt first, from 1.", "whole"),
        ),
        _rows,
    ),
)
