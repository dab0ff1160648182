"""The mean of every level as a bar, with a panel for each attribute (thesis Figure 5.9)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Patch

from palpate.analysis.figures.columns import to_float
from palpate.analysis.figures.figure_kind import DrawnFigure, FigureData, FigureInput, FigureKind, Marks
from palpate.analysis.figures.lettering import elide, widest_pt
from palpate.analysis.figures.level_means import (
    LevelPlaces,
    LevelSettings,
    level_name,
    level_rows,
    level_words,
    missing_whiskers_note,
    unequal_ratings_note,
    whisker_ends,
)
from palpate.analysis.figures.rating_axes import (
    bar_base,
    by_category,
    count_people,
    cut_note,
    fit_labels,
    scale_note,
    set_level_axis,
    set_scale_axis,
    write_poles,
)
from palpate.analysis.figures.style import INK, PAPER, SOFT
from palpate.protocols.wording import phrase

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HATCHES = ("", "///", "...", "\\\\\\", "xxx", "---")
MANY = 36
"""The number of levels above which panels are in one column, as wide as the page."""


class MeansSettings(LevelSettings):
    """The settings of a figure of means."""

    figure: Literal["means"]


def data(inputs: FigureInput, settings: MeansSettings) -> FigureData:
    """Return a row for each attribute and level: its mean, n, SD and the ends of its whisker."""
    selected = inputs.selected
    rows = level_rows(selected, settings)
    words = level_words(selected, settings, rows)
    people = count_people(rows)
    whiskers = f", whiskers {words['whiskers']}" if words["whiskers"] else ""
    caption = f"Bars are means over {people}{whiskers}, {scale_note(selected)}."
    caption += unequal_ratings_note(rows) + missing_whiskers_note(rows, settings)
    caption += cut_note(whisker_ends(rows), (words["scale"][0], words["scale"][1]))
    title = settings.title or f"Mean ratings by {phrase(list(settings.by))}."
    return FigureData(rows, title, caption, {**words, "people": people})


def draw(data: FigureData) -> DrawnFigure:
    """Draw the bars, one panel for each attribute, all on one scale with the two poles at its ends."""
    words, places, marks = data.words, LevelPlaces(data.words), Marks()
    # Two columns of attributes: the categories where there are two of about equal length, else the halves.
    attributes = words["attributes"]
    if len(attributes) == 1 or len(places.keys) > MANY:
        grid = [list(attributes)]
    else:
        columns = list(by_category(attributes).values())
        if len(columns) == 2 and abs(len(columns[0]) - len(columns[1])) <= 2:
            grid = columns
        else:
            half = (len(attributes) + 1) // 2
            grid = [list(attributes[:half]), list(attributes[half:])]
    key_row = len({len(column) for column in grid}) == 1
    rows = max(map(len, grid))
    width = 11.6 if len(places.keys) > MANY else 5.8 * max(len(grid), 1.25)
    poles = [
        elide(attribute[end], 22) for attribute in words["attributes"] if attribute["high"] for end in ("low", "high")
    ]
    panel_width = width / len(grid) - 0.6 - widest_pt(poles, 9.0, "bold") / 72
    names = [places.written[key] for key in places.at]
    below = fit_labels(list(places.at.values()), names, panel_width).inches
    named = sum(bool(name) for name in places.members)
    heights = [1.0] * rows + [(0.62 + 0.24 * named) / (1.7 + below)] * key_row
    figure = Figure(
        figsize=(width, (1.7 + below) * sum(heights) + 0.35),
        layout=ConstrainedLayoutEngine(h_pad=0.06, w_pad=0.08, hspace=0.05, wspace=0.02),
    )
    axes = figure.subplots(len(heights), len(grid), squeeze=False, height_ratios=heights)
    for (i, j), panel in np.ndenumerate(axes):
        if i < len(grid[j]):
            _draw_panel(panel, data, grid[j][i], places, marks, panel_width)
        else:
            panel.set_axis_off()
    for column, first in zip(grid, axes[0], strict=True):
        if len({attribute["category"] for attribute in column}) == 1 and column[0]["category"]:
            first.set_title(f"{column[0]['category']} attributes".capitalize(), pad=8)
    _draw_legend(axes[-1][0] if key_row or len(grid[0]) < rows else axes[-1][-1], places, words)
    return DrawnFigure(figure, marks.all())


def _looks(places: LevelPlaces) -> dict[str, tuple[str, str]]:
    """Return a colour and a hatch for each family, distinguishable without colour; the reference is plain ink."""
    colours = places.colours()
    rest = [name for name in places.members if colours[name] != INK]
    hatches = {name: HATCHES[i % len(HATCHES)] for i, name in enumerate(rest)}
    return {name: (colours[name], hatches.get(name, "")) for name in places.members}


def _draw_panel(
    axes: Axes, data: FigureData, attribute: Mapping[str, Any], places: LevelPlaces, marks: Marks, width: float
) -> None:
    words, looks = data.words, _looks(places)
    scale = (words["scale"][0], words["scale"][1])
    reach = [row[end] for row in data.rows for end in ("low", "high", "mean") if row[end] is not None]
    base = bar_base(scale)
    set_scale_axis(axes, scale, [float(value) for value in reach if value is not None], line=base)
    rows_at = places.rows(data.rows, attribute["name"])
    bars = axes.bar(
        [places.at[key] for key in rows_at],
        [float(row["mean"] or 0.0) - base for row in rows_at.values()],
        0.76,
        bottom=base,
        facecolor=[looks[places.family[key]][0] for key in rows_at],
        edgecolor=PAPER,
        hatch=[looks[places.family[key]][1] if len(places.keys) <= MANY else "" for key in rows_at],
        linewidth=0,
        alpha=0.88,
        zorder=2,
    )
    for bar, (key, row) in zip(bars.patches, rows_at.items(), strict=True):
        marks.add(bar, places.details(row, words), level_name(key))
    # Every whisker of the panel with its two ends, all together.
    known = [
        (places.at[key], row) for key, row in rows_at.items() if row["low"] is not None and row["high"] is not None
    ]
    if known:
        x = [at for at, _ in known]
        low, high = ([to_float(row[end]) for _, row in known] for end in ("low", "high"))
        axes.vlines(x, low, high, color=INK, linewidth=0.9, zorder=3)
        axes.plot([*x, *x], [*low, *high], "_", color=INK, markersize=3.6, zorder=3)
    set_level_axis(axes, list(places.at.values()), [places.written[key] for key in places.at], width)
    write_poles(axes, attribute, scale)


def _draw_legend(axes: Axes, places: LevelPlaces, words: Mapping[str, Any]) -> None:
    """Write the meaning of the colours and the whiskers."""
    looks = _looks(places)
    families = [name for name in places.members if name]
    handles = [Patch(facecolor=looks[name][0], hatch=looks[name][1], edgecolor=PAPER, alpha=0.88) for name in families]
    labels = []
    for family in families:
        # With the first and last level, where levels are named at the axis by themselves.
        keys = places.members[family]
        ends = [places.written[keys[0]], places.written[keys[-1]]]
        span = " – ".join(elide(end, 20) for end in ends[: min(2, len(keys))])
        alone = len(places.by) > 1 or ends == [family, family]
        labels.append(elide(family, 40) if alone else f"{elide(family, 32)}  ({span})")
    if handles:
        key = axes.legend(handles, labels, loc="upper left", frameon=False, handlelength=1.6, borderaxespad=0)
        key.set_in_layout(False)
    note = f"Bars: means over {words['people']}."
    note += f"\nWhiskers: {words['whiskers']}." if words["whiskers"] else ""
    text = axes.text(0.0, 0.0, note, transform=axes.transAxes, ha="left", va="bottom", fontsize=8.0, color=SOFT)
    text.set_in_layout(False)


MEANS = FigureKind(MeansSettings, data, draw)
