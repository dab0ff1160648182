"""What is printed of how exactly thresholds are measured: two tables, and the numbers that meet a target."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

import click
from rich.console import Console
from rich.table import Table

from palpate.analysis.power.precision import ASSURED, people_needed, trials_needed
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.analysis.power.precision import MeanPrecision, Precision
    from palpate.analysis.power.request import PowerRequest

EARLY = 0.95
"""Tracks that use fewer of their trials than this share end early."""
NONE = "–"


def print_precision(precision: Precision, request: PowerRequest, runs: int) -> None:
    """Print how exactly a person is measured, by trials, and means, by participants, at the study's own number."""
    console, number = Console(highlight=False), _format(precision)
    what = {"jnd": "JND"}.get(request.row, "threshold")
    click.echo(
        f"A person's {what} ({request.test}), {count(runs, 'simulated person', 'simulated people')}; * the study"
    )
    headings = (precision.counted, "track", "used", "bias", "SD", "95 % interval", "without a number")
    table = Table(*headings, box=None, pad_edge=False)
    for point in precision.tracks:
        table.add_row(
            f"{point.trials}{'*' if point.own else ''}", point.track, f"{point.used:.0f}", number(point.bias),
            f"{number(point.sd)} ({number(point.sd_low)} to {number(point.sd_high)})", number(point.interval),
            f"{point.without:.0%}",
        )  # fmt: skip
    console.print(table)
    for line in _early(precision):
        click.echo(line)
    shown = _at_own_number(precision)
    if not shown:
        return
    click.echo(
        f"\nWidth of the 95 % interval of a mean, with the study's {precision.counted}; in brackets the width that "
        f"{100 * ASSURED:.0f} % of studies stay below"
    )
    table = Table("participants", *shown, box=None, pad_edge=False)
    for size in dict.fromkeys(point.participants for point in precision.means):
        cells = [points[size] for points in shown.values()]
        mark = "*" if any(cell.planned for cell in cells) else ""
        table.add_row(f"{size}{mark}", *(f"{number(cell.width)} ({number(cell.width_assured)})" for cell in cells))
    console.print(table)


def _format(precision: Precision) -> Callable[[float | None], str]:
    """Return the format of numbers in units of the level: three digits of the middle SD, with a dash for None."""
    known = sorted(point.sd for point in precision.tracks if point.sd)
    decimals = max(0, 2 - math.floor(math.log10(known[len(known) // 2]))) if known else 2
    return lambda value: NONE if value is None else f"{value:.{decimals}f}"


def precision_answers(precision: Precision, sd: float | None, width: float | None) -> list[str]:
    """Return a sentence for each target: the smallest number of trials, or of participants, that meets it."""
    return [*_answers(precision, sd, width)]


def _answers(precision: Precision, sd: float | None, width: float | None) -> Iterator[str]:
    most = max(point.trials for point in precision.tracks)
    for target, name, what in ((sd, "sd", "SD"), (width, "interval", "95 % interval")):
        if target is not None:
            cap = trials_needed(precision.tracks, target, name)
            reached = f"from {cap} {precision.counted} on" if cap else f"not reached with {most} {precision.counted}"
            yield f"a person's {what} of at most {target:g}: {reached}"
    if width is None:
        return
    for of, points in _at_own_number(precision).items():
        cap = next(iter(points.values())).trials
        size = people_needed(precision.spreads[of, cap], width)
        reached = f"from {count(size, 'participant')} on" if size else "not reached with 999 participants"
        share = f"{100 * ASSURED:.0f} % of studies"
        yield f"{of}, {cap} {precision.counted}: width of at most {width:g} in {share}: {reached}"


def _at_own_number(precision: Precision) -> Mapping[str, Mapping[int, MeanPrecision]]:
    """Return the means at the study's own number of trials, by what they are of and the number of participants."""
    shown: dict[str, dict[int, MeanPrecision]] = {}
    for point in precision.means:
        if point.own:
            shown.setdefault(point.of, {})[point.participants] = point
    return shown


def _early(precision: Precision) -> Iterator[str]:
    """Yield a note where tracks of the largest number of trials end before it."""
    most = max(point.trials for point in precision.tracks)
    used = [point.used for point in precision.tracks if point.trials == most]
    if precision.rules and min(used) < EARLY * most:
        rules = ", ".join(dict.fromkeys(precision.rules))
        yield f"many tracks end before {most} trials by stop: {{{rules}}}; change it to have more exact thresholds"
