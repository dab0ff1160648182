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

from palpate.analysis.figures.columns import require_columns
from palpate.analysis.figures.figure_kind import DrawnFigure, FigureData, FigureInput, FigureKind, FigureSettings, Marks
from palpate.analysis.figures.label_places import Bubble, place_beside_bubbles
from palpate.analysis.figures.lettering import elide, format_number, format_signed, widest_pt
from palpate.analysis.figures.rating_axes import attribute_words, count_people, demand_attributes, quarters, scale_ends
from palpate.analysis.figures.style import FAINT, INK, PAPER, SOFT
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.normalisation import rescaled_values
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
"""The square, its margins and the legend's column in inches; the smallest and the largest radius in points."""


class BubblesSettings(FigureSettings):
    """The settings of a bubble plot: attributes `x`, `y`, `size`, `colour`, by default the study's next unnamed ones.

    `size` and `colour` are optional. `by`: the column with a bubble per level; `label`: a column with the bubbles'
    names. `reversed`: attributes drawn with the second word at the low end. `span`: the whole scale, or for each
    attribute the range of the means around its middle.
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


def data(inputs: FigureInput, settings: BubblesSettings) -> FigureData:
    """Return a row for each bubble: its means of the attributes with a role, and the number of participants."""
    selected = inputs.selected
    demand_attributes(settings.name, selected)
    require_columns(settings, selected.table, (settings.by, *([settings.label] if settings.label else [])))
    roles = _roles(selected, settings)
    low, high = scale_ends(selected)
    scale, ends = (low, high), SPACE if selected.scale is not None else (low, high)
    rows = _rows(selected, settings, list(roles.values()), scale, ends)
    known = {words["name"]: words for words in attribute_words(selected)}
    incomplete = sum(any(row[name] is None for name in roles.values()) for row in rows)
    rescaled = (
        f"brought to {format_signed(ends[0], ends)} to {format_signed(ends[1], ends)}" if selected.scale else "as given"
    )
    caption = f"Each bubble is a {settings.by} ({len(rows)}): mean ratings over {count_people(rows)}, {rescaled}."
    caption += " Names stand where there is room; pointing at a bubble and the table name all."
    if incomplete:
        caption += f" {count(incomplete, settings.by)} without a rating on one of these attributes not drawn."
    attributes: dict[str, dict[str, Any]] = {}
    for role, name in roles.items():
        words = known[name]
        poles = (words["low"], words["high"]) if words["high"] else (f"less {name}", f"more {name}")
        first, second = reversed(poles) if name in settings.reversed else poles
        span = ends
        if settings.span == "data":
            # As much of the scale around its middle as the means reach, in tenths of its half; never nothing.
            middle, half = (ends[0] + ends[1]) / 2, (ends[1] - ends[0]) / 2
            reach = max((abs(_value(row, name) - middle) for row in rows if row[name] is not None), default=half)
            tenths = min(10, max(1, math.ceil(10 * reach / half)))
            span = middle - half * tenths / 10, middle + half * tenths / 10
        attributes[role] = {"name": name, "low": first, "high": second, "ends": list(span)}
    return FigureData(
        rows, settings.title or "The perceptual space.", caption, {"by": settings.by, "roles": attributes}
    )


def _roles(selected: Selected, settings: BubblesSettings) -> dict[str, str]:
    """Return the attribute of each role. Raises DataRefused unless there are two to four."""
    chosen = {role: getattr(settings, role) for role in ROLES if getattr(settings, role) is not None}
    for name in (*chosen.values(), *settings.reversed):
        if name not in selected.outcomes:
            raise DataRefused(f"figure {settings.name!r}: no attribute {name!r}; {nearest(name, selected.outcomes)}")
    if len(set(chosen.values())) < len(chosen):
        raise DataRefused(f"figure {settings.name!r}: an attribute has two roles; name each of {', '.join(ROLES)} once")
    left = [name for name in selected.outcomes if name not in chosen.values()]
    roles = {}
    for role in ROLES:
        if role in chosen or left:
            roles[role] = chosen[role] if role in chosen else left.pop(0)
    if len(roles) < 2:
        raise DataRefused(
            f"figure {settings.name!r}: a plane needs two attributes, {', '.join(selected.outcomes)} is one"
        )
    return roles


def _rows(
    selected: Selected,
    settings: BubblesSettings,
    names: Sequence[str],
    scale: Ends,
    ends: Ends,
) -> tuple[Row, ...]:
    cells = person_cells(selected.table, (settings.by, "attribute"), levels=selected.levels)
    labels = dict(
        zip(texts_of(selected.table, settings.by), texts_of(selected.table, settings.label or settings.by), strict=True)
    )
    column = {cell: j for j, cell in enumerate(cells.cells)}
    rows: list[Row] = []
    for level in dict.fromkeys(cell[0] for cell in cells.cells):
        row: dict[str, Any] = {settings.by: level, "label": labels[level]}
        people = []
        for name in names:
            j = column.get((level, name))
            values = [] if j is None else [v for v in cells.values[:, j].tolist() if not math.isnan(v)]
            mean = np.array([math.fsum(values) / len(values) if values else math.nan])
            mean = rescaled_values(mean, scale, ends)
            value = float(ends[0] + ends[1] - mean[0] if name in settings.reversed else mean[0])
            row[name] = nan_to_none(value)
            people.append(len(values))
        rows.append({**row, "n": min(people)})
    return tuple(rows)


def draw(data: FigureData) -> DrawnFigure:
    """Draw the plane over the whole scale, with small bubbles on top of large ones."""
    words, marks = data.words, Marks()
    roles = words["roles"]
    key = KEY if len(roles) > 2 else 0.3
    width, height = LEFT + SIDE + key, BOTTOM + SIDE + 0.35
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((LEFT / width, BOTTOM / height, SIDE / width, SIDE / height))
    _set_axes(axes, roles)
    rows = [row for row in data.rows if all(row[role["name"]] is not None for role in roles.values())]
    shade = ScalarMappable(Normalize(*roles.get("colour", roles["x"])["ends"]), colormaps["viridis"])
    bubbles = []
    for row in rows:
        radius = _radius(_value(row, roles["size"]["name"]), roles["size"]["ends"]) if "size" in roles else 6.0
        x, y = (_place(_value(row, roles[axis]["name"]), roles[axis]["ends"]) for axis in ("x", "y"))
        bubbles.append(Bubble(x, y, radius, elide(str(row["label"]), 24)))
    for k in sorted(range(len(rows)), key=lambda k: (-bubbles[k].radius, k)):
        row, bubble = rows[k], bubbles[k]
        colour: Any = "#8dbbdc"
        if "colour" in roles:
            colour = shade.to_rgba(np.array([_value(row, roles["colour"]["name"])]))[0]
        circle = Circle((bubble.x, bubble.y), bubble.radius, facecolor=colour, edgecolor=INK, linewidth=0.7)
        circle.set(alpha=0.88, zorder=3)
        axes.add_patch(circle)
        name = [] if row["label"] == row[words["by"]] else [("name", str(row["label"]))]
        ratings = [
            (f"{role['low']} → {role['high']}", format_number(_value(row, role["name"]), 1))
            for role in words["roles"].values()
        ]
        details = ((words["by"], str(row[words["by"]])), *name, *ratings, ("participants", str(row["n"])))
        marks.add(circle, details, str(row[words["by"]]))
    for spot in place_beside_bubbles(bubbles, 72 * SIDE, 7.0):
        axes.annotate(
            spot.text,
            (spot.x, spot.y),
            ha="left",
            va="center",
            fontsize=7.0,
            color=INK,
            zorder=5,
        )
    _draw_size_key(figure, roles, (width, height))
    _draw_colour_key(figure, roles, shade, (width, height))
    return DrawnFigure(figure, marks.all())


def _value(row: Row, name: str) -> float:
    value = row[name]
    return float(value) if isinstance(value, int | float) else math.nan


def _share(value: float, ends: Ends) -> float:
    return (value - ends[0]) / (ends[1] - ends[0])


def _radius(value: float, ends: Ends) -> float:
    """Return a bubble's radius in points; areas are proportional to the rating."""
    low, high = RADII
    return math.sqrt(low**2 + (high**2 - low**2) * min(1.0, max(0.0, _share(value, ends))))


