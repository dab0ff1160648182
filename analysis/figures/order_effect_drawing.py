"""The drawing of ratings and response times along a session, from the figure's table alone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from palpate.analysis.figures.axes import elided, letters_in, signed
from palpate.analysis.figures.drawn import Drawn, FigureData
from palpate.analysis.figures.lettering import decimals_for, number, p_written
from palpate.analysis.figures.marking import Marking
from palpate.analysis.figures.rated import title_of
from palpate.analysis.figures.style import INK, OKABE_ITO, PAPER, SOFT, quiet_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from palpate.analysis.plans.answers import Row

TIME = "response time"
STEP = 10
"""Slopes are told per so many trials."""


def numbers_in(rows: Sequence[Row], *names: str) -> list[float]:
    """The numbers of these columns in these rows, those that are there."""
    return [float(value) for row in rows for name in names if isinstance(value := row[name], int | float)]


def draw(data: FigureData) -> Drawn:
    """A panel for each attribute, all with one span; then the response time, then the traces of the trial before."""
    measures = list(dict.fromkeys(str(row["measure"]) for row in data.rows))
    carried = [row for row in data.rows if row["kind"] == "carry-over"]
    panels = len(measures) + bool(carried)
    columns = min(panels, 3 if panels in (5, 6, 9) else 4)
    lines = math.ceil(panels / columns)
    width = {1: 6.0, 2: 4.4}.get(columns, 3.1)
    figure = Figure(
        figsize=(width * columns, 2.35 * lines),
        layout=ConstrainedLayoutEngine(h_pad=0.06, w_pad=0.06, hspace=0.04, wspace=0.04),
    )
    axes = figure.subplots(lines, columns, squeeze=False).ravel()
    attributes = {each["name"]: each for each in data.words["attributes"]}
    marking, span = Marking(), _span(data)
    for place, (panel, measure) in enumerate(zip(axes, measures, strict=False)):
        own = [row for row in data.rows if row["measure"] == measure]
        _course(panel, own, data.words, None if measure == TIME else span, marking)
        room = letters_in(width - 0.4)
        title = "Response time in s" if measure == TIME else title_of(attributes[measure], room)
        panel.set_title(title, fontsize=9)
        if place + columns >= len(measures):
            panel.set_xlabel("trial of the session", fontsize=8, color=SOFT)
    if carried:
        _traces(axes[len(measures)], carried, attributes, marking)
    for empty in axes[panels:]:
        empty.set_axis_off()
    return Drawn(figure, marking.all())


def _span(data: FigureData) -> float:
    """One span for all attributes: as wide as the widest course, at least an eighth of the scale."""
    low, high = data.words["scale"]
    widest = float(high - low) / 8
    for measure in dict.fromkeys(row["measure"] for row in data.rows if row["measure"] != TIME):
        own = [row for row in data.rows if row["measure"] == measure and row["kind"] == "bin"]
        reach = numbers_in(own, "low", "high", "value")
        widest = max(widest, 1.15 * (max(reach) - min(reach)))
    return min(widest, 0.6 * float(high - low))


def _course(axes: Axes, own: Sequence[Row], words: Mapping[str, Any], span: float | None, marking: Marking) -> None:
    bins = [row for row in own if row["kind"] == "bin"]
    colour = OKABE_ITO[0] if span is not None else OKABE_ITO[1]
    reach = numbers_in(bins, "low", "high", "value")
    middle = (min(reach) + max(reach)) / 2
    half = (1.3 * (max(reach) - min(reach)) or 1.0) / 2 if span is None else span / 2
    axes.set_ylim(middle - 1.25 * half, middle + half)
    x = [(row["first_trial"] + row["last_trial"]) / 2 for row in bins]  # type: ignore[operator]
    values = numbers_in(bins, "value")
    _line(axes, own, x, values, colour)
    known = [(place, row) for place, row in zip(x, bins, strict=True) if row["low"] is not None]
    ends = (numbers_in([row for _, row in known], end) for end in ("low", "high"))
    axes.vlines([place for place, _ in known], *ends, color=INK, linewidth=0.9, zorder=2.5)
    for place, row in zip(x, bins, strict=True):
        shape = "o" if span is not None else "s"
        (point,) = axes.plot(
            [place], numbers_in([row], "value"), shape, color=colour, markersize=5.5, markeredgecolor=PAPER, zorder=3
        )
        trials = f"{row['first_trial']} to {row['last_trial']}"
        told = [("measure", str(row["measure"])), ("trials", trials), ("mean", number(numbers_in([row], "value")[0]))]
        marking.add(point, (*told, ("participants", str(row["n"]))))
    axes.set_xlim(0.5, max(float(row["last_trial"]) for row in bins) + 0.5)  # type: ignore[arg-type]
    axes.yaxis.set_major_formatter(lambda value, _: signed(round(value, 9), tuple(words["scale"]) if span else (0, 1)))
    axes.locator_params(axis="y", nbins=5)
    axes.tick_params(labelsize=8)
    quiet_axes(axes)


def _line(axes: Axes, own: Sequence[Row], x: Sequence[float], values: Sequence[float], colour: str) -> None:
    """The mean slope through the middle of the course, and its numbers below."""
    (slope,) = [row for row in own if str(row["kind"]).startswith("slope")]
    if slope["value"] is None:
        text = str(slope["note"])
    else:
        percent = slope["measure"] == TIME
        unit = " %" if percent else ""
        value = numbers_in([slope], "value")[0]
        middle = sum(x) / len(x)
        ends = np.array([min(x), max(x)])
        if percent:
            level = math.exp(sum(map(math.log, values)) / len(values))
            height = level * (1 + value / 100) ** ((ends - middle) / STEP)
        else:
            height = sum(values) / len(values) + value * (ends - middle) / STEP
        axes.plot(ends, height, color=colour, linewidth=1.3, alpha=0.8, zorder=2)
        bounds = numbers_in([slope], "low", "high")
        decimals = max(2, decimals_for(bounds or [value]) - 1)
        text = f"{_plus(value, decimals)}{unit} per {STEP} trials"
        if bounds:
            text += f"  [{_plus(bounds[0], decimals)}, {_plus(bounds[1], decimals)}], {p_written(_p(slope))}"
    box = {"facecolor": PAPER, "edgecolor": "none", "pad": 1.5}
    told = axes.text(0.02, 0.03, elided(text, 60), transform=axes.transAxes, fontsize=7.0, va="bottom", bbox=box)
    told.set_in_layout(False)


def _p(row: Row) -> float | None:
    return next(iter(numbers_in([row], "p")), None)


def _plus(value: float, decimals: int) -> str:
    written = number(value, decimals)
    return f"+{written}" if value > 0 and float(written) else written


def _traces(axes: Axes, carried: Sequence[Row], attributes: Mapping[str, Any], marking: Marking) -> None:
    """The carry-over of every attribute with its interval, around none."""
    axes.axvline(0, color=SOFT, linewidth=0.8)
    written = [elided(str(row["measure"]), 14) for row in carried]
    for place, row in enumerate(carried):
        bounds, value = numbers_in([row], "low", "high"), numbers_in([row], "value")
        if len(bounds) == 2:
            axes.hlines([-place], *bounds, color=INK, linewidth=0.9)
        if not value:
            axes.text(0, -place, f" undefined: {row['note']}", fontsize=7, color=SOFT, va="center")
        else:
            (point,) = axes.plot(value, [-place], "D", color=OKABE_ITO[2], markersize=5, markeredgecolor=PAPER)
            told = (("carry-over", title_of(attributes[str(row["measure"])])), ("slope", number(value[0], 3)))
            marking.add(point, (*told, ("interval", " to ".join(number(b, 3) for b in bounds) or "none")))
    axes.set_yticks([-k for k in range(len(carried))], written, fontsize=8)
    axes.set_ylim(-len(carried) + 0.4, 0.6)
    axes.set_title("Carry-over of the trial before", fontsize=9)
    axes.grid(visible=True, axis="x")
    axes.tick_params(labelsize=8)
    axes.locator_params(axis="x", nbins=5)
    axes.set_xlabel("slope on its effect", fontsize=8, color=SOFT)
    for side in ("left", "bottom"):
        axes.spines[side].set_visible(False)
