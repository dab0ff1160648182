"""The evaluation of door models: all results, noise ceilings and floors, and the choice of the default methods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.modeling.doors.ceiling import Ceiling, noise_ceiling
from palpate.modeling.doors.data import DoorData
from palpate.modeling.doors.domain import DoorDomain
from palpate.modeling.doors.evaluation.method_rows import method_rows
from palpate.modeling.doors.measured_door import Recovered, recover_measured
from palpate.modeling.doors.rated import Individual, Rated
from palpate.modeling.doors.registry import NO_FILE, THESIS, Direction
from palpate.modeling.doors.results import DoorOptions, DoorResults, domain_for, evaluate_methods
from palpate.modeling.evaluate.outputs import Choice
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.protocols.progress import Report, silent
from palpate.signals.arrays import Array

Row = dict[str, Any]
ALLOWED = 0.05
"""The share by which the network may be worse than the best baseline before the report says so."""
MethodRow = Mapping[str, Any]


def floors(domain: DoorDomain) -> list[Row]:
    """Return two lower bounds of the waveform's mean absolute error in percent: mean over profiles and SD, by split.

    - oracle: the training profile that is nearest to the held-out waveform itself;
    - code: the held-out waveform projected on as many principal components of the training profiles as there are
      attributes: the best that so many numbers can do.
    """
    size = len(domain.data.attributes)
    meanings = {"oracle": "nearest known profile, found by the waveform itself",
                "code": f"the waveform through {size} principal components"}  # fmt: skip
    rows: list[Row] = []
    for split, folds in domain.splits.items():
        forces = domain.scaling.force_up(domain.data_of(split).force_N)
        errors: dict[str, list[Array]] = {"oracle": [], "code": []}
        for fold in folds:
            known, tested = forces[fold.train], forces[fold.test]
            errors["oracle"].append(np.array([np.abs(known - profile).mean(axis=1).min() for profile in tested]))
            # the tested profiles as the first components of the known ones reproduce them
            mean = known.mean(axis=0)
            _, _, axes = np.linalg.svd(known - mean, full_matrices=False)
            leading = axes[:size]
            back: Array = mean + (tested - mean) @ leading.T @ leading
            errors["code"].append(np.abs(back - tested).mean(axis=1))
        for name, by_fold in errors.items():
            mae = np.concatenate(by_fold)
            sd = float(mae.std(ddof=1)) if len(mae) > 1 else None
            rows.append({"split": split, "floor": name, "what": meanings[name], "mae": float(mae.mean()), "mae_sd": sd,
                         "n": len(mae)})  # fmt: skip
    return rows


def forward_choice(rows: Sequence[MethodRow]) -> Choice:
    """Return the method with the least MAE, the first of equals; `rows` are those of the table of all methods."""
    best = min(rows, key=lambda row: row["mae"])
    why = f"{best['title']} has the least MAE: {best['mae']:.2f}, all methods on the same folds."
    return Choice(best["method"], why, _compare_network(rows, "mae", "MAE"))


def inverse_choice(rows: Sequence[MethodRow]) -> Choice:
    """Return the method of least loop error among those with a model file whose profiles all stay within the limits.

    The profiles at the corners of the sliders count too. The loop is closed by simulated people who never saw the
    training data where there are any, else by the forward model.
    """
    fresh = any(row["loop_fresh"] is not None for row in rows)
    by, whose = ("loop_fresh", "fresh perceivers") if fresh else ("loop_judge", "by the forward model")
    possible = [row for row in rows if ("inverse", row["method"]) not in NO_FILE] or rows
    able = [row for row in possible if not row["unplayable"] and not row["corners_unplayable"]]
    if not able:
        best = min(possible, key=lambda row: row[by])
        why = (
            f"No method stays within the limits of a made profile everywhere, corners too. {best['title']} has the "
            f"least loop error ({whose}): {best[by]:.2f}."
        )
        return Choice(best["method"], why)
    best = min(able, key=lambda row: row[by])
    why = (
        f"{best['title']} has the least loop error ({whose}): {best[by]:.2f}, among methods whose every made profile "
        "is within the limits, at the corners too."
    )
    return Choice(best["method"], why, _compare_network(rows, by, "loop error"))


def _compare_network(rows: Sequence[MethodRow], name: str, what: str) -> tuple[str, ...]:
    """Compare the thesis' network with the best other method in one sentence; empty where either is missing."""
    network = next((row for row in rows if row["method"] == THESIS and row[name] is not None), None)
    known = [row for row in rows if row["method"] != THESIS and row[name] is not None]
    if network is None or not known:
        return ()
    best = min(known, key=lambda row: row[name])
    if best[name] <= 0:
        return (f"{best['title']} is without error; the network of the thesis has a {what} of {network[name]:.2f}.",)
    more = network[name] / best[name] - 1
    numbers = f"{what} {network[name]:.2f} against {best[name]:.2f} of {best['title']}"
    if more > ALLOWED:
        return (f"The network of the thesis is beaten: {numbers}, {more:.0%} more; {ALLOWED:.0%} was allowed.",)
    if more > 0:
        return (f"The network of the thesis is {more:.1%} behind the best other method: {numbers}.",)
    return (f"The network of the thesis is the best, by {-more:.1%}: {numbers}.",)


@dataclass(frozen=True)
class DoorEvaluation:
    """The content of tables, figures and the report.

    `forward` and `inverse` are the rows of the two tables of all methods; `choices` holds the default of each evaluated
    direction; `ceilings` the noise ceilings, and `no_ceiling` the reason where there are none.
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
    """Evaluate every requested method. Raises ModelDataError, or JobError for what a method raises."""
    domain = domain_for(data, options)
    results = evaluate_methods(domain, options, report)
    forward, inverse = method_rows(results, "forward"), method_rows(results, "inverse")
    choices: dict[Direction, Choice] = {}
    if forward:
        choices["forward"] = forward_choice(forward)
    if inverse:
        choices["inverse"] = inverse_choice(inverse)
    ceilings, why = _noise_ceilings(data, individual, options.seed)
    report("the measured door")
    recovered: tuple[Recovered, ...] = ()
    if len(choices) == 2:  # by the default methods: nothing else is trained for it
        methods: dict[Direction, str] = {way: choice.method for way, choice in choices.items()}
        default = next(method for method in results.methods("forward") if method.method == methods["forward"])
        recovered = recover_measured(results.domain, methods, default)
    return DoorEvaluation(results, forward, inverse, choices, ceilings, why, tuple(floors(domain)), recovered)


def _noise_ceilings(data: DoorData, individual: Individual | None, seed: int) -> tuple[tuple[Ceiling, ...], str]:
    if individual is None:
        return (), "A table of means holds no single ratings: their noise is unknown."
    try:
        rated = Rated(data, individual)
        return tuple(noise_ceiling(rated, of=of, seed=seed) for of in ("other_people", "same_people")), ""
    except ModelDataError as refusal:
        return (), str(refusal)
