"""The tables and the figure of how exactly thresholds are measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, SHADES, SHAPES, SOFT, drawing, quiet_axes, save
from palpate.analysis.power.precision import ASSURED
from palpate.analysis.power.request import file_name
from palpate.analysis.power.simulated_tracks import THRESHOLD
from palpate.analysis.reports.csv_files import csv_text
from palpate.protocols.files import staged_files, write_text
from palpate.studies.catalogue import read_study

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from palpate.analysis.power.precision import MeanPrecision, Precision, TrackPrecision
    from palpate.analysis.power.request import PowerRequest

MOST_TRACKS = 6
"""The largest number of tracks that have a line of their own in the figure; the others are in the table."""
CLOSE = 0.07
"""Labels of an axis closer than this share of its length would touch."""
LEGEND = 0.2
"""The share of an axis that is free for the legend above what is drawn."""
SIZE = (7.0, 3.3)
"""Inches: two columns of a journal's page."""


def write_precision(
    precision: Precision, request: PowerRequest, sd: float | None, width: float | None, folder: Path
) -> list[Path]:
    """Write precision_TEST_trials.csv, precision_TEST_participants.csv and a figure; return their paths.

    `sd` and `width` are the targets that the figure shows, if any.
    """
    name = f"precision_{file_name(request.test, request.row)}"
    about = {"test": request.test, "quantity": request.row or THRESHOLD, "seed": request.seed}
    tables: list[tuple[str, Sequence[TrackPrecision | MeanPrecision]]] = [
        ("trials", precision.tracks), ("participants", precision.means),
    ]  # fmt: skip
    with staged_files(folder) as draft:
        paths = [
            write_text(draft / f"{name}_{what}.csv", csv_text([{**asdict(row), **about} for row in rows]))
            for what, rows in tables
        ]
        paths += _draw(precision, request, sd, width, draft, name)
    return [folder / path.name for path in paths]


def _draw(
    precision: Precision, request: PowerRequest, sd: float | None, width: float | None, folder: Path, name: str
) -> list[Path]:
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    column = read_study(request.study_file).study.procedure[0].grids[0].column
    what = {"jnd": "JND"}.get(request.row, "threshold")
    with drawing(name):
        figure = Figure(figsize=SIZE, layout=ConstrainedLayoutEngine(wspace=0.06))
        left, right = figure.subplots(1, 2)
        _draw_person(left, precision, sd)
        left.set_ylabel(f"SD and bias of a {what} ({column})")
        tracks = len({point.track for point in precision.tracks})
        left.set_title("One person" + (f" ({MOST_TRACKS} of {tracks} tracks)" if tracks > MOST_TRACKS else ""))
        _draw_means(right, precision, width)
        right.set_ylabel(f"95 % interval, width ({column})")
        right.set_title("The mean of a sample")
        for axes in (left, right):
            quiet_axes(axes)
        return save(figure, folder, name)


def _draw_person(axes: Axes, precision: Precision, target: float | None) -> None:
    """Draw SD (with its 95 % interval) and bias by number of trials, a colour a track; the study's number is filled."""
    tracks = list(dict.fromkeys(point.track for point in precision.tracks))[:MOST_TRACKS]
    for track, colour, shape in zip(tracks, OKABE_ITO, SHAPES, strict=False):
        points = [point for point in precision.tracks if point.track == track and point.sd is not None]
        at = [point.trials for point in points]
        low, high = ([getattr(point, end) for point in points] for end in ("sd_low", "sd_high"))
        axes.fill_between(at, low, high, color=colour, alpha=0.14, linewidth=0)
        for number, style in (("sd", "-"), ("bias", (0, (2, 2)))):
            values = [getattr(point, number) for point in points]
            axes.plot(at, values, color=colour, linewidth=1.5, linestyle=style)
            for point, value in zip(points, values, strict=True):
                fill = colour if point.own else "white"
                axes.plot(point.trials, value, shape, color=colour, markerfacecolor=fill, markersize=4.5)
        axes.plot([], [], shape, linestyle="-", color=colour, markersize=4.5, label=track)
    axes.plot([], [], color=SOFT, linewidth=1.5, label="SD")
    axes.plot([], [], color=SOFT, linewidth=1.5, linestyle=(0, (2, 2)), label="bias")
    axes.plot([], [], "o", color=SOFT, markersize=4.5, linestyle="none", label="the study's number")
    axes.axhline(0, color=SOFT, linewidth=0.7)
    if target is not None:
        _mark_target(axes, target, "SD", "right")
    axes.set_xticks(_readable(precision))
    axes.set_xlabel(f"{precision.counted} of a {'level' if precision.counted == 'repeats' else 'track'}", color=INK)
    bottom, top = axes.get_ylim()
    axes.set_ylim(bottom, top + LEGEND * (top - bottom))
    axes.legend(fontsize=7.5, frameon=False, ncols=2, loc="upper right", handlelength=2.2, columnspacing=1.2)


