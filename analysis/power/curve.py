"""The share of simulated studies in which a plan's test detects its effect, by number of participants."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.analysis.figures.style import INK, OKABE_ITO, SOFT, drawing, quiet_axes, save
from palpate.analysis.plans.reading import read_plan
from palpate.analysis.plans.selecting import Selector, apply_exclusions
from palpate.analysis.power.p_values import PValue, demand_p, p_of
from palpate.analysis.power.request import MOST_RUNS, PowerError, PowerRequest, check_request, file_name, only
from palpate.analysis.power.simulated_studies import people, simulated_material, with_effect
from palpate.analysis.ratings.reading import Material
from palpate.analysis.regenerating.regeneration import read_table, run_tests
from palpate.analysis.reports.csv_files import csv_text
from palpate.protocols.files import staged_files, write_text
from palpate.protocols.progress import Clock, Progress
from palpate.studies.catalogue import read_study
from palpate.studies.workers import map_in_order

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import QuestionResult


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
    run has its own seed: the result depends neither on `jobs` nor on the other sizes. Raises as `check_power` does.
    """
    sizes = sorted(set(sizes))
    check_power(request)
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


def check_power(request: PowerRequest) -> None:
    """Answer the test for one simulated study of two people, so that a mistake is known before a long run.

    Raises PowerError or PlanError where test, outcome or row do not exist, or the answer has no p value.
    """
    check_request(request)
    for _, result in results_of(request, (2,), 0):
        if result.answer is not None:
            demand_p(result, request)


def estimate_s(
    request: PowerRequest, sizes: Sequence[int], runs: int, jobs: int, clock: Clock = time.perf_counter
) -> float:
    """Return about how many seconds `power_curve` takes, from timing one small study and one of half the largest size.

    The time is assumed to be linear in the number of participants. Raises as `check_power` does.
    """
    check_power(request)  # what is imported is not timed
    half = max(2, sizes[-1] // 2)
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


def one_run(todo: tuple[PowerRequest, tuple[int, ...], int]) -> dict[int, PValue]:
    """Simulate one study; return p for each number of participants, or None and the reason."""
    request, sizes, run = todo
    p_values = {}
    for size, result in results_of(request, sizes, run):
        if result.answer is None:
            p_values[size] = PValue(None, result.refused)
        else:
            p_values[size] = p_of(result.answer, request.test, request.row, request.column)
    return p_values


def results_of(request: PowerRequest, sizes: Sequence[int], run: int) -> Iterator[tuple[int, QuestionResult]]:
    """Simulate one study and yield the test's result for its first participants, as many as each of `sizes`.

    Of several outcomes it is the first that has an answer.
    """
    study_files = read_study(request.study_file)
    plan = only(read_plan(request.plan_file), request, study_files.study)
    study = with_effect(study_files.study, request.effect)
    material = simulated_material(study, request.lab, people(sizes[-1]), request.seed * MOST_RUNS + run)
    for size in sizes:
        left = apply_exclusions(_of_people(material, people(size)), plan.declared).material
        tables = {name: read_table(plan.table_path(name)) for name in plan.declared.tables}
        answered = run_tests(Selector(left, plan, tables))
        if not answered:
            raise PowerError(f"{request.test}: the study has no outcome that it could be about")
        yield size, next((result for result in answered if result.answer is not None), answered[0])


def _of_people(material: Material, participants: Sequence[str]) -> Material:
    return material.filtered(lambda table: table["participant"].isin(participants))


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
    what = file_name(request.test, request.outcome, request.row, request.column)
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
