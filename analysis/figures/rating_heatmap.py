"""Every participant's rating of every stimulus as a shade, with a panel per attribute; missing ones are hatched."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from scipy.cluster.hierarchy import leaves_list, linkage
from scipy.spatial.distance import squareform

from palpate.analysis.figures.columns import require_columns
from palpate.analysis.figures.figure_kind import DrawnFigure, FigureData, FigureInput, FigureKind, FigureSettings, Marks
from palpate.analysis.figures.lettering import (
    count_letters,
    elide,
    format_number,
    format_signed,
    letters_that_fit,
    widest_pt,
)
from palpate.analysis.figures.rating_axes import (
    attribute_title,
    attribute_words,
    demand_attributes,
    quarters,
    scale_ends,
    scale_note,
)
from palpate.analysis.figures.style import PAPER, SOFT, shade_scale
from palpate.analysis.ratings.person_cells import PersonCells, person_cells
from palpate.analysis.statistics.doubles import Floats
from palpate.protocols.study import Text
from palpate.protocols.undefined import nan_to_none
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from palpate.analysis.plans.answers import Row


HATCHED = "#aab2bb"
TOP, GAP, BAR = 0.42, 0.3, 0.75
MOST_CELLS = 600
"""The number of cells above which columns, not cells, are marks with details."""


class RatingHeatmapSettings(FigureSettings):
    """The settings of a heat map: `by` is the column across, `order` sorts participants by similarity or number."""

    figure: Literal["rating_heatmap"]
    by: Text = "stimulus"
    order: Literal["similarity", "number"] = "similarity"


def data(inputs: FigureInput, settings: RatingHeatmapSettings) -> FigureData:
    """Return a row for each attribute, participant and level: the mean rating, None if missing."""
    selected = inputs.selected
    demand_attributes(settings.name, selected)
    require_columns(settings, selected.table, (settings.by,))
    cells = person_cells(selected.table, ("attribute", settings.by), levels=selected.levels)
    levels = list(dict.fromkeys(cell[1] for cell in cells.cells))
    ordered = [level for level in selected.levels.get(settings.by, ()) if level in levels]
    levels = [*ordered, *(level for level in levels if level not in ordered)]
    groups: dict[str, str] = {}
    if "group" in selected.table.columns:
        people, numbers = (selected.table[name].astype(str) for name in ("participant", "group"))
        groups = dict(zip(people, numbers, strict=True))
    order = _order(cells, groups, settings.order)
    place = {cell: j for j, cell in enumerate(cells.cells)}
    rows: list[Row] = []
    for attribute, i, level in product(selected.outcomes, order, levels):
        j = place.get((attribute, level))
        value = math.nan if j is None else float(cells.values[i, j])
        head = {"attribute": attribute, "participant": cells.participants[i], settings.by: level}
        rows.append({**head, "mean": nan_to_none(value)})
    missing = sum(row["mean"] is None for row in rows)
    way = "as their ratings resemble each other" if settings.order == "similarity" else "by their numbers"
    way += ", groups apart" if len(set(groups.values())) > 1 and settings.order == "similarity" else ""
    missing_note = f" Hatched: {count(missing, 'cell')} of {len(rows):,} without a rating." if missing else ""
    most = int(cells.counts.max(initial=0))
    averaged = f" (the mean of up to {most} ratings)" if most > 1 else ""
    caption = (
        f"A row is a participant ({len(order)}, {way}), a column a {settings.by} ({len(levels)}); the shade is the"
        f" rating, {scale_note(selected)}{averaged}.{missing_note}"
    )
    words = {
        "by": settings.by,
        "levels": levels,
        "participants": [cells.participants[i] for i in order],
        "attributes": attribute_words(selected),
        "scale": scale_ends(selected),
    }
    return FigureData(tuple(rows), settings.title or f"Every rating, by participant and {settings.by}.", caption, words)


def _order(cells: PersonCells, groups: Mapping[str, str], how: str) -> list[int]:
    """Return the participants by number, or with similar ones next to each other within each group."""
    people = range(len(cells.participants))
    if how == "number":
        return list(people)
    members_of: dict[str, list[int]] = {}
    for i in people:
        members_of.setdefault(groups.get(cells.participants[i], ""), []).append(i)
    ordered: list[int] = []
    for name in sorted(members_of):
        members = members_of[name]
        ordered += [members[k] for k in similar_order(cells.values[members])]
    return ordered


def draw(data: FigureData) -> DrawnFigure:
    """Draw a panel for each attribute, with the same rows and columns in all."""
    words, marks = data.words, Marks()
    attributes, scale = words["attributes"], (words["scale"][0], words["scale"][1])
    people, levels = words["participants"], words["levels"]
    widest, height_of_row, title = 5.5, 0.088, 0.0
    if len(attributes) <= 3:
        widest, height_of_row = 10.0, 0.105
        title = max((count_letters(attribute_title(attribute)) for attribute in attributes), default=0.0)
    across = max(2.4, 0.135 * len(levels), min(0.0875 * title, 4.2))
    sides = min(widest, across), min(6.4, max(0.9, height_of_row * len(people)))
    columns = min(len(attributes), max(1, int(12.0 / (sides[0] + GAP))))
    tall = math.ceil(len(attributes) / columns) * (sides[1] + TOP)
    beside = widest_pt([elide(name, 16) for name in people], 7.0) / 72 + 0.2
    below_all = widest_pt([elide(level, 16) for level in levels], 7.0) / 72 + 0.2
    width = beside + columns * (sides[0] + GAP) + BAR
    room = _Sheet(width, tall + max(below_all, 0.45), beside, columns, sides)
    figure = Figure(figsize=(room.width, room.height))
    shade = ScalarMappable(Normalize(*scale), shade_scale())
    for place, attribute in enumerate(attributes):
        line, column = divmod(place, room.columns)
        below = place + room.columns >= len(attributes)
        left = room.left + column * (room.panel[0] + GAP)
        bottom = room.height - TOP - room.panel[1] - line * (room.panel[1] + TOP)
        panel = figure.add_axes(_share(room, left, bottom, *room.panel))
        _draw_panel(panel, data, attribute, shade, marks, letters_that_fit(room.panel[0] + 0.1))
        _write_names(panel, "x", words["levels"] if below else [], 72 * room.panel[0] / len(words["levels"]))
        _write_names(
            panel, "y", words["participants"] if not column else [], 72 * room.panel[1] / len(words["participants"])
        )
    # What the shades mean, at the right of the first line of panels.
    height = min(2.6, room.panel[1])
    box = figure.add_axes(_share(room, room.width - BAR + 0.05, room.height - TOP - height, 0.13, height))
    bar = figure.colorbar(shade, cax=box)
    ticks = quarters(scale)[:: 1 if height > 1.2 else 2]
    bar.set_ticks(ticks, labels=[format_signed(value, scale) for value in ticks], fontsize=8)
    bar.outline.set_visible(False)
    if any(attribute["high"] for attribute in words["attributes"]):
        box.set_title("second\nword", fontsize=7.5, fontweight="normal", color=SOFT, loc="left", pad=4)
        box.text(0, -0.12 / height, "first\nword", transform=box.transAxes, fontsize=7.5, color=SOFT, va="top")
    return DrawnFigure(figure, marks.all())


class _Sheet(NamedTuple):
    """The layout of the figure in inches."""

    width: float
    height: float
    left: float
    columns: int
    panel: tuple[float, float]


def _share(room: _Sheet, left: float, bottom: float, width: float, height: float) -> tuple[float, float, float, float]:
    return left / room.width, bottom / room.height, width / room.width, height / room.height


def _draw_panel(
    axes: Axes,
    data: FigureData,
    attribute: Mapping[str, Any],
    shade: ScalarMappable,
    marks: Marks,
    room: int,
) -> None:
    words = data.words
    people, levels = words["participants"], words["levels"]
    own = [row for row in data.rows if row["attribute"] == attribute["name"]]
    grid = np.array([math.nan if row["mean"] is None else float(row["mean"]) for row in own])
    grid = grid.reshape(len(people), len(levels))
    axes.add_patch(Rectangle((-0.5, -0.5), len(levels), len(people), facecolor=PAPER, edgecolor=HATCHED, hatch="/////",
                             linewidth=0, zorder=0))  # fmt: skip
    if len(data.rows) <= MOST_CELLS:
        # Few cells: a mark for each.
        for k, row in enumerate(own):
            i, j = divmod(k, grid.shape[1])
            known = not math.isnan(grid[i, j])
            fill = {"facecolor": shade.to_rgba(grid[i, j])} if known else {"facecolor": "none"}
            cell = Rectangle(
                (j - 0.5, i - 0.5), 1, 1, edgecolor=PAPER, linewidth=0.4, in_layout=False, zorder=1, **fill
            )
            axes.add_patch(cell)
            names = [(name, str(row[name])) for name in ("attribute", "participant", words["by"])]
            value = format_number(grid[i, j]) if known else "missing"
            marks.add(cell, (*names, ("rating", value)), str(row[words["by"]]))
    else:
        colours = np.asarray(shade.to_rgba(np.nan_to_num(grid), bytes=True))
        colours[np.isnan(grid)] = (255, 255, 255, 0)
        axes.imshow(colours, aspect="auto", interpolation="none", zorder=1)
        # Many cells: an unseen mark for each column over the picture.
        for j, level in enumerate(levels):
            values = grid[:, j][~np.isnan(grid[:, j])].tolist()
            strip = Rectangle((j - 0.5, -0.5), 1, len(grid), facecolor=PAPER, alpha=0.0, linewidth=0, zorder=2)
            strip.set_in_layout(False)
            axes.add_patch(strip)
            mean = format_number(math.fsum(values) / len(values)) if values else "no rating"
            place = (("attribute", attribute["name"]), (words["by"], level))
            marks.add(strip, (*place, ("mean", mean), ("participants", str(len(values)))), level)
    axes.set(xlim=(-0.5, len(levels) - 0.5), ylim=(len(people) - 0.5, -0.5))
    axes.set_title(attribute_title(attribute, room), fontsize=9)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _write_names(axes: Axes, side: Literal["x", "y"], names: Sequence[str], room: float) -> None:
    """Write every name if there is room, else every second, third, ..."""
    size = min(7.0, max(4.6, 0.95 * room))
    step = max(1, math.ceil(size / room))
    ticks = list(range(0, len(names), step))
    written = [elide(names[k], 16) for k in ticks]
    if side == "x":
        upright = widest_pt(written, size) > step * room - 2
        axes.set_xticks(ticks, written, rotation=90 if upright else 0, fontsize=size)
    else:
        axes.set_yticks(ticks, written, fontsize=size)


RATING_HEATMAP = FigureKind(RatingHeatmapSettings, data, draw)


def similar_order(values: Floats) -> list[int]:
    """Return the order of a table's rows that puts similar ones together; NaN is no value.

    The distance of two rows is the root mean square of their differences where both have a value; rows without common
    values are as far apart as the most distant pair. The method is average linkage with optimal leaf order (Bar-Joseph,
    Gifford & Jaakkola 2001). The end with the lower mean comes first, so that the direction is unique.
    """
    n = len(values)
    if n < 3:
        return list(range(n))
    distances = np.zeros((n, n))
    for i in range(n):
        gaps = values[i + 1 :] - values[i]
        shared = np.count_nonzero(~np.isnan(gaps), axis=1)
        squares = np.nansum(gaps * gaps, axis=1)
        distances[i, i + 1 :] = np.where(shared > 0, np.sqrt(squares / np.maximum(shared, 1)), np.nan)
    far = np.nanmax(distances) if np.isfinite(distances).any() else 1.0
    distances = np.where(np.isnan(distances), far, distances)
    distances = distances + distances.T
    order: list[int] = leaves_list(
        linkage(squareform(distances, checks=False), "average", optimal_ordering=True)
    ).tolist()
    ends = [_mean(values[order[0]]), _mean(values[order[-1]])]
    return order[::-1] if ends[1] < ends[0] else order


def _mean(row: Floats) -> float:
    known = row[~np.isnan(row)]
    return float(known.mean()) if known.size else 0.0