def _readable(precision: Precision) -> list[int]:
    """Return the numbers of trials that have a label: those of the study, and others that are not close to them."""
    own = {point.trials for point in precision.tracks if point.own}
    numbers = sorted({point.trials for point in precision.tracks})
    labelled: list[int] = []
    for number in sorted(numbers, key=lambda number: (number not in own, number)):
        if all(abs(number - other) >= CLOSE * (numbers[-1] - numbers[0]) for other in labelled):
            labelled.append(number)
    return sorted(labelled)


def _draw_means(axes: Axes, precision: Precision, target: float | None) -> None:
    """Draw assured widths by number of participants: of the widest mean and difference, for three numbers of trials."""
    caps = sorted({point.trials for point in precision.means})
    own = sorted({point.trials for point in precision.means if point.own})
    shown = sorted({caps[0], *own[:1], caps[-1]}) if caps else []
    for of, style in zip(_shown(precision), ("-", (0, (5, 2)), (0, (1, 1.5))), strict=False):
        for cap, colour in zip(shown, (SHADES[2], SHADES[3], SHADES[5])[-len(shown) :], strict=True):
            rows = [point for point in precision.means if point.of == of and point.trials == cap]
            widths = {p.participants: p.width_assured for p in rows if p.width_assured is not None}
            axes.plot(list(widths), list(widths.values()), color=colour, linewidth=1.5, linestyle=style)
        axes.plot([], [], color=SHADES[5], linewidth=1.5, linestyle=style, label=of)
    for cap, colour in zip(shown, (SHADES[2], SHADES[3], SHADES[5])[-len(shown) :], strict=True):
        mark = ", the study's number" if cap in own else ""
        axes.plot([], [], color=colour, linewidth=3, label=f"{cap} {precision.counted}{mark}")
    planned = next((point.participants for point in precision.means if point.planned), None)
    if planned is not None:
        axes.axvline(planned, color=FAINT, linewidth=1.2, zorder=0)
        axes.annotate("planned", (planned, 0), xytext=(3, 3), textcoords="offset points", fontsize=7.5, color=SOFT)
    if target is not None:
        _mark_target(axes, target, "width", "left")
    axes.set_ylim(bottom=0)
    axes.set_xlabel(f"participants; {100 * ASSURED:.0f} % of studies are narrower", color=INK)
    axes.legend(fontsize=7.5, frameon=False, loc="upper right", handlelength=2.6)


def _shown(precision: Precision) -> Sequence[str]:
    """Return what the figure shows means of: the widest of each kind (a track, two tracks, two groups)."""
    widest: dict[bool | str, tuple[float, str]] = {}
    for (of, _), spread in precision.spreads.items():
        kind = "groups" if spread.groups > 1 else spread.is_difference
        size = spread.sd
        if kind not in widest or size > widest[kind][0]:
            widest[kind] = size, of
    return [of for _, of in widest.values()]


def _mark_target(axes: Axes, target: float, what: str, side: Literal["left", "right"]) -> None:
    """Draw a target, named at the side where the curves are far from it."""
    axes.axhline(target, color=INK, linewidth=0.9, linestyle=(0, (4, 3)))
    at, shift = (0, 2) if side == "left" else (1, -2)
    axes.annotate(
        f"{what} {target:g}", (at, target), xycoords=("axes fraction", "data"), xytext=(shift, 2), ha=side,
        textcoords="offset points", fontsize=7.5, color=INK,
    )  # fmt: skip
