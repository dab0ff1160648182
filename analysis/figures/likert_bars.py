"""Answers on points as stacked bars that diverge from the middle of the scale, from their table alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from palpate.analysis.figures.drawn import Drawn, FigureData
from palpate.analysis.figures.lettering import folded, percent
from palpate.analysis.figures.marking import Marking
from palpate.analysis.figures.shades import ink_on
from palpate.analysis.figures.shown_columns import to_float
from palpate.analysis.figures.style import INK, PAPER, SOFT
from palpate.analysis.plans.answers import Row

LOW, MIDDLE, HIGH = ("#9a4a00", "#e8a361"), "#e6e6e6", ("#7fb6dc", "#0b4f86")
WIDE_IN = 7.6


def draw_bars(shown: FigureData) -> Drawn:
    """A bar for each item; points below the middle reach to the left, hatched so that grey print shows the sides."""
    items = shown.words["items"]
    tall = 0.5 if len(items) <= 12 else 0.34
    figure = Figure(figsize=(WIDE_IN, tall * len(items) + 1.0), layout="constrained")
    axes, marking = figure.add_subplot(), Marking()
    points = list(range(shown.words["low"], shown.words["high"] + 1))
    for place, item in enumerate(items):
        rows = [row for row in shown.rows if row["shows"] == "point" and row["item"] == item]
        _bar(axes, marking, rows, place, points)
    _frame(axes, shown, items, points)
    return Drawn(figure, marking.all())


def colours(points: int) -> list[str]:
    """From the low to the high end, the middle grey where the scale has one."""
    half = points // 2
    low = LinearSegmentedColormap.from_list("low", LOW)
    high = LinearSegmentedColormap.from_list("high", HIGH)
    steps = [i / max(half - 1, 1) for i in range(half)]
    return [*(to_hex(low(s)) for s in steps), *([MIDDLE] if points % 2 else []), *(to_hex(high(s)) for s in steps)]


def _bar(axes: Axes, marking: Marking, rows: Sequence[Row], place: int, points: Sequence[int]) -> None:
    half, odd = len(points) // 2, len(points) % 2
    below = sum(to_float(row["share"]) for row in rows[:half])
    above = sum(to_float(row["share"]) for row in rows[half + odd :])
    at = -below - (to_float(rows[half]["share"]) / 2 if odd else 0.0)
    for i, (row, fill) in enumerate(zip(rows, colours(len(points)), strict=True)):
        share = to_float(row["share"])
        if share > 0:
            _segment(axes, marking, row, (at, share, float(place)), fill, "////" if i < half else "")
        at += share
    for x, share, side in ((-0.01, below, "right"), (1.01, above, "left")):
        axes.text(
            x,
            place,
            percent(share),
            transform=axes.get_yaxis_transform(),
            ha=side,
            va="center",
            fontsize=8.5,
            color=INK,
        )


def _segment(axes: Axes, marking: Marking, row: Row, at: tuple[float, float, float], fill: str, hatch: str) -> None:
    """One point's share of a bar; how many chose it stands there where there is room."""
    left, share, place = at
    look: dict[str, Any] = {"color": fill, "edgecolor": PAPER, "linewidth": 0.8, "hatch": hatch}
    bar = axes.barh([place], [share], 0.72, left=[left], **look)[0]
    chosen = f"{row['count']} ({percent(share)})"
    told = (("item", str(row["item"])), ("point", f"{to_float(row['value']):g}"), ("chosen by", chosen))
    marking.add(bar, told, str(row["item"]))
    if share >= 0.06:
        boxed = {"facecolor": fill, "edgecolor": "none", "pad": 0.8} if hatch else None
        look = {"ha": "center", "va": "center", "fontsize": 8, "color": ink_on(fill), "bbox": boxed}
        axes.text(left + share / 2, place, str(row["count"]), **look)


def _frame(axes: Axes, shown: FigureData, items: Sequence[str], points: Sequence[int]) -> None:
    drawn: list[Any] = list(axes.patches)
    ends = [x for bar in drawn for x in (bar.get_x(), bar.get_x() + bar.get_width())]
    left, right = min(-0.15, *ends), max(0.15, *ends)
    axes.set(xlim=(left - 0.02 * (right - left), right + 0.02 * (right - left)), ylim=(len(items) - 0.45, -0.55))
    names = [folded(item.replace("_", " "), int(shown.words["letters"])) for item in items]
    axes.set_yticks(range(len(items)), names, fontsize=9)
    axes.tick_params(axis="y", pad=36)
    axes.set_xticks([])
    axes.axvline(0, color=INK, linewidth=0.9, zorder=0.5)
    for spine in axes.spines.values():
        spine.set_visible(False)
    low, high = shown.words["ends"]
    labels = [str(point) for point in points]
    for x, word, ha in ((0.0, low, "left"), (1.0, high, "right")):
        look: dict[str, Any] = {"xycoords": "axes fraction", "textcoords": "offset points", "ha": ha, "va": "top"}
        axes.annotate(folded(word, 22), (x, 0), (0, -7), fontsize=8, color=SOFT, **look)
    hatches = ["////" if i < len(points) // 2 else "" for i in range(len(points))]
    looks = zip(colours(len(points)), hatches, strict=True)
    handles = [Patch(facecolor=fill, edgecolor=PAPER, hatch=hatch) for fill, hatch in looks]
    axes.legend(
        handles, labels, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=len(points), frameon=False, fontsize=8,
        labelcolor=SOFT, handlelength=1.1, handleheight=1.1, columnspacing=0.9, handletextpad=0.4,
    )  # fmt: skip