def _place(value: float, ends: Ends) -> float:
    """Return the position of a rating along an axis, in points, with a margin at both ends."""
    return 72 * SIDE * (0.04 + _share(value, ends)) / 1.08


def _set_axes(axes: Axes, roles: Mapping[str, Any]) -> None:
    """Set both axes in points, with ratings as labels, a cross at the middle, and the words at the ends."""
    axes.set(xlim=(0, 72 * SIDE), ylim=(0, 72 * SIDE))
    axes.axhline(36 * SIDE, color=SOFT, linewidth=0.8, zorder=1)
    axes.axvline(36 * SIDE, color=SOFT, linewidth=0.8, zorder=1)
    for axis, name in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        ends = roles[name]["ends"]
        axis.set_ticks(
            [_place(value, ends) for value in quarters(ends)], [format_signed(value, ends) for value in quarters(ends)]
        )
    long = (
        widest_pt([format_signed(value, roles["y"]["ends"]) for value in quarters(roles["y"]["ends"])], 9.0) > 72 * 0.45
    )
    axes.tick_params(axis="y", rotation=90 if long else 0)
    axes.grid(visible=True, color=FAINT)
    for spine in axes.spines.values():
        spine.set_visible(False)
    words: dict[str, Any] = {"fontweight": "bold", "fontsize": 9.5, "transform": axes.transAxes}
    x, y = roles["x"], roles["y"]
    axes.text(0, -0.066, elide(x["low"], 30), ha="left", va="center", **words)
    axes.text(1, -0.066, elide(x["high"], 30), ha="right", va="center", **words)
    axes.text(-0.1, 0, elide(y["low"], 30), ha="center", va="bottom", rotation=90, **words)
    axes.text(-0.1, 1, elide(y["high"], 30), ha="center", va="top", rotation=90, **words)


def _draw_size_key(figure: Figure, roles: Mapping[str, Any], inches: tuple[float, float]) -> None:
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
        box.text(38, y, format_signed(value, ends), va="center", fontsize=8)
        box.text(66, y, elide(word, 13), va="center", fontsize=8 if len(word) > 9 else 9, fontweight="bold")


def _draw_colour_key(
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
    bar.set_ticks(quarters(ends), labels=[format_signed(value, ends) for value in quarters(ends)], fontsize=8)
    bar.outline.set_visible(False)
    role = roles["colour"]
    words: dict[str, Any] = {"transform": box.transAxes, "fontsize": 9, "fontweight": "bold", "ha": "left"}
    box.text(-0.5, 1.16, "colour", fontsize=8, color=SOFT, transform=box.transAxes, ha="left")
    box.text(-0.5, 1.05, elide(role["high"], 20), **words)
    box.text(-0.5, -0.09, elide(role["low"], 20), **words)


BUBBLES = FigureKind(BubblesSettings, data, draw)
