"""The mean of every level as a bar, for each attribute a panel (thesis Figure 5.9)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Patch

from palpate.analysis.figures.figure_kind import Drawn, FigureData, FigureKind, Marking, Shown
from palpate.analysis.figures.lettering import elided, widest_pt
from palpate.analysis.figures.level_means import (
    Key,
    LevelFigure,
    Places,
    key_text,
    level_rows,
    level_words,
    unequal,
    unknown,
    whisker_ends,
)
from palpate.analysis.figures.rating_axes import (
    base_of,
    by_category,
    cut_note,
    lettered,
    level_axis,
    on_scale,
    people_text,
    poles,
    scale_axis,
)
from palpate.analysis.figures.style import INK, PAPER, SOFT
from palpate.protocols.wording import phrase

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HATCHES = ("", "///", "...", "\\\\\\", "xxx", "---")
MANY = 36
"""Levels beyond which panels stand in one column, as wide as the page."""


class Means(LevelFigure):
    """The settings of a figure of means."""

    figure: Literal["means"]


def _data(shown: Shown, asked: Means) -> FigureData:
    selected = shown.selected
    rows = level_rows(selected, asked)
    words = level_words(selected, asked, rows)
    people = people_text(rows)
    whiskers = f", whiskers {words['whiskers']}" if words["whiskers"] else ""
    caption = f"Bars are means over {people}{whiskers}, {on_scale(selected)}.{unequal(rows)}{unknown(rows, asked)}"
    caption += cut_note(whisker_ends(rows), (words["scale"][0], words["scale"][1]))
    title = asked.title or f"Mean ratings by {phrase(list(asked.by))}."
    return FigureData(rows, title, caption, {**words, "people": people})


def draw(data: FigureData) -> Drawn:
    """The bars, one panel for each attribute, all on one scale, the two poles written at its ends."""
    words, places, marking = data.words, Places(data.words), Marking()
    grid = _grid(words["attributes"], len(places.keys))
    key_row = len({len(column) for column in grid}) == 1
    rows = max(map(len, grid))
    width = 11.6 if len(places.keys) > MANY else 5.8 * max(len(grid), 1.25)
    panel_width = width / len(grid) - 0.6 - _pole_room(words["attributes"])
    names = [places.written[key] for key in places.at]
    below = lettered(list(places.at.values()), names, panel_width).inches
    named = sum(bool(name) for name in places.members)
    heights = [1.0] * rows + [(0.62 + 0.24 * named) / (1.7 + below)] * key_row
    figure = Figure(
        figsize=(width, (1.7 + below) * sum(heights) + 0.35),
        layout=ConstrainedLayoutEngine(h_pad=0.06, w_pad=0.08, hspace=0.05, wspace=0.02),
    )
    axes = figure.subplots(len(heights), len(grid), squeeze=False, height_ratios=heights)
    for (i, j), panel in np.ndenumerate(axes):
        if i < len(grid[j]):
            _panel(panel, data, grid[j][i], places, marking, panel_width)
        else:
            panel.set_axis_off()
    for column, first in zip(grid, axes[0], strict=True):
        if len({attribute["category"] for attribute in column}) == 1 and column[0]["category"]:
            first.set_title(f"{column[0]['category']} attributes".capitalize(), pad=8)
    _legend(axes[-1][0] if key_row or len(grid[0]) < rows else axes[-1][-1], places, words)
    return Drawn(figure, marking.all())


def _pole_room(attributes: Sequence[Mapping[str, Any]]) -> float:
    """Inches that the words at the ends of the scale take beside a panel."""
    words = [elided(each[end], 22) for each in attributes if each["high"] for end in ("low", "high")]
    return widest_pt(words, 9.0, "bold") / 72


def _grid(attributes: Sequence[Mapping[str, Any]], levels: int) -> list[list[Mapping[str, Any]]]:
    """Two columns: the categories where there are two of about equal length, else simply the halves."""
    if len(attributes) == 1 or levels > MANY:
        return [list(attributes)]
    columns = list(by_category(attributes).values())
    if len(columns) == 2 and abs(len(columns[0]) - len(columns[1])) <= 2:
        return columns
    half = (len(attributes) + 1) // 2
    return [list(attributes[:half]), list(attributes[half:])]


def _looks(places: Places) -> dict[str, tuple[str, str]]:
    """A colour and a hatch for each family: told apart without colour too; the reference is plain ink."""
    colours = places.colours()
    rest = [name for name in places.members if colours[name] != INK]
    hatches = {name: HATCHES[i % len(HATCHES)] for i, name in enumerate(rest)}
    return {name: (colours[name], hatches.get(name, "")) for name in places.members}


def _panel(
    axes: Axes, data: FigureData, attribute: Mapping[str, Any], places: Places, marking: Marking, width: float
) -> None:
    words, looks = data.words, _looks(places)
    scale = (words["scale"][0], words["scale"][1])
    reach = [row[end] for row in data.rows for end in ("low", "high", "mean") if row[end] is not None]
    base = base_of(scale)
    scale_axis(axes, scale, [float(value) for value in reach if value is not None], line=base)
    found = places.rows(data.rows, attribute["name"])
    bars = axes.bar(
        [places.at[key] for key in found],
        [float(row["mean"] or 0.0) - base for row in found.values()],
        0.76,
        bottom=base,
        facecolor=[looks[places.family[key]][0] for key in found],
        edgecolor=PAPER,
        hatch=[looks[places.family[key]][1] if len(places.keys) <= MANY else "" for key in found],
        linewidth=0,
        alpha=0.88,
        zorder=2,
    )
    for bar, (key, row) in zip(bars.patches, found.items(), strict=True):
        marking.add(bar, places.told(row, words), key_text(key))
    _whiskers(axes, found, places)
    level_axis(axes, list(places.at.values()), [places.written[key] for key in places.at], width)
    poles(axes, attribute, scale)


def _whiskers(axes: Axes, found: Mapping[Key, Mapping[str, Any]], places: Places) -> None:
    """Every whisker of a panel with its two ends, drawn together."""
    known = [(places.at[key], row) for key, row in found.items() if row["low"] is not None and row["high"] is not None]
    if known:
        x = [at for at, _ in known]
        low, high = ([float(row[end]) for _, row in known] for end in ("low", "high"))
        axes.vlines(x, low, high, color=INK, linewidth=0.9, zorder=3)
        axes.plot([*x, *x], [*low, *high], "_", color=INK, markersize=3.6, zorder=3)


def _legend(axes: Axes, places: Places, words: Mapping[str, Any]) -> None:
    """What the colours and the whiskers mean."""
    looks = _looks(places)
    named = [name for name in places.members if name]
    handles = [Patch(facecolor=looks[name][0], hatch=looks[name][1], edgecolor=PAPER, alpha=0.88) for name in named]
    labels = [_family(places, name) for name in named]
    if handles:
        key = axes.legend(handles, labels, loc="upper left", frameon=False, handlelength=1.6, borderaxespad=0)
        key.set_in_layout(False)
    note = f"Bars: means over {words['people']}."
    note += f"\nWhiskers: {words['whiskers']}." if words["whiskers"] else ""
    told = axes.text(0.0, 0.0, note, transform=axes.transAxes, ha="left", va="bottom", fontsize=8.0, color=SOFT)
    told.set_in_layout(False)


def _family(places: Places, family: str) -> str:
    """A family's name with its first and last level, where levels are named at the axis by themselves."""
    keys = places.members[family]
    ends = [places.written[keys[0]], places.written[keys[-1]]]
    if len(places.by) > 1 or ends == [family, family]:
        return elided(family, 40)
    span = " – ".join(elided(end, 20) for end in ends[: min(2, len(keys))])
    return f"{elided(family, 32)}  ({span})"


MEANS = FigureKind(Means, _data, draw)
