"""The verb `power`: how many participants a plan's test needs to find its effect."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from palpate.protocols.registry import load_object
from palpate.studies.options import JSON, LAB, echo_json, progress_bar

if TYPE_CHECKING:
    from palpate.analysis.power.curve import Point
    from palpate.analysis.power.request import PowerRequest


RUNS, QUICK_RUNS = 200, 20


class PrecisionTargets(NamedTuple):
    """Numbers of trials and participants to plan by, and the SD and the width to reach (None: none is named)."""

    trials: tuple[int, ...]
    sizes: tuple[int, ...]
    planned: int | None
    sd: float | None
    width: float | None


class Numbers(click.ParamType):  # type: ignore[type-arg]  # not generic in click 8.1
    """A parameter type for several numbers of `what`: `8..40`, `8..40/4` (in steps of 4), or `8,12,24`.

    `most` is a number, or the place of one ("module:NAME"), which is imported when the option is used.
    """

    name = "numbers"

    def __init__(self, least: int, most: int | str, what: str) -> None:
        self.least, self.most, self.what = least, most, what

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, ...]:
        """Return the numbers in order, at most 60."""
        text = str(value).strip()
        match = re.fullmatch(r"(\d+)\.\.(\d+)(?:/([1-9]\d*))?", text)
        if match:
            first, last = int(match[1]), int(match[2])
            step = int(match[3]) if match[3] else max(1, (last - first) // 9)
            sizes = [*range(first, last, step), last] if first < last and step else [last]
        elif re.fullmatch(r"\d+(,\d+)*", text):
            sizes = [int(part) for part in text.split(",")]
        else:
            self.fail(f"{text!r}: a range such as 8..40, 8..40/4, or a list such as 8,12,24 is expected", param, ctx)
        most = load_object(self.most) if isinstance(self.most, str) else self.most
        if match and int(match[1]) > int(match[2]):
            self.fail(f"{text!r}: the smallest number is expected first", param, ctx)
        if min(sizes) < self.least or max(sizes) > most or len(sizes) > 60:
            self.fail(f"{text!r}: from {self.least} to {most} {self.what} are expected, at most 60 numbers", param, ctx)
        return tuple(sorted(set(sizes)))


@click.command()
@click.argument("study")
@LAB
@click.option(
    "--test", required=True, help="The test of the analysis plan that is to find the effect, or gives thresholds."
)
@click.option("--outcome", default="", help="The attribute that it tests.  [default: the study's first]")
@click.option(
    "--row",
    default="",
    help="The row of its answer by its texts: method, or AR,DSTN; with --trials threshold or jnd.  [default: first]",
)
@click.option("--p", "column", default="", help="The column of the p value.  [default: the most cautious]")
@click.option(
    "--effect", type=click.FloatRange(0, 10), default=1.0, show_default=True,
    help="How much of the differences that the study's simulated people feel; 0 shows the rate of false alarms.",
)  # fmt: skip
@click.option(
    "--participants",
    "sizes",
    type=Numbers(2, 999, "participants"),
    help="How many: 8..40/4.  [default: up to what the study plans, else 4..40]",
)
@click.option(
    "--trials", type=Numbers(1, "palpate.protocols.procedures:MOST_TRIALS", "trials"),
    help="Plan thresholds by precision, for tracks of so many trials (constant stimuli: repeats): 24,32,48,64.",
)  # fmt: skip
@click.option(
    "--sd", type=click.FloatRange(0, min_open=True), help="Precision: the SD of a person's threshold to reach."
)
@click.option(
    "--width", type=click.FloatRange(0, min_open=True), help="Precision: the width of 95 % intervals to reach."
)
@click.option(
    "--runs", type=click.IntRange(10, 100_000),
    help="Studies to simulate; with --trials: people.  [default: 200; --quick: 20]",
)  # fmt: skip
@click.option("--quick", is_flag=True, help="A first look: 20 studies; intervals up to 40 points wide, not 14.")
@click.option("--power", "target", type=click.FloatRange(0.01, 0.999), default=0.8, show_default=True)
@click.option("--seed", type=click.IntRange(0, 1_000_000), default=0, show_default=True)
@click.option("--jobs", type=click.IntRange(1, 256), default=None, help="Processes.  [default: one for each core]")
@click.option("--plan", "plan_file", type=click.Path(dir_okay=False, path_type=Path), help="The analysis plan.")
@JSON
def power(
    study: str, lab: Path, test: str, outcome: str, row: str, column: str, effect: float, sizes: tuple[int, ...] | None,
    trials: tuple[int, ...] | None, sd: float | None, width: float | None, runs: int | None, quick: bool,
    target: float, seed: int, jobs: int | None, plan_file: Path | None, as_json: bool,
) -> None:  # fmt: skip
    """How many participants STUDY needs for a test of its analysis plan to find its effect.

    Runs whole simulated studies through the real runner, each with its own simulated people, and asks the plan's own
    test of the first 2, 3, ... of them. The effect is what these people feel (simulation: in the study file), times
    --effect. Where the study plans a sample, it says whether that is enough. Writes power_TEST_xEFFECT.csv and a figure
    to LAB/analysis/STUDY.

    With --trials, --sd or --width it plans thresholds by their precision instead: how exactly tracks of so many trials
    measure a person (bias, SD, interval), and how wide the interval of a mean or a difference is with so many
    participants. Writes precision_TEST_trials.csv, precision_TEST_participants.csv and a figure.

    \b
    Examples: palpate power texture_similarity --test methods --effect 0.3 --participants 4..24
              palpate power vibration_threshold --test thresholds --trials 24,48,96 --sd 1.5 --width 5
    """
    from palpate.analysis.power.request import PowerRequest
    from palpate.analysis.ratings.sources import DataRequest
    from palpate.analysis.regenerating.regeneration import find_plan
    from palpate.protocols.sample import planned_people
    from palpate.studies.catalogue import find, read_study

    file = find(study, lab)
    name, plan = find_plan(DataRequest(study, lab), plan_file)
    planned = planned_people(read_study(file).study)
    if not sizes:  # about ten up to the planned number, itself among them, or 4 to 40
        most = min(max(planned or 40, 2), 999)
        sizes = tuple(sorted({*range(min(4, most), most, max(1, (most - 4) // 9)), most}))
    request = PowerRequest(file, plan.path, lab, test, outcome, row, column, effect, plan.declared.alpha, seed)
    runs, jobs = runs or (QUICK_RUNS if quick else RUNS), jobs or os.cpu_count() or 1
    folder = lab / "analysis" / name
    if trials or sd is not None or width is not None:
        _refuse_options_of_power()
        result, files = _plan_by_precision(
            request, PrecisionTargets(trials or (), sizes, planned, sd, width), runs, jobs, as_json, folder
        )
    else:
        result, files = _plan_by_power(request, sizes, planned, target, runs, jobs, as_json, folder)
    if as_json:
        echo_json({"study": name, "test": test, **result, "files": list(map(str, files))})
        return
    click.echo(f"Written to {folder}: {', '.join(file.name for file in files)}")


def _plan_by_power(
    request: PowerRequest, sizes: tuple[int, ...], planned: int | None, target: float, runs: int, jobs: int,
    as_json: bool, folder: Path,
) -> tuple[dict[str, Any], list[Path]]:  # fmt: skip
    """Simulate studies, write the curve, and print it unless it is to be JSON; return the JSON data and the files."""
    from palpate.analysis.power.curve import estimate_s, needed, power_curve, suffices, write_curve

    _say_time(
        as_json,
        f"{runs} simulated studies of {sizes[-1]} participants",
        lambda: estimate_s(request, sizes, runs, jobs),
    )
    with progress_bar(as_json) as progress:
        points = power_curve(request, sizes, runs, jobs, progress)
    enough = needed(points, target)
    if not as_json:
        _show(points, request, target, enough)
        if planned is not None:
            click.echo(planned_verdict(points, planned, target))
    return {
        "effect": request.effect,
        "power": target,
        "needed": enough.participants if enough else None,
        "planned": planned,
        "planned_is_enough": suffices(points, planned, target),
        "points": [vars(point) for point in points],
    }, write_curve(points, request, target, folder)


def _plan_by_precision(
    request: PowerRequest, targets: PrecisionTargets, runs: int, jobs: int, as_json: bool, folder: Path
) -> tuple[dict[str, Any], list[Path]]:
    """Simulate people, write the tables, and print them unless they are to be JSON; return the data and the files."""
    from palpate.analysis.power.precision import estimate_precision_s, precision
    from palpate.analysis.power.precision_files import write_precision
    from palpate.analysis.power.precision_report import precision_answers, print_precision

    trials, sizes, planned, sd, width = targets
    _say_time(as_json, f"{runs} simulated people", lambda: estimate_precision_s(request, trials, runs, jobs))
    with progress_bar(as_json) as progress:
        measured = precision(request, trials, sizes, runs, jobs, progress, planned)
    if not as_json:
        print_precision(measured, request, runs)
        for line in precision_answers(measured, sd, width):
            click.echo(line)
    return {
        "quantity": request.row or "threshold",
        "answers": precision_answers(measured, sd, width),
        "tracks": [vars(point) for point in measured.tracks],
        "means": [vars(point) for point in measured.means],
    }, write_precision(measured, request, sd, width, folder)


def _refuse_options_of_power() -> None:
    """Raise UsageError for options that have no meaning where thresholds are planned by their precision."""
    context = click.get_current_context()
    names = {"outcome": "--outcome", "column": "--p", "effect": "--effect", "target": "--power"}
    typed = click.core.ParameterSource.COMMANDLINE
    given = [text for name, text in names.items() if context.get_parameter_source(name) == typed]
    if given:
        raise click.UsageError(
            f"{', '.join(given)}: found together with --trials, --sd or --width, which plan by precision, not by p; "
            "leave it out"
        )


def _say_time(as_json: bool, what: str, estimate: Callable[[], float]) -> None:
    """Say on a terminal about how long the work takes."""
    from palpate.analysis.monitoring.words import rough

    if not as_json and sys.stderr.isatty():
        click.echo(f"{what}: {rough(estimate())}", err=True)


def planned_verdict(points: Sequence[Point], planned: int, target: float) -> str:
    """Return whether the planned number of participants has the power, or why that is unknown, as text."""
    from palpate.analysis.power.curve import suffices

    sample = f"the planned sample of {planned}"
    enough = suffices(points, planned, target)
    if enough is not None:
        return f"{sample} is {'enough' if enough else 'not enough'} for power {target:g}"
    point = next((point for point in points if point.participants == planned), None)
    if point is None:
        return f"{sample} is not one of the simulated sizes: add it to --participants"
    return f"whether {sample} is enough is not known: no simulated study gave a p value: {point.why}"


def _show(points: list[Point], request: PowerRequest, target: float, enough: Point | None) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("participants", "power", "95 % interval", box=None, pad_edge=False)
    for point in points:
        without = f"  ({point.undefined} runs without a p)" if point.undefined else ""
        table.add_row(f"{point.participants}", f"{point.power:.2f}", f"{point.low:.2f} to {point.high:.2f}{without}")
    Console(highlight=False).print(table)
    for why in dict.fromkeys(point.why for point in points if point.why):
        click.echo(f"without a p, which counts as no effect: {why}")
    decided = points[-1].by or "no p"
    what = f"{request.test} ({decided}), effect × {request.effect:g}, {points[0].runs} simulated studies"
    if enough is None:
        click.echo(f"{what}: power {target:g} is not reached with {points[-1].participants} participants")
        return
    click.echo(f"{what}: power {target:g} from {enough.participants} participants on (here {enough.power:.2f})")
