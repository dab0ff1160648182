"""A perceptual space of up to four attributes: two axes, the size and the colour of a bubble (thesis Figure 3.3c)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from palpate.analysis.figures.columns import require
from palpate.analysis.figures.figure_kind import AskedFigure, Drawn, FigureData, FigureKind, Marking, Shown
from palpate.analysis.figures.label_places import Bubble, placed_labels
from palpate.analysis.figures.lettering import elided, number, signed, widest_pt
from palpate.analysis.figures.rating_axes import attribute_words, demand_attributes, people_text, quarters, scale_words
from palpate.analysis.figures.style import FAINT, INK, PAPER, SOFT
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.normalising import rescaled_values
from palpate.analysis.ratings.person_cells import person_cells, texts_of
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.study import Text
from palpate.protocols.undefined import nan_to_none
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from palpate.analysis.plans.answers import Row, Selected

Ends = tuple[float, float]
SPACE = (-100.0, 100.0)
ROLES = ("x", "y", "size", "colour")
SIDE, LEFT, BOTTOM, KEY = 6.6, 0.85, 0.75, 2.1
RADII = (3.2, 15.0)
"""Inches of the square, its margins and the legend's column; radii in points of the smallest and largest bubble."""


class Bubbles(AskedFigure):
    """`x`, `y`, `size`, `colour`: attributes (None: the study's next that is not named; size and colour may lack).

    `by`: the column of which each level is a bubble; `label`: a column with the name to write beside it. `reversed`:
    attributes drawn the other way round, the second word at the low end. `span`: the whole scale, or of each attribute
    as much around its middle as the means reach.
    """

    figure: Literal["bubbles"]
    x: Text | None = None
    y: Text | None = None
    size: Text | None = None
    colour: Text | None = None
    by: Text = "stimulus"
    label: Text | None = None
    reversed: tuple[Text, ...] = ()
    span: Literal["scale", "data"] = "scale"


def _data(shown: Shown, asked: Bubbles) -> FigureData:
    selected = shown.selected
    demand_attributes(asked.name, selected)
    require(asked, selected.table, (asked.by, *([asked.label] if asked.label else [])))
    roles = _roles(selected, asked)
    scale, ends = _ends(selected)
    rows = _rows(selected, asked, list(roles.values()), scale, ends)
    known = {words["name"]: words for words in attribute_words(selected)}
    attributes = {role: _turned(known[name], name in asked.reversed) for role, name in roles.items()}
    lacking = sum(any(row[name] is None for name in roles.values()) for row in rows)
    on = f"brought to {signed(ends[0], ends)} to {signed(ends[1], ends)}" if selected.scale else "as given"
    caption = f"Each bubble is a {asked.by} ({len(rows)}): mean ratings over {people_text(rows)}, {on}."
    caption += " Names stand where there is room; pointing at a bubble and the table name all."
    if lacking:
        caption += f" {count(lacking, asked.by)} without a rating on one of these attributes not drawn."
    for role, name in roles.items():
        reached = [_value(row, name) for row in rows if row[name] is not None]
        attributes[role] |= {"ends": list(_around(ends, reached) if asked.span == "data" else ends)}
    words = {"by": asked.by, "roles": attributes}
    return FigureData(rows, asked.title or "The perceptual space.", caption, words)


def _roles(selected: Selected, asked: Bubbles) -> dict[str, str]:
    """The attribute of each role; at least two, at most four."""
    named = {role: getattr(asked, role) for role in ROLES if getattr(asked, role) is not None}
    for name in (*named.values(), *asked.reversed):
        if name not in selected.outcomes:
            raise DataRefused(f"figure {asked.name!r}: no attribute {name!r}; {nearest(name, selected.outcomes)}")
    if len(set(named.values())) < len(named):
        raise DataRefused(f"figure {asked.name!r}: an attribute has two roles; name each of {', '.join(ROLES)} once")
    free = [name for name in selected.outcomes if name not in named.values()]
    found = {}
    for role in ROLES:
        if role in named or free:
            found[role] = named[role] if role in named else free.pop(0)
    if len(found) < 2:
        raise DataRefused(f"figure {asked.name!r}: a plane needs two attributes, {', '.join(selected.outcomes)} is one")
    return found


def _ends(selected: Selected) -> tuple[Ends, Ends]:
    """The ends of the values' own scale, and those of the plane."""
    low, high = scale_words(selected)
    return (low, high), SPACE if selected.scale is not None else (low, high)


