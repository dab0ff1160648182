"""Every participant's rating of every stimulus as a shade, a panel for each attribute; what is missing is hatched."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from scipy.cluster.hierarchy import leaves_list, linkage
from scipy.spatial.distance import squareform

from palpate.analysis.figures.columns import require
from palpate.analysis.figures.figure_kind import AskedFigure, Drawn, FigureData, FigureKind, Marking, Shown
from palpate.analysis.figures.lettering import elided, letters_in, letters_of, number, signed, widest_pt
from palpate.analysis.figures.rating_axes import (
    attribute_words,
    demand_attributes,
    on_scale,
    quarters,
    scale_words,
    title_of,
)
from palpate.analysis.figures.style import PAPER, SOFT, ladder
from palpate.analysis.ratings.person_cells import PersonCells, person_cells
from palpate.analysis.statistics.doubles import Floats
from palpate.protocols.study import Text
from palpate.protocols.undefined import nan_to_none
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from palpate.analysis.plans.answers import Row, Selected


HATCHED = "#aab2bb"
TOP, GAP, BAR = 0.42, 0.3, 0.75
MOST_CELLS = 600
"""Beyond this many cells a column, not a cell, is what one can look at closer."""


class RatingHeatmap(AskedFigure):
    """`by`: the column across. `order`: participants by how alike they rate (groups apart), or by their number."""

    figure: Literal["rating_heatmap"]
    by: Text = "stimulus"
    order: Literal["similarity", "number"] = "similarity"


def _data(shown: Shown, asked: RatingHeatmap) -> FigureData:
    selected = shown.selected
    demand_attributes(asked.name, selected)
    require(asked, selected.table, (asked.by,))
    cells = person_cells(selected.table, ("attribute", asked.by), levels=selected.levels)
    levels = list(dict.fromkeys(cell[1] for cell in cells.cells))
    known = [level for level in selected.levels.get(asked.by, ()) if level in levels]
    levels = [*known, *(level for level in levels if level not in known)]
    groups = _groups(selected)
    order = _order(cells, groups, asked.order)
    rows = _rows(cells, selected.outcomes, order, levels, asked.by)
    missing = sum(row["mean"] is None for row in rows)
    way = "as their ratings resemble each other" if asked.order == "similarity" else "by their numbers"
    way += ", groups apart" if len(set(groups.values())) > 1 and asked.order == "similarity" else ""
    lacking = f" Hatched: {count(missing, 'cell')} of {len(rows):,} without a rating." if missing else ""
    caption = (
        f"A row is a participant ({len(order)}, {way}), a column a {asked.by} ({len(levels)}); the shade is the rating,"
        f" {on_scale(selected)}{_averaged(cells)}.{lacking}"
    )
    words = {
        "by": asked.by,
        "levels": levels,
        "participants": [cells.participants[i] for i in order],
        "attributes": attribute_words(selected),
        "scale": scale_words(selected),
    }
    return FigureData(rows, asked.title or f"Every rating, by participant and {asked.by}.", caption, words)


def _groups(selected: Selected) -> dict[str, str]:
    if "group" not in selected.table.columns:
        return {}
    return dict(zip(selected.table["participant"].astype(str), selected.table["group"].astype(str), strict=True))


def _order(cells: PersonCells, groups: Mapping[str, str], how: str) -> list[int]:
    """Participants by number, or alike ones next to each other, group after group."""
    people = range(len(cells.participants))
    if how == "number":
        return list(people)
    found: dict[str, list[int]] = {}
    for i in people:
        found.setdefault(groups.get(cells.participants[i], ""), []).append(i)
    ordered: list[int] = []
    for name in sorted(found):
        members = found[name]
        ordered += [members[k] for k in similar_order(cells.values[members])]
    return ordered


def _averaged(cells: PersonCells) -> str:
    most = int(cells.counts.max(initial=0))
    return f" (the mean of up to {most} ratings)" if most > 1 else ""


def _rows(
    cells: PersonCells, attributes: Sequence[str], order: Sequence[int], levels: Sequence[str], by: str
) -> tuple[Row, ...]:
    place = {cell: j for j, cell in enumerate(cells.cells)}
    rows: list[Row] = []
    for attribute in attributes:
        for i in order:
            for level in levels:
                j = place.get((attribute, level))
                value = math.nan if j is None else float(cells.values[i, j])
                head = {"attribute": attribute, "participant": cells.participants[i], by: level}
                rows.append({**head, "mean": nan_to_none(value)})
    return tuple(rows)


def draw(data: FigureData) -> Drawn:
    """A panel for each attribute, the same rows and columns in all."""
    words, marking = data.words, Marking()
    attributes, scale = words["attributes"], (words["scale"][0], words["scale"][1])
    room = _rooms(words)
    figure = Figure(figsize=(room.width, room.height))
    shade = ScalarMappable(Normalize(*scale), ladder())
    for place, attribute in enumerate(attributes):
        line, column = divmod(place, room.columns)
        below = place + room.columns >= len(attributes)
        left = room.left + column * (room.panel[0] + GAP)
        bottom = room.height - TOP - room.panel[1] - line * (room.panel[1] + TOP)
        panel = figure.add_axes(_share(room, left, bottom, *room.panel))
        _panel(panel, data, attribute, shade, marking, letters_in(room.panel[0] + 0.1))
        _names(panel, "x", words["levels"] if below else [], 72 * room.panel[0] / len(words["levels"]))
        _names(panel, "y", words["participants"] if not column else [], 72 * room.panel[1] / len(words["participants"]))
    _bar(figure, room, shade, words)
    return Drawn(figure, marking.all())


class _Room(NamedTuple):
    """Where everything stands, in inches."""

    width: float
    height: float
    left: float
    columns: int
    panel: tuple[float, float]


def _rooms(words: Mapping[str, Any]) -> _Room:
    people, levels, attributes = words["participants"], words["levels"], words["attributes"]
    widest, line = (10.0, 0.105) if len(attributes) <= 3 else (5.5, 0.088)
    title = max((letters_of(title_of(each)) for each in attributes), default=0.0) if len(attributes) <= 3 else 0.0
    across = max(2.4, 0.135 * len(levels), min(0.0875 * title, 4.2))
    panel = min(widest, across), min(6.4, max(0.9, line * len(people)))
    columns = min(len(attributes), max(1, int(12.0 / (panel[0] + GAP))))
    lines = math.ceil(len(attributes) / columns)
    left = widest_pt([elided(name, 16) for name in people], 7.0) / 72 + 0.2
    names = widest_pt([elided(level, 16) for level in levels], 7.0) / 72 + 0.2
    width = left + columns * (panel[0] + GAP) + BAR
    return _Room(width, lines * (panel[1] + TOP) + max(names, 0.45), left, columns, panel)


def _share(room: _Room, left: float, bottom: float, width: float, height: float) -> tuple[float, float, float, float]:
    return left / room.width, bottom / room.height, width / room.width, height / room.height


def _bar(figure: Figure, room: _Room, shade: ScalarMappable, words: Mapping[str, Any]) -> None:
    """What the shades mean, at the right of the first line of panels."""
    scale = (words["scale"][0], words["scale"][1])
    height = min(2.6, room.panel[1])
    box = figure.add_axes(_share(room, room.width - BAR + 0.05, room.height - TOP - height, 0.13, height))
    bar = figure.colorbar(shade, cax=box)
    ticks = quarters(scale)[:: 1 if height > 1.2 else 2]
    bar.set_ticks(ticks, labels=[signed(value, scale) for value in ticks], fontsize=8)
    bar.outline.set_visible(False)
    if any(attribute["high"] for attribute in words["attributes"]):
        box.set_title("second\nword", fontsize=7.5, fontweight="normal", color=SOFT, loc="left", pad=4)
        box.text(0, -0.12 / height, "first\nword", transform=box.transAxes, fontsize=7.5, color=SOFT, va="top")


def _panel(
    axes: Axes,
    data: FigureData,
    attribute: Mapping[str, Any],
    shade: ScalarMappable,
    marking: Marking,
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
        _cells(axes, own, grid, words, shade, marking)
    else:
        colours = np.asarray(shade.to_rgba(np.nan_to_num(grid), bytes=True))
        colours[np.isnan(grid)] = (255, 255, 255, 0)
        axes.imshow(colours, aspect="auto", interpolation="none", zorder=1)
        _columns(axes, grid, attribute["name"], words, marking)
    axes.set(xlim=(-0.5, len(levels) - 0.5), ylim=(len(people) - 0.5, -0.5))
    axes.set_title(title_of(attribute, room), fontsize=9)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _names(axes: Axes, side: Literal["x", "y"], names: Sequence[str], room: float) -> None:
    """Every name where there is room, else every second, third, ..."""
    size = min(7.0, max(4.6, 0.95 * room))
    step = max(1, math.ceil(size / room))
    ticks = list(range(0, len(names), step))
    written = [elided(names[k], 16) for k in ticks]
    if side == "x":
        upright = widest_pt(written, size) > step * room - 2
        axes.set_xticks(ticks, written, rotation=90 if upright else 0, fontsize=size)
    else:
        axes.set_yticks(ticks, written, fontsize=size)


def _cells(
    axes: Axes, own: Sequence[Row], grid: Any, words: Mapping[str, Any], shade: ScalarMappable, marking: Marking
) -> None:
    """Few cells: each is a mark."""
    for k, row in enumerate(own):
        i, j = divmod(k, grid.shape[1])
        known = not math.isnan(grid[i, j])
        fill = {"facecolor": shade.to_rgba(grid[i, j])} if known else {"facecolor": "none"}
        cell = Rectangle((j - 0.5, i - 0.5), 1, 1, edgecolor=PAPER, linewidth=0.4, in_layout=False, zorder=1, **fill)
        axes.add_patch(cell)
        names = [(name, str(row[name])) for name in ("attribute", "participant", words["by"])]
        value = number(grid[i, j]) if known else "missing"
        marking.add(cell, (*names, ("rating", value)), str(row[words["by"]]))


def _columns(axes: Axes, grid: Any, attribute: str, words: Mapping[str, Any], marking: Marking) -> None:
    """Many cells: each column is a mark, over the picture and unseen."""
    for j, level in enumerate(words["levels"]):
        known = grid[:, j][~np.isnan(grid[:, j])].tolist()
        strip = Rectangle((j - 0.5, -0.5), 1, len(grid), facecolor=PAPER, alpha=0.0, linewidth=0, zorder=2)
        strip.set_in_layout(False)
        axes.add_patch(strip)
        mean = number(math.fsum(known) / len(known)) if known else "no rating"
        told = (("attribute", attribute), (words["by"], level), ("mean", mean), ("participants", str(len(known))))
        marking.add(strip, told, level)


RATING_HEATMAP = FigureKind(RatingHeatmap, _data, draw)


def similar_order(values: Floats) -> list[int]:
    """The rows of a table so ordered that alike ones stand together; NaN is no value.

    The distance of two rows is the root mean square of their differences where both have a value; rows that share
    nothing are as far apart as the most distant pair. Average linkage with optimal leaf order (Bar-Joseph, Gifford &
    Jaakkola 2001). The end with the lower mean comes first, so that no run turns the order round.
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
