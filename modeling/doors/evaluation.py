"""An evaluation as a whole: every method's results, the ceiling and the floors beside, the default chosen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from palpate.modeling.doors.ceiling import Ceiling, noise_ceiling
from palpate.modeling.doors.choice import forward_choice, inverse_choice
from palpate.modeling.doors.data import DoorData, ModelDataError
from palpate.modeling.doors.evaluation_overall import method_rows
from palpate.modeling.doors.floors import floors
from palpate.modeling.doors.measured_door import Recovered, measured
from palpate.modeling.doors.rated import Individual, Rated
from palpate.modeling.doors.registry import Direction
from palpate.modeling.doors.results import DoorOptions, DoorResults, domain_for, evaluate_methods
from palpate.modeling.evaluate.outputs import Choice
from palpate.protocols.progress import Report, silent

Row = dict[str, Any]


@dataclass(frozen=True)
class DoorEvaluation:
    """All that tables, figures and the report are made of.

    `forward` and `inverse` are the rows of the two tables of all methods; `choices` the default of each direction that
    was evaluated; `ceilings` the noise ceilings, or `no_ceiling` why there are none.
    """

    results: DoorResults
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
        return self.results.domain.data


def evaluate_doors(
    data: DoorData, individual: Individual | None, options: DoorOptions, report: Report = silent
) -> DoorEvaluation:
    """Evaluate every method that is asked for. Raises ModelDataError, or JobError for what a method raises."""
    domain = domain_for(data, options)
    results = evaluate_methods(domain, options, report)
    forward, inverse = method_rows(results, "forward"), method_rows(results, "inverse")
    choices: dict[Direction, Choice] = {}
    if forward:
        choices["forward"] = forward_choice(forward)
    if inverse:
        choices["inverse"] = inverse_choice(inverse)
    ceilings, why = _ceilings(data, individual, options.seed)
    report("the measured door")
    return DoorEvaluation(
        results, forward, inverse, choices, ceilings, why, tuple(floors(domain)), _measured(results, choices)
    )


def _ceilings(data: DoorData, individual: Individual | None, seed: int) -> tuple[tuple[Ceiling, ...], str]:
    if individual is None:
        return (), "A table of means holds no single ratings: nothing can be said of their noise."
    try:
        rated = Rated(data, individual)
        return tuple(noise_ceiling(rated, of=of, seed=seed) for of in ("other_people", "same_people")), ""
    except ModelDataError as refusal:
        return (), str(refusal)


def _measured(results: DoorResults, choices: dict[Direction, Choice]) -> tuple[Recovered, ...]:
    """By the default methods, where methods of both directions were evaluated: nothing else is trained for it."""
    if len(choices) < 2:
        return ()
    methods: dict[Direction, str] = {way: choice.method for way, choice in choices.items()}
    together = next(method for method in results.methods("forward") if method.method == methods["forward"])
    return measured(results.domain, methods, together)