def _around(ends: Ends, values: Sequence[float]) -> Ends:
    """As much of the scale around its middle as the values reach, in tenths of its half; never nothing."""
    middle, half = (ends[0] + ends[1]) / 2, (ends[1] - ends[0]) / 2
    reach = max((abs(value - middle) for value in values), default=half)
    tenths = min(10, max(1, math.ceil(10 * reach / half)))
    return middle - half * tenths / 10, middle + half * tenths / 10


def _turned(words: Mapping[str, str], turned: bool) -> dict[str, Any]:
    low, high = words["low"], words["high"] or f"not {words['low']}"
    if not words["high"]:
        low, high = f"less {words['name']}", f"more {words['name']}"
    return {"name": words["name"], "low": high if turned else low, "high": low if turned else high}


def _rows(
    selected: Selected,
    asked: Bubbles,
    names: Sequence[str],
    scale: Ends,
    ends: Ends,
) -> tuple[Row, ...]:
    cells = person_cells(selected.table, (asked.by, "attribute"), levels=selected.levels)
    labels = dict(
        zip(texts_of(selected.table, asked.by), texts_of(selected.table, asked.label or asked.by), strict=True)
    )
    place = {cell: j for j, cell in enumerate(cells.cells)}
    rows: list[Row] = []
    for level in dict.fromkeys(cell[0] for cell in cells.cells):
        row: dict[str, Any] = {asked.by: level, "label": labels[level]}
        people = []
        for name in names:
            j = place.get((level, name))
            values = [] if j is None else [v for v in cells.values[:, j].tolist() if not math.isnan(v)]
            mean = np.array([math.fsum(values) / len(values) if values else math.nan])
            mean = rescaled_values(mean, scale, ends)
            value = float(ends[0] + ends[1] - mean[0] if name in asked.reversed else mean[0])
            row[name] = nan_to_none(value)
            people.append(len(values))
        rows.append({**row, "n": min(people)})
    return tuple(rows)


def draw(data: FigureData) -> Drawn:
    """The plane from end to end of the scale, small bubbles on top of large ones."""
    words, marking = data.words, Marking()
    roles = words["roles"]
    key = KEY if len(roles) > 2 else 0.3
    width, height = LEFT + SIDE + key, BOTTOM + SIDE + 0.35
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((LEFT / width, BOTTOM / height, SIDE / width, SIDE / height))
    _plane(axes, roles)
    rows = [row for row in data.rows if all(row[role["name"]] is not None for role in roles.values())]
    shade = ScalarMappable(Normalize(*roles.get("colour", roles["x"])["ends"]), colormaps["viridis"])
    bubbles = [_bubble(row, roles) for row in rows]
    for k in sorted(range(len(rows)), key=lambda k: (-bubbles[k].radius, k)):
        row, bubble = rows[k], bubbles[k]
        colour = _colour(shade, row, roles)
        circle = Circle((bubble.x, bubble.y), bubble.radius, facecolor=colour, edgecolor=INK, linewidth=0.7)
        circle.set(alpha=0.88, zorder=3)
        axes.add_patch(circle)
        marking.add(circle, _told(row, words), str(row[words["by"]]))
    for spot in placed_labels(bubbles, 72 * SIDE, 7.0):
        axes.annotate(
            spot.text,
            (spot.x, spot.y),
            ha="left",
            va="center",
            fontsize=7.0,
            color=INK,
            zorder=5,
        )
    _sizes(figure, roles, (width, height))
    _colours(figure, roles, shade, (width, height))
    return Drawn(figure, marking.all())


def _value(row: Row, name: str) -> float:
    value = row[name]
    return float(value) if isinstance(value, int | float) else math.nan


def _colour(shade: ScalarMappable, row: Row, roles: Mapping[str, Any]) -> Any:
    if "colour" not in roles:
        return "#8dbbdc"
    return shade.to_rgba(np.array([_value(row, roles["colour"]["name"])]))[0]


def _share(value: float, ends: Ends) -> float:
    return (value - ends[0]) / (ends[1] - ends[0])


def _radius(value: float, ends: Ends) -> float:
    """Areas grow evenly with the rating."""
    low, high = RADII
    return math.sqrt(low**2 + (high**2 - low**2) * min(1.0, max(0.0, _share(value, ends))))


def _place(value: float, ends: Ends) -> float:
    """Where a rating lies along an axis, in points; a margin is left at both ends."""
    return 72 * SIDE * (0.04 + _share(value, ends)) / 1.08


