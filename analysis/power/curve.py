"""The share of simulated studies in which a plan's test detects its effect, by number of participants."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from palpate.analysis.figures.style import INK, OKABE_ITO, SOFT, drawing, quiet_axes, save
from palpate.analysis.plans.answers import Answer, Row, StatisticSettings
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.plans.reading import Plan, PlanError, read_plan
from palpate.analysis.plans.selecting import Selector, apply_exclusions
from palpate.analysis.power.simulated_studies import people, simulated_material, with_effect
from palpate.analysis.ratings.reading import Material
from palpate.analysis.regenerating.regeneration import read_table, run_tests
from palpate.analysis.reports.csv_files import csv_text
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.files import staged_files, write_text
from palpate.protocols.progress import Clock, Progress
from palpate.protocols.study import Study
from palpate.studies.catalogue import read_study
from palpate.studies.workers import map_in_order

MOST_RUNS = 100_000
"""The number of studies with seeds of their own, before those of the next --seed begin."""
P_COLUMNS = ("p_corr", "p_corrected", "p", "p_GG_corr", "p_unc", "p_F")
"""The columns that may have a row's p value, the most conservative first."""
INTERCEPT = "(Intercept)"
__all__ = ["PlanError", "Point", "PowerError", "PowerRequest", "needed", "power_curve"]


@dataclass(frozen=True)
class PowerRequest:
    """A request for a power curve: a study file, a plan, one of its tests, and the row of the answer with the effect.

    `row` and `column` are as for `p_of`. Different seeds give different people. `effect` multiplies what the study's
    simulated people feel.
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
    """A point of the curve: the numbers of runs with p of at most alpha, and without p, for a number of participants.

    `power` counts a run without p as no detection, `why` is the first reason; `by` names the row and the column of p;
    `low` and `high` are the 95 % interval of `power` (Wilson 1927).
    """

    participants: int
    runs: int
    found: int
    undefined: int
    power: float
    low: float
    high: float
    why: str = ""
    by: str = ""


def power_curve(
    request: PowerRequest, sizes: Sequence[int], runs: int, jobs: int = 1, progress: Progress = lambda *_: None
) -> list[Point]:
    """Simulate `runs` studies and test each with its first 2, 3, ... participants, as in `sizes`.

    A study's participants are the same for every size, so the curve is smooth and as cheap as its largest size. Each
    run has its own seed: the result depends neither on `jobs` nor on the other sizes. Raises PowerError or PlanError
    where test, outcome or row do not exist.
    """
    sizes = sorted(set(sizes))
    check_request(request)
    outcomes: list[Mapping[int, PValue]] = []
    title = f"{request.test}, up to {sizes[-1]} participants"
    progress(0, runs, title)
    todo = [(request, tuple(sizes), run) for run in range(runs)]
    with closing(map_in_order(one_run, todo, min(jobs, runs))) as studies:
        for done, p_values in enumerate(studies, start=1):
            outcomes.append(p_values)
            progress(done, runs, title)
    points = []
    for size in sizes:
        of_size = [p_values[size] for p_values in outcomes]
        found = sum(outcome.p is not None and outcome.p <= request.alpha for outcome in of_size)
        missing = [outcome.why for outcome in of_size if outcome.p is None]
        by = next((outcome.by for outcome in of_size if outcome.by), "")
        low, high = wilson(found, len(of_size))
        why = missing[0] if missing else ""
        points.append(Point(size, len(of_size), found, len(missing), found / len(of_size), low, high, why, by))
    return points


def check_request(request: PowerRequest) -> StatisticSettings:
    """Return the requested test of the plan.

    Raises PowerError if the test or its outcome does not exist, or the study simulates nobody.
    """
    plan, study = read_plan(request.plan_file), read_study(request.study_file).study
    names = [test.name for test in plan.tests]
    if request.test not in names:
        raise PowerError(f"{plan.path}: no test {request.test!r}; {nearest(request.test, names)}")
    observer = None if study.simulation is None or not study.procedure else study.simulation.observer
    if study.simulation is None or (not study.simulation.latents and observer is None):
        raise PowerError(f"{request.study_file}: the study does not say how simulated people perceive (simulation:)")
    test = plan.tests[names.index(request.test)]
    if test.table is not None:
        raise PowerError(f"{request.test}: asks about the plan's table {test.table!r}, which nobody simulates")
    if observer is not None and request.effect != 1 and not isinstance(observer.threshold, dict):
        raise PowerError(
            f"{request.study_file}: simulated people have one threshold for all tracks, so there is no difference that "
            "--effect could change; give one for each track, simulation: {observer: {threshold: {TRACK: LEVEL}}}"
        )
    known = [attribute.name for attribute in study.attributes]
    if request.outcome and known and request.outcome not in known:
        raise PowerError(f"{request.test}: no outcome {request.outcome!r}; {nearest(request.outcome, known)}")
    return test


def estimate_s(
    request: PowerRequest, sizes: Sequence[int], runs: int, jobs: int, clock: Clock = time.perf_counter
) -> float:
    """Return about how many seconds `power_curve` takes, from timing one small study and one of half the largest size.

    The time is assumed to be linear in the number of participants. Raises as `power_curve` does.
    """
    check_request(request)
    half = max(2, sizes[-1] // 2)
    one_run((request, (2,), 0))  # what is imported is not timed
    seconds = []
    for participants in (2, half):
        start = clock()
        one_run((request, (participants,), 0))
        seconds.append(clock() - start)
    few, many = seconds
    per_person = max(0.0, (many - few) / (half - 2)) if half > 2 else 0.0
    largest = few + per_person * (sizes[-1] - 2)
    tests = (len(sizes) - 1) / 2 * few  # the smaller sizes are tests of the same people
    return (largest + tests) * runs / min(jobs, runs)


def _tables(material: Material) -> dict[str, pd.DataFrame]:
    """Return the material's tables by name that have a row for each answer, without ratings and empty choices."""
    tables = {"trials": material.trials, "words": material.words, "forms": material.forms}
    return tables | ({"choices": material.choices} if len(material.choices) else {})


