"""An evaluation as a whole: every method judged, the ceiling and the floors beside, the default chosen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from palpate.modeling.doors.ceiling import Ceiling, noise_ceiling
from palpate.modeling.doors.data import DoorData, ModelDataError
from palpate.modeling.doors.evaluating import Judged, Wanted, context_for, judge
from palpate.modeling.doors.evaluating_default import Choice, forward_choice, inverse_choice
from palpate.modeling.doors.evaluating_floors import floors
from palpate.modeling.doors.evaluating_measured import Recovered, measured
from palpate.modeling.doors.evaluation_overall import method_rows
from palpate.modeling.doors.rated import Individual, Rated
from palpate.modeling.doors.registry import Direction

Row = dict[str, Any]


@dataclass(frozen=True)
class Evaluation:
    """All that tables, figures and the report are made of.

    `forward` and `inverse` are the rows of the two tables of all methods; `choices` the default of each direction that
    was evaluated; `ceilings` the noise ceilings, or `no_ceiling` why there are none.
    """

    judged: Judged
    forward: tuple[Row, ...]
    inverse: tuple[Row, ...]
    choices: dict[Direction, Choice]
    ceilings: tuple[Ceiling, ...]
    no_ceiling: str
    floors: tuple[Row, ...]
    measured: tuple[Recovered, ...]

    @property
    def data(self) -> DoorData:
        """The stimuli and their ratings."""
        return self.judged.context.data


def evaluate(
    data: DoorData, individual: Individual | None, wanted: Wanted,
    report: Callable[[str], None] = lambda _line: None,
) -> Evaluation:  # fmt: skip
    """Judge every method that is wanted. Raises ModelDataError or what a method raises."""
    context = context_for(data, wanted)
    found = judge(context, wanted, report)
    forward, inverse = method_rows(found, "forward"), method_rows(found, "inverse")
    choices: dict[Direction, Choice] = {}
    if forward:
        choices["forward"] = forward_choice(forward)
    if inverse:
        choices["inverse"] = inverse_choice(inverse)
    ceilings, why = _ceilings(data, individual, wanted.seed)
    report("the measured door")
    return Evaluation(
        found, forward, inverse, choices, ceilings, why, tuple(floors(context)), _measured(found, choices)
    )


def _ceilings(data: DoorData, individual: Individual | None, seed: int) -> tuple[tuple[Ceiling, ...], str]:
    if individual is None:
        return (), "A table of means holds no single ratings: nothing can be said of their noise."
    try:
        rated = Rated(data, individual)
        return tuple(noise_ceiling(rated, of=of, seed=seed) for of in ("other_people", "same_people")), ""
    except ModelDataError as refusal:
        return (), str(refusal)


def _measured(found: Judged, choices: dict[Direction, Choice]) -> tuple[Recovered, ...]:
    """By the default methods, where methods of both directions were evaluated: nothing else is trained for it."""
    if len(choices) < 2:
        return ()
    methods: dict[Direction, str] = {way: choice.method for way, choice in choices.items()}
    together = next(each for each in found.methods("forward") if each.method == methods["forward"])
    return measured(found.context, methods, together)