def _bubble(row: Row, roles: Mapping[str, Any]) -> Bubble:
    radius = _radius(_value(row, roles["size"]["name"]), roles["size"]["ends"]) if "size" in roles else 6.0
    x, y = (_place(_value(row, roles[axis]["name"]), roles[axis]["ends"]) for axis in ("x", "y"))
    return Bubble(x, y, radius, elided(str(row["label"]), 24))


def _told(row: Row, words: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    name = [] if row["label"] == row[words["by"]] else [("name", str(row["label"]))]
    values = [
        (f"{role['low']} → {role['high']}", number(_value(row, role["name"]), 1)) for role in words["roles"].values()
    ]
    return ((words["by"], str(row[words["by"]])), *name, *values, ("participants", str(row["n"])))


def _plane(axes: Axes, roles: Mapping[str, Any]) -> None:
    """Both axes in points, with the ratings written at them, a cross at the middle, the words at the ends."""
    axes.set(xlim=(0, 72 * SIDE), ylim=(0, 72 * SIDE))
    axes.axhline(36 * SIDE, color=SOFT, linewidth=0.8, zorder=1)
    axes.axvline(36 * SIDE, color=SOFT, linewidth=0.8, zorder=1)
    for axis, name in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        ends = roles[name]["ends"]
        axis.set_ticks(
            [_place(value, ends) for value in quarters(ends)], [signed(value, ends) for value in quarters(ends)]
        )
    long = widest_pt([signed(value, roles["y"]["ends"]) for value in quarters(roles["y"]["ends"])], 9.0) > 72 * 0.45
    axes.tick_params(axis="y", rotation=90 if long else 0)
    axes.grid(visible=True, color=FAINT)
    for spine in axes.spines.values():
        spine.set_visible(False)
    words: dict[str, Any] = {"fontweight": "bold", "fontsize": 9.5, "transform": axes.transAxes}
    x, y = roles["x"], roles["y"]
    axes.text(0, -0.066, elided(x["low"], 30), ha="left", va="center", **words)
    axes.text(1, -0.066, elided(x["high"], 30), ha="right", va="center", **words)
    axes.text(-0.1, 0, elided(y["low"], 30), ha="center", va="bottom", rotation=90, **words)
    axes.text(-0.1, 1, elided(y["high"], 30), ha="center", va="top", rotation=90, **words)


def _sizes(figure: Figure, roles: Mapping[str, Any], inches: tuple[float, float]) -> None:
    if "size" not in roles:
        return
    width, height = inches
    box = figure.add_axes(((LEFT + SIDE + 0.25) / width, (height - 0.35 - 1.6) / height, 1.75 / width, 1.6 / height))
    box.set(xlim=(0, 72 * 1.75), ylim=(0, 72 * 1.6))
    box.set_axis_off()
    role, ends = roles["size"], roles["size"]["ends"]
    middle = (ends[0] + ends[1]) / 2
    box.text(0, 72 * 1.6, "size", va="top", fontsize=8, color=SOFT)
    named = ((ends[1], role["high"], 80), (middle, "", 50), (ends[0], role["low"], 26))
    for value, word, y in named:
        box.add_patch(Circle((16, y), _radius(value, ends), facecolor=PAPER, edgecolor=INK, linewidth=0.8))
        box.text(38, y, signed(value, ends), va="center", fontsize=8)
        box.text(66, y, elided(word, 13), va="center", fontsize=8 if len(word) > 9 else 9, fontweight="bold")


def _colours(
    figure: Figure,
    roles: Mapping[str, Any],
    shade: ScalarMappable,
    inches: tuple[float, float],
) -> None:
    if "colour" not in roles:
        return
    width, height = inches
    bottom, tall = BOTTOM + SIDE - 4.6, 2.3
    box = figure.add_axes(((LEFT + SIDE + 0.35) / width, bottom / height, 0.2 / width, tall / height))
    bar, ends = figure.colorbar(shade, cax=box), roles["colour"]["ends"]
    bar.set_ticks(quarters(ends), labels=[signed(value, ends) for value in quarters(ends)], fontsize=8)
    bar.outline.set_visible(False)
    role = roles["colour"]
    words: dict[str, Any] = {"transform": box.transAxes, "fontsize": 9, "fontweight": "bold", "ha": "left"}
    box.text(-0.5, 1.16, "colour", fontsize=8, color=SOFT, transform=box.transAxes, ha="left")
    box.text(-0.5, 1.05, elided(role["high"], 20), **words)
    box.text(-0.5, -0.09, elided(role["low"], 20), **words)


BUBBLES = FigureKind(Bubbles, _data, draw)