def one_run(todo: tuple[PowerRequest, tuple[int, ...], int]) -> dict[int, PValue]:
    """Simulate one study; return p for each number of participants, or None and the reason."""
    request, sizes, run = todo
    study_files = read_study(request.study_file)
    plan = only(read_plan(request.plan_file), request, study_files.study)
    study = with_effect(study_files.study, request.effect)
    material = simulated_material(study, request.lab, people(sizes[-1]), request.seed * MOST_RUNS + run)
    p_value = {}
    for size in sizes:
        here = set(people(size))
        ratings = material.ratings
        parts: dict[str, Any] = {
            name: table[table["participant"].isin(here)].reset_index(drop=True)
            for name, table in _tables(material).items()
        }
        if ratings is not None:
            rows = ratings.table
            parts["ratings"] = replace(ratings, table=rows[rows["participant"].isin(here)].reset_index(drop=True))
        left = apply_exclusions(replace(material, **parts), plan.declared).material
        tables = {name: read_table(plan.table_path(name)) for name in plan.declared.tables}
        answered = run_tests(Selector(left, plan, tables))
        answer = next((result.answer for result in answered if result.answer is not None), None)
        if answer is None:
            p_value[size] = PValue(None, next((result.refused for result in answered), "no answer"))
            continue
        p_value[size] = p_of(answer, request.test, request.row, request.column)
    return p_value


def only(plan: Plan, request: PowerRequest, study: Study) -> Plan:
    """Return the plan with the requested test only, for one outcome if outcomes are answered separately."""
    test = next(item for item in plan.tests if item.name == request.test)
    kind = TESTS[test.test]
    first = next((item.name for item in study.attributes), "") if kind.each == "outcome" else ""
    if (outcome := request.outcome or first) and (test.source or kind.takes) == "ratings":
        test = test.model_copy(update={"outcomes": (outcome,)})
    return replace(plan, tests=(test,), figures=())


def wilson(hits: int, runs: int, z: float = 1.959963984540054) -> tuple[float, float]:
    """Return the 95 % interval of a share (Wilson 1927, J. Am. Stat. Assoc. 22, 209-212)."""
    share, square = hits / runs, z * z
    centre = (share + square / (2 * runs)) / (1 + square / runs)
    half = z / (1 + square / runs) * math.sqrt(share * (1 - share) / runs + square / (4 * runs * runs))
    return max(0.0, centre - half), min(1.0, centre + half)


def needed(points: Sequence[Point], power: float) -> Point | None:
    """Return the first size from which on all sizes reach the power; None if the last one does not."""
    reached = None
    for point in reversed(points):
        if point.power < power:
            break
        reached = point
    return reached


def suffices(points: Sequence[Point], planned: int | None, power: float) -> bool | None:
    """Return whether the planned number has the power; None if it was not simulated, or no run gave p."""
    tested = (point for point in points if point.undefined < point.runs)
    return next((point.power >= power for point in tested if point.participants == planned), None)


