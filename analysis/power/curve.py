"""The share of simulated studies in which a plan's test finds its effect, for each number of participants."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from analysis.plans.answers import Answer, Asked, Row
from analysis.plans.exclusions import apply_exclusions
from analysis.plans.kinds import test_kind
from analysis.plans.material import Material
from analysis.plans.reading import Plan, PlanError, read_plan
from analysis.plans.selecting import Selecting
from analysis.power.simulating import people, simulated_material, with_effect
from analysis.regenerating.running import run_tests
from protocols.did_you_mean import nearest
from protocols.study import Study
from studies.catalogue import read_study

Progress = Callable[[int, int, str], None]
P_COLUMNS = ("p_adjusted", "p_holm", "p_bonferroni", "p_reported", "p", "p_greenhouse_geisser", "p_uncorrected")
"""Where a row's p value stands, the most cautious first."""


class PowerError(ValueError):
    """The power of this test cannot be simulated as asked."""


@dataclass(frozen=True)
class Asking:
    """What is simulated: a study file, a plan, one of its tests, and which row of the answer is the effect.

    `row` is text that a cell of the row holds ("" takes the first row), `column` that of its p value ("" finds it).
    `effect` multiplies what the study's simulated people feel.
    """

    study_file: Path
    plan_file: Path
    lab: Path
    test: str
    outcome: str = ""
    row: str = ""
    column: str = ""
    effect: float = 1.0
    alpha: float = 0.05
    seed: int = 0


@dataclass(frozen=True)
class Point:
    """One number of participants: in how many of the runs p was at most alpha, and in how many there was no p.

    `power` counts a run without a p as one that found nothing; `low` and `high` bound it (Wilson 1927, 95 %).
    """

    participants: int
    runs: int
    found: int
    undefined: int
    power: float
    low: float
    high: float
    why: str = ""


def power_curve(
    asking: Asking, sizes: Sequence[int], runs: int, jobs: int = 1, progress: Progress = lambda *_: None
) -> list[Point]:
    """Simulate `runs` studies and test each with its first 2, 3, ... participants, as `sizes` asks.

    A study's participants are the same for every size, so the curve is smooth and as cheap as its largest size. Run r
    is seeded with seed + r: the result depends neither on `jobs` nor on what else is asked.
    Raises PowerError or PlanError where test, outcome or row do not exist.
    """
    sizes = sorted(set(sizes))
    check_asking(asking)
    outcomes: list[Mapping[int, tuple[float | None, str]]] = []
    for done, each in enumerate(_runs(asking, sizes, runs, jobs)):
        outcomes.append(each)
        progress(done + 1, runs, f"{asking.test}, up to {sizes[-1]} participants")
    return [_point(size, [each[size] for each in outcomes], asking.alpha) for size in sizes]


def check_asking(asking: Asking) -> Asked:
    """The plan's test that is meant. Raises PowerError where it or its outcome does not exist, or it has no model."""
    plan, study = read_plan(asking.plan_file), read_study(asking.study_file).study
    names = [each.name for each in plan.tests]
    if asking.test not in names:
        raise PowerError(f"{plan.path}: no test {asking.test!r}; {nearest(asking.test, names)}")
    if study.simulation is None or not study.simulation.latents:
        raise PowerError(f"{asking.study_file}: the study does not say how simulated people perceive (simulation:)")
    known = [each.name for each in study.attributes]
    if asking.outcome and known and asking.outcome not in known:
        raise PowerError(f"{asking.test}: no outcome {asking.outcome!r}; {nearest(asking.outcome, known)}")
    return plan.tests[names.index(asking.test)]


def _runs(
    asking: Asking, sizes: Sequence[int], runs: int, jobs: int
) -> Iterator[Mapping[int, tuple[float | None, str]]]:
    todo = [(asking, tuple(sizes), run) for run in range(runs)]
    if jobs == 1:
        yield from map(one_run, todo)
        return
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(one_run, todo)


