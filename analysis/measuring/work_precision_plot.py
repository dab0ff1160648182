"""The work-precision plot: run time on the x axis, error on the y axis, a panel for each case of an area."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, SOFT, drawing, save
from palpate.analysis.measuring.rows import REFUSED, Measurement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKERS = "osD^vP*Xh"
Panel = tuple[str, str]


def save_plots(rows: Sequence[Measurement], folder: Path) -> list[Path]:
    """Save the work-precision plot of each area as SVG and PNG, and return the paths."""
    areas = dict.fromkeys(row.area for row in rows)
    paths: list[Path] = []
    for area in areas:
        name = "work_precision_" + re.sub(r"\W+", "_", area).strip("_")
        paths += save_plot([row for row in rows if row.area == area], folder, name)
    return paths


def save_plot(rows: Sequence[Measurement], folder: Path, name: str) -> list[Path]:
    """Draw the rows of one area and save NAME.svg and NAME.png; rows without a time are only in the table."""
    with drawing(name):
        return save(work_precision_figure(rows), folder, name)


def work_precision_figure(rows: Sequence[Measurement]) -> Figure:
    """Return one log-log panel for each case and kind of error: colour is the method, the marker is the input.

    Two margins are marked: below, the exact answers (error 0); above, the methods that refused by name (open markers)
    or gave infinity or nan (full ones). They have a time, but no error that such an axis can show.
    """
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    panels: list[Panel] = list(dict.fromkeys((row.case, row.error_kind) for row in rows))
    methods = list(dict.fromkeys(row.method for row in rows))
    columns = min(3, len(panels))
    lines = math.ceil(len(panels) / columns)
    figure = Figure(figsize=(max(6.4, 4.5 * columns), 3.9 * lines + 0.5 + 0.12 * len(methods)), layout="constrained")
    axes = figure.subplots(lines, columns, squeeze=False).ravel()
    colours = {method: (INK if i == 0 else OKABE_ITO[(i - 1) % len(OKABE_ITO)]) for i, method in enumerate(methods)}
    for panel, chosen in zip(axes, panels, strict=False):
        _draw(panel, [row for row in rows if (row.case, row.error_kind) == chosen], colours)
        # The case is the title, and below it stands in small what its error is.
        title_lines = textwrap.wrap(chosen[1], 58)
        panel.set_title(chosen[0], pad=8.0 + 11.0 * len(title_lines))
        panel.text(0, 1.02, "\n".join(title_lines), transform=panel.transAxes, va="bottom", fontsize=7.5, color=SOFT)
        panel.set_ylabel("error", color=SOFT, fontsize=8.0)
    for panel in axes[len(panels) :]:
        panel.set_axis_off()
    handles = [Line2D([], [], linestyle="none", marker="s", color=colour) for colour in colours.values()]
    handles.append(Line2D([], [], linestyle="none", marker="o", color=SOFT, markerfacecolor="none"))
    names = [*colours, "open: refused by name"]
    figure.legend(handles, names, loc="outside upper left", frameon=False, ncols=5)
    return figure


def _draw(axes: Axes, rows: list[Measurement], colours: dict[str, str]) -> None:
    from matplotlib.lines import Line2D

    timed = [(row, row.seconds) for row in rows if row.seconds]
    errors = [row.error for row, _ in timed if row.error]
    low = math.floor(math.log10(min(errors, default=1e-16)))
    high = max(math.ceil(math.log10(max(errors, default=1e-16))), low + 2)
    pad = max(1.0, 0.16 * (high - low))
    exact, silent = 10 ** (low - pad / 2), 10 ** (high + pad / 2)
    inputs = list(dict.fromkeys(row.input for row in rows))
    markers = dict(zip(inputs, MARKERS, strict=False)) if len(inputs) <= len(MARKERS) else dict.fromkeys(inputs, "o")
    for row, seconds in timed:
        height = silent if row.error is None else row.error or exact
        colour = colours[row.method]
        face = "none" if row.outcome == REFUSED else colour
        axes.plot(seconds, height, markers[row.input], color=colour, markerfacecolor=face, markersize=7, alpha=0.9)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(10 ** (low - pad), 10 ** (high + pad))
    step = max(1, round((high - low) / 6))
    powers = range(int(low), int(high) + 1, step)
    places = [low - pad / 2, *powers, high + pad / 2]
    names = ["exact", *(f"1e{power}" for power in powers), "no number"]
    axes.set_yticks([10.0**place for place in places], names)
    axes.minorticks_off()
    from palpate.analysis.measuring.work_precision import time_text

    left, right = axes.get_xlim()
    powers = range(math.floor(math.log10(left)), math.ceil(math.log10(right)) + 1)
    axes.set_xlim(10.0 ** powers[0], 10.0 ** powers[-1])
    axes.set_xticks([10.0**k for k in powers], [time_text(10.0**k) for k in powers])
    axes.set_xlabel("run time (median)", color=SOFT, fontsize=8.0)
    axes.grid(visible=True)
    for start in (low - pad, high):
        axes.axhspan(10**start, 10 ** (start + pad), color=FAINT, alpha=0.45, linewidth=0, zorder=0)
    if len(markers) > len(MARKERS):
        handles, names = [Line2D([], [], linestyle="none", marker="o", color=SOFT, ms=5)], [f"{len(markers)} inputs"]
    else:
        handles = [Line2D([], [], linestyle="none", marker=m, color=SOFT, ms=5) for m in markers.values()]
        names = list(markers)
    axes.legend(handles, names, fontsize=7, frameon=False, loc="upper left", bbox_to_anchor=(0, -0.16), ncols=3)