def write_curve(points: Sequence[Point], request: PowerRequest, target: float, folder: Path) -> list[Path]:
    """Write power_TEST_xEFFECT.csv, .svg and .png to `folder` and return the paths; other requests have other names."""
    what = re.sub(r"[^\w.]+", "-", "_".join(filter(None, (request.test, request.outcome, request.row, request.column))))
    name = f"power_{what}_x{request.effect:g}"
    fields = ("test", "outcome", "row", "column", "effect", "alpha", "seed")
    rows = [{**asdict(point), **{key: getattr(request, key) for key in fields}} for point in points]
    with staged_files(folder) as draft:
        paths = [write_text(draft / f"{name}.csv", csv_text(rows)), *_draw_curve(points, request, target, draft, name)]
    return [folder / path.name for path in paths]


def _draw_curve(points: Sequence[Point], request: PowerRequest, target: float, folder: Path, name: str) -> list[Path]:
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    with drawing(name):
        figure = Figure(figsize=(5.6, 3.4), layout="constrained")
        axes = figure.subplots()
        sizes = [point.participants for point in points]
        low, high = [point.low for point in points], [point.high for point in points]
        axes.fill_between(sizes, low, high, color=OKABE_ITO[0], alpha=0.18, linewidth=0)
        axes.plot(
            sizes, [point.power for point in points], color=OKABE_ITO[0], marker="o", markersize=4.5, linewidth=1.6
        )
        axes.axhline(target, color=SOFT, linewidth=0.8, linestyle=(0, (4, 3)))
        axes.text(sizes[-1], target, f"target: {target:g}", ha="right", va="bottom", fontsize=8, color=SOFT)
        axes.set_ylim(0, 1.02)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel("participants", color=INK)
        axes.set_ylabel(f"share of {points[0].runs} runs with p ≤ {request.alpha:g}")
        subject = " ".join(filter(None, (request.test, request.outcome)))
        axes.set_title(f"{subject} ({points[-1].by or 'no p'}), effect × {request.effect:g}")
        quiet_axes(axes)
        return save(figure, folder, name)


class PValue(NamedTuple):
    """A p value, or None and why it is undefined; `by` names its row and column."""

    p: float | None
    why: str = ""
    by: str = ""


def p_of(answer: Answer, test: str, row: str = "", column: str = "") -> PValue:
    """Return the p value of the requested row.

    `row` is the text of a cell of it, or several separated by commas; "" means the first row that is no intercept, or
    the first difference where only differences have a p value, as those of thresholds.
    Raises PowerError if there is no such row or column, no p value at all, or more than one row.
    """
    match = next((row_of for row_of in answer.rows if INTERCEPT not in row_of.values()), None)
    if row:
        match = _row_with(answer, test, row)
    if match is None:
        raise PowerError(f"{test}: its answer has no row")
    if not row and not column and not any(name in match for name in P_COLUMNS):
        match = next(iter(answer.more.get("differences", ())), match)
    columns = [column] if column else [name for name in P_COLUMNS if name in match]
    known = [name for name in match if name == "p" or name.startswith("p_")]
    if not known:
        what = f"the row {row!r} has" if row else "this test has"
        raise PowerError(f"{test}: {what} no p value, and power is how often p is at most alpha")
    if not columns or columns[0] not in match:
        what = f"no column {column!r}" if column else "name the column of its p value with --p"
        raise PowerError(f"{test}: {what}; {nearest(column, known)}")
    value, by = match[columns[0]], f"{', '.join(_row_texts(match))}: {columns[0]}"
    if isinstance(value, int | float) and math.isfinite(value):
        return PValue(float(value), by=by)
    return PValue(None, str(match.get("note") or "p is undefined"), by)


def _row_with(answer: Answer, test: str, text: str) -> Row:
    """Return the only row with the text, in the answer or else in one of its further tables."""
    for rows in (answer.rows, *answer.more.values()):
        matches = []
        for row in rows:
            texts = _row_texts(row)
            if text in texts or all(part.strip() in texts for part in text.split(",")):
                matches.append(row)
        if len(matches) == 1:
            return matches[0]
        if matches:
            matches_text = "; ".join(", ".join(_row_texts(row)) for row in matches[:4])
            raise PowerError(
                f"{test}: {len(matches)} rows hold {text!r} ({matches_text}{'; ...' if len(matches) > 4 else ''});"
                " name one, its texts divided by commas"
            )
    known = dict.fromkeys(text for row in answer.rows for text in _row_texts(row))
    raise PowerError(f"{test}: no row with {text!r}; {nearest(text, known)}")


def _row_texts(row: Row) -> Sequence[str]:
    return [value for name, value in row.items() if isinstance(value, str) and value and name != "note"]


class PowerError(ValueError):
    """The power of this test cannot be simulated as requested."""