def one_run(todo: tuple[Asking, tuple[int, ...], int]) -> dict[int, tuple[float | None, str]]:
    """One simulated study: for each number of participants the p value, or None and why."""
    asking, sizes, run = todo
    found = read_study(asking.study_file)
    plan = only(read_plan(asking.plan_file), asking, found.study)
    study = with_effect(found.study, asking.effect)
    material = simulated_material(study, asking.lab, people(sizes[-1]), asking.seed + run)
    return {size: _p(material, plan, asking, size) for size in sizes}


def only(plan: Plan, asking: Asking, study: Study) -> Plan:
    """The plan with nothing but the test that is meant, for one outcome where it is asked for each by itself."""
    asked = next(each for each in plan.tests if each.name == asking.test)
    kind = test_kind(asked.test)
    first = next((each.name for each in study.attributes), "") if kind.each == "outcome" else ""
    if (outcome := asking.outcome or first) and (asked.source or kind.takes) == "ratings":
        asked = asked.model_copy(update={"outcomes": (outcome,)})
    return replace(plan, tests=(asked,), figures=())


def _p(material: Material, plan: Plan, asking: Asking, size: int) -> tuple[float | None, str]:
    here = set(people(size))
    left = apply_exclusions(_first(material, here), plan.declared).material
    answered = run_tests(Selecting(left, plan, {}))
    answer = next((each.answer for each in answered if each.answer is not None), None)
    if answer is None:
        return None, next((each.refused for each in answered), "no answer")
    return p_of(answer, asking)


def _first(material: Material, here: set[str]) -> Material:
    ratings = material.ratings
    parts: dict[str, Any] = {
        name: table[table["participant"].isin(here)].reset_index(drop=True)
        for name, table in (("trials", material.trials), ("words", material.words), ("forms", material.forms))
    }
    if ratings is not None:
        rows = ratings.table
        parts["ratings"] = replace(ratings, table=rows[rows["participant"].isin(here)].reset_index(drop=True))
    return replace(material, **parts)


def p_of(answer: Answer, asking: Asking) -> tuple[float | None, str]:
    """The p value of the row that is meant. Raises PowerError where there is no such row or column."""
    row = _row(answer.rows, asking)
    columns = [asking.column] if asking.column else [name for name in P_COLUMNS if name in row]
    if not columns or columns[0] not in row:
        known = [name for name in row if name.startswith("p")]
        raise PowerError(
            f"{asking.test}: no column {asking.column or 'of p values'!r}; {nearest(asking.column, known)}"
        )
    value = row[columns[0]]
    if isinstance(value, int | float) and math.isfinite(value):
        return float(value), ""
    return None, str(row.get("note") or "p is undefined")


def _row(rows: Iterable[Row], asking: Asking) -> Row:
    found = list(rows)
    if not asking.row and found:
        return found[0]
    for row in found:
        if asking.row in [value for value in row.values() if isinstance(value, str)]:
            return row
    texts = dict.fromkeys(value for row in found for value in row.values() if isinstance(value, str) and value)
    raise PowerError(f"{asking.test}: no row with {asking.row!r}; {nearest(asking.row, texts)}")


def _point(size: int, outcomes: Sequence[tuple[float | None, str]], alpha: float) -> Point:
    runs = len(outcomes)
    found = sum(p is not None and p <= alpha for p, _ in outcomes)
    missing = [why for p, why in outcomes if p is None]
    low, high = wilson(found, runs)
    return Point(size, runs, found, len(missing), found / runs, low, high, missing[0] if missing else "")


def wilson(found: int, runs: int, z: float = 1.959963984540054) -> tuple[float, float]:
    """The 95 % interval of a share (Wilson 1927, J. Am. Stat. Assoc. 22, 209-212)."""
    share, square = found / runs, z * z
    centre = (share + square / (2 * runs)) / (1 + square / runs)
    half = z / (1 + square / runs) * math.sqrt(share * (1 - share) / runs + square / (4 * runs * runs))
    return max(0.0, centre - half), min(1.0, centre + half)


def needed(points: Sequence[Point], power: float) -> Point | None:
    """The first size from which on the power is reached at every larger size, None where the last one fails."""
    reached = None
    for point in reversed(points):
        if point.power < power:
            break
        reached = point
    return reached


__all__ = ["Asking", "PlanError", "Point", "PowerError", "needed", "power_curve"]
