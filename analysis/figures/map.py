"""A map of stimuli: near ones feel similar, ellipses show uncertainty, arrows show where an adjective grows."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Ellipse
from matplotlib.patheffects import withStroke

from palpate.analysis.figures.columns import (
    answer_of_test,
    fill_columns,
    finite_or_nan,
    ordered_levels,
    require_columns,
    to_float,
)
from palpate.analysis.figures.figure_kind import DrawnFigure, FigureData, FigureInput, FigureKind, FigureSettings, Marks
from palpate.analysis.figures.label_places import Area, place_beside_points
from palpate.analysis.figures.lettering import fold, format_number, format_p, shorten, width_pt
from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, PAPER, SOFT, colours_and_shapes, tint
from palpate.analysis.plans.answers import Answer, Row, Selected
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.dataset import DataRefused, natural_key
from palpate.analysis.ratings.person_cells import texts_of
from palpate.protocols.undefined import nan_to_none
from palpate.protocols.wording import phrase

PLACES = ("dim", "dimension", "pc", "component")
DIRECTIONS = ("direction",)
NEAR = 1e-6
MAP_IN = 6.3
"""The longer side of the map in inches."""


class MapSettings(FigureSettings):
    """The settings of a map: the configuration of one test of `mds` (or `pca`) in two of its `dimensions`.

    `tests` may also name a test of `vectors`. `over` and `items` are those of the tests: the columns that name a point
    and a vector. `class_column` gives each class of stimuli a colour and a shape: a column of the answer or of the
    stimuli. `label_column` labels the points by another column than the stimulus. `ellipses` and `vectors` say whether
    to draw those of the tests.
    """

    figure: Literal["map"]
    over: str = "stimulus"
    items: str = "attribute"
    dimensions: tuple[int, int] = (1, 2)
    class_column: str | None = None
    label_column: str | None = None
    ellipses: bool = True
    vectors: bool = True

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        answer = "in a map, which shows the answer of its test as it is"
        yield from (Idle(name, answer) for name in ("outcomes", "normalise"))
        if self.class_column is None and self.label_column is None:
            yield from (Idle(name, answer) for name in ("where", "table", "source"))
        if self.dimensions != (1, 2):
            yield Idle("ellipses", "in other dimensions than 1 and 2, where none are drawn")
        if not self.vectors:
            yield Idle("items", "with `vectors: false`")


def data(inputs: FigureInput, settings: MapSettings) -> FigureData:
    """Return rows of three kinds (`shows`): each "point" with its class and place, each "ellipse", each "vector".

    A vector points in the direction in which the attribute's value grows, to the second word of its scale. Raises
    DataRefused where no named test has places, or a stimulus has several classes.
    """
    answer = _answer_with_places(settings, inputs, PLACES, settings.over)
    if answer is None:
        raise DataRefused(
            f"figure {settings.name!r}: `tests` must name a test whose rows have `{settings.over}` and the dimensions"
            f" {settings.dimensions[0]} and {settings.dimensions[1]} (mds, pca);"
            f" named: {', '.join(settings.tests) or 'none'}"
        )
    vectors = _answer_with_places(settings, inputs, DIRECTIONS, settings.items) if settings.vectors else None
    if settings.vectors and len(settings.tests) > 1 + (vectors is not None):
        raise DataRefused(
            f"figure {settings.name!r}: a map shows one test with places and one of vectors, whose rows have"
            f" `{settings.items}` and directions; named: {', '.join(settings.tests)}"
        )
    points = _point_rows(settings, inputs.selected, answer)
    if vectors is not None:
        _refuse_other_map(settings, points, vectors)
    rows = [
        *points,
        *_ellipse_rows(settings, answer),
        *(_vector_rows(settings, inputs.selected, vectors) if vectors else []),
    ]
    classes = {str(point["class"]) for point in points if point["class"] is not None}
    words: dict[str, Any] = {
        "classes": list(ordered_levels(inputs.selected, settings.class_column or "", classes)),
        "class_name": settings.class_column or "",
        "dimensions": list(settings.dimensions),
    }
    words["alpha"] = inputs.selected.alpha
    filled = fill_columns(rows)
    return FigureData(filled, settings.title or "Map of the stimuli", _caption(inputs, answer, filled), words)


def _refuse_other_map(settings: MapSettings, points: Sequence[dict[str, Any]], vectors: Answer) -> None:
    """Raise DataRefused if the vectors were fitted to another configuration, where their directions differ."""
    fitted = {
        str(row[settings.over]): _coordinates(settings, row, PLACES) for row in vectors.more.get("configuration", ())
    }
    reach = max(math.hypot(point["x"], point["y"]) for point in points)
    apart = [
        str(point["stimulus"])
        for point in points
        if fitted and math.dist(fitted.get(point["stimulus"], (math.inf, 0.0)), (point["x"], point["y"])) > NEAR * reach
    ]
    if apart:
        raise DataRefused(
            f"figure {settings.name!r}: its vectors were fitted to another map than it shows"
            f" ({phrase(apart[:3])} lie elsewhere); give the test of vectors the `on` and the other settings of"
            " the map's test"
        )


def _answer_with_places(settings: MapSettings, inputs: FigureInput, kinds: Sequence[str], label: str) -> Answer | None:
    """Return the only answer with a label and two coordinates; None if no test has them."""
    names = []
    for name in settings.tests:
        answer = answer_of_test(settings, inputs, name)
        if (
            answer.rows
            and label in answer.rows[0]
            and all(_column(answer.rows[0], kinds, k) for k in settings.dimensions)
        ):
            names.append(name)
    if len(names) > 1:
        raise DataRefused(f"figure {settings.name!r}: {phrase(names)} would be drawn in one place; name one of them")
    return answer_of_test(settings, inputs, names[0]) if names else None


def _column(row: Row, kinds: Sequence[str], dimension: int) -> str | None:
    """Return the column of a dimension in any of its spellings: dim1, Dim_1, dimension 1."""
    names = {f"{kind}{dimension}" for kind in kinds}
    return next((name for name in row if re.sub(r"[^a-z0-9]", "", name.lower()) in names), None)


def _coordinates(settings: MapSettings, row: Row, kinds: Sequence[str]) -> tuple[float, float]:
    names = [_column(row, kinds, dimension) for dimension in settings.dimensions]
    x, y = (finite_or_nan(row[str(name)], f"figure {settings.name!r}") for name in names)
    return x, y


def _point_rows(settings: MapSettings, selected: Selected, answer: Answer) -> list[dict[str, Any]]:
    classes = _column_by_stimulus(settings, selected, answer, settings.class_column)
    labels = _column_by_stimulus(settings, selected, answer, settings.label_column)
    order = {
        name: i
        for i, name in enumerate(ordered_levels(selected, settings.over, (str(r[settings.over]) for r in answer.rows)))
    }
    rows = []
    for row in sorted(answer.rows, key=lambda row: order[str(row[settings.over])]):
        name, (x, y) = str(row[settings.over]), _coordinates(settings, row, PLACES)
        if math.isnan(x) or math.isnan(y):
            raise DataRefused(f"figure {settings.name!r}: stimulus {name!r} has no place in the map")
        rows.append(
            {
                "shows": "point",
                "stimulus": name,
                "label": labels.get(name, name),
                "class": classes.get(name),
                "x": x,
                "y": y,
            }
        )
    return rows


def _column_by_stimulus(
    settings: MapSettings, selected: Selected, answer: Answer, column: str | None
) -> dict[str, str]:
    """Return a column's value for each stimulus, from the answer's own rows, else from the study's."""
    if column is None:
        return {}
    if column in answer.rows[0]:
        return {str(row[settings.over]): str(row[column]) for row in answer.rows}
    frame = selected.table if column in selected.table.columns else selected.trials
    require_columns(settings, frame, [settings.over, column])
    pairs = set(zip(texts_of(frame, settings.over), texts_of(frame, column), strict=True))
    levels = dict(pairs)
    if len(levels) < len(pairs):
        several = sorted({name for name, level in pairs if levels[name] != level}, key=natural_key)
        raise DataRefused(f"figure {settings.name!r}: column {column!r} has several levels for {phrase(several[:5])}")
    return levels


def _ellipse_rows(settings: MapSettings, answer: Answer) -> list[dict[str, Any]]:
    """Return a row for each ellipse; none in other dimensions than those of the ellipses."""
    if not settings.ellipses or settings.dimensions != (1, 2):
        return []
    rows = []
    for row in answer.more.get("ellipses", ()):
        where = f"figure {settings.name!r}, ellipse of {row[settings.over]!r}"
        x, y = (finite_or_nan(row[name], where) for name in ("centre_1", "centre_2"))
        major, minor, angle = (finite_or_nan(row[name], where) for name in ("semi_major", "semi_minor", "angle_deg"))
        if not any(math.isnan(part) for part in (x, y, major, minor, angle)):
            sizes = {"semi_major": major, "semi_minor": minor, "angle_deg": angle}
            rows.append({"shows": "ellipse", "stimulus": str(row[settings.over]), "x": x, "y": y, **sizes})
    return sorted(rows, key=lambda row: natural_key(str(row["stimulus"])))


def _vector_rows(settings: MapSettings, selected: Selected, answer: Answer) -> list[dict[str, Any]]:
    order = {
        name: i
        for i, name in enumerate(
            ordered_levels(selected, settings.items, (str(r[settings.items]) for r in answer.rows))
        )
    }
    rows = []
    for row in sorted(answer.rows, key=lambda row: order[str(row[settings.items])]):
        name, (x, y) = str(row[settings.items]), _coordinates(settings, row, DIRECTIONS)
        where = f"figure {settings.name!r}, vector {name!r}"
        r2, p = finite_or_nan(row["r2"], where), finite_or_nan(row.get("p"), where)
        antonym = str(row.get("antonym") or selected.antonyms.get(name, ""))
        numbers = {"x": nan_to_none(x), "y": nan_to_none(y), "r2": nan_to_none(r2), "p": nan_to_none(p)}
        rows.append({"shows": "vector", "attribute": name, "antonym": antonym, **numbers})
    return rows


def _caption(inputs: FigureInput, answer: Answer, rows: Sequence[Row]) -> str:
    kinds = {str(row["shows"]) for row in rows}
    parts = [answer.method.rstrip(".") + ".", *([answer.headline.rstrip(".") + "."] if answer.headline else [])]
    parts.append("Both axes have one scale; their directions and signs mean nothing by themselves.")
    if "ellipse" in kinds:
        notes = [note for note in answer.notes if note.lower().startswith("ellipses: ")]
        where = notes[0][len("ellipses: ") :].rstrip(".") if notes else "as the test resampled it"
        parts.append(f"Ellipses: where a stimulus may lie ({where}).")
    if "vector" in kinds:
        parts.append(
            "Arrows: where an attribute's value grows, towards the second word of its scale; as long as its multiple"
            f" correlation R with the map, the ring being R = 1; dashed: p not below {inputs.selected.alpha:g}."
        )
        undefined = [
            str(row["attribute"])
            for row in rows
            if row["shows"] == "vector" and (row["x"] is None or row["r2"] is None)
        ]
        parts += [f"Without a direction: {phrase(undefined)}."] if undefined else []
    return " ".join(parts)


def draw(data: FigureData) -> DrawnFigure:
    """Draw ellipses, then arrows, then points with their names, and the classes' colours and shapes on the right."""
    limits = _limits(data)
    spans = [high - low for low, high in limits]
    per_unit = MAP_IN / max(spans)
    classes = data.words["classes"]
    legend_in = 0.5 + 0.075 * max((min(len(c), 26) for c in classes), default=-6)
    figure = Figure(figsize=(spans[0] * per_unit + 0.75 + legend_in, spans[1] * per_unit + 0.65), layout="constrained")
    axes, marks = figure.add_subplot(), Marks()
    # Give both axes one scale, a faint grid and the names of their dimensions.
    axes.set(xlim=limits[0], ylim=limits[1], aspect="equal")
    axes.grid(visible=True, color=FAINT, linewidth=0.4)
    for spine in axes.spines.values():
        spine.set(visible=True, color=FAINT)
    axes.tick_params(labelsize=7.5, labelcolor=SOFT)
    axes.locator_params(nbins=7)
    first, second = data.words["dimensions"]
    axes.set_xlabel(f"dimension {first}", color=SOFT)
    axes.set_ylabel(f"dimension {second}", color=SOFT)
    look = dict(zip(classes, colours_and_shapes(len(classes)), strict=True))
    points = _rows_of(data, "point")
    # Draw each stimulus' ellipse in the colour of its point, filled faintly and with an edge.
    rows = _rows_of(data, "ellipse")
    colours = {str(row["stimulus"]): _look_of(look, row)[0] for row in points}
    for row in rows:
        colour, place = colours.get(str(row["stimulus"]), SOFT), (to_float(row["x"]), to_float(row["y"]))
        sides, angle = [2 * to_float(row[name]) for name in ("semi_major", "semi_minor")], to_float(row["angle_deg"])
        fill: dict[str, Any] = {"facecolor": colour, "alpha": 0.10, "linewidth": 0, "zorder": 1}
        edge: dict[str, Any] = {"fill": False, "edgecolor": tint(colour, 0.6), "linewidth": 0.6, "zorder": 1.1}
        for style in (fill, edge):
            axes.add_patch(Ellipse(place, *sides, angle=angle, **style))
    taken = _draw_arrows(axes, marks, data, limits, per_unit * 72)
    _draw_points(axes, marks, points, look)
    _write_names(axes, points, (limits[0][0], limits[1][0]), per_unit * 72, taken)
    if classes:
        dot: dict[str, Any] = {"linestyle": "", "markersize": 6.2, "markeredgecolor": PAPER, "markeredgewidth": 0.5}
        handles = [Line2D([], [], marker=shape, color=colour, **dot) for colour, shape in look.values()]
        figure.legend(
            handles, [fold(level, 26) for level in look], title=str(data.words["class_name"]),
            loc="outside right upper", frameon=False, fontsize=8 if len(look) <= 24 else 6, labelcolor=INK,
            handletextpad=0.2, alignment="left",
        )  # fmt: skip
    return DrawnFigure(figure, marks.all())


def _draw_points(axes: Axes, marks: Marks, points: Sequence[Row], look: dict[str, tuple[str, str]]) -> None:
    """Draw each stimulus as a point in its class's colour and shape."""
    for row in points:
        x, y, (colour, shape) = to_float(row["x"]), to_float(row["y"]), _look_of(look, row)
        style: dict[str, Any] = {"markerfacecolor": colour, "markeredgecolor": PAPER, "markeredgewidth": 0.7}
        (point,) = axes.plot([x], [y], linestyle="", marker=shape, markersize=6.2, zorder=4, **style)
        details = [("stimulus", str(row["stimulus"]))]
        details += [("label", str(row["label"]))] if row["label"] != row["stimulus"] else []
        details += [("class", str(row["class"]))] if row["class"] is not None else []
        details.append(("place", f"{format_number(x)}, {format_number(y)}"))
        marks.add(point, tuple(details), str(row["stimulus"]))


def _write_names(
    axes: Axes, points: Sequence[Row], corner: tuple[float, float], per_unit: float, taken: Sequence[Area]
) -> None:
    """Write the points' names; in a crowded map those without a free place only appear on pointing.

    `corner` is the lower left corner in the map's units, `per_unit` the length of a unit in points (1/72 inch).
    """
    size = 7.0 if len(points) <= 60 else 5.6
    names = [shorten(str(row["label"]), 22) for row in points]
    places = [((to_float(r["x"]) - corner[0]) * per_unit, (to_float(r["y"]) - corner[1]) * per_unit) for r in points]
    for row, name, spot in zip(points, names, place_beside_points(places, names, size, taken), strict=True):
        if spot.free or len(points) <= 12:
            _written(axes, name, (to_float(row["x"]), to_float(row["y"])), (spot.x, spot.y), size, INK, "normal")


def _rows_of(data: FigureData, shows: str) -> list[Row]:
    return [row for row in data.rows if row["shows"] == shows]


def _look_of(look: dict[str, tuple[str, str]], row: Row) -> tuple[str, str]:
    return look.get(str(row["class"]), (OKABE_ITO[0], "o"))


def _limits(data: FigureData) -> list[tuple[float, float]]:
    """Return the ends of both axes with room for ellipses, arrows and names; the ratio of sides is at least 0.55."""
    boxes = []
    for row in data.rows:
        if row["shows"] == "vector":
            continue
        x, y, wide, tall = to_float(row["x"]), to_float(row["y"]), 0.0, 0.0
        if row["shows"] == "ellipse":
            major, minor, angle = (to_float(row[name]) for name in ("semi_major", "semi_minor", "angle_deg"))
            turn = math.radians(angle)
            wide = math.hypot(major * math.cos(turn), minor * math.sin(turn))
            tall = math.hypot(major * math.sin(turn), minor * math.cos(turn))
        boxes.append((x - wide, x + wide, y - tall, y + tall))
    if _rows_of(data, "vector"):
        (x, y), radius = _ring(data)
        boxes.append((x - 1.12 * radius, x + 1.12 * radius, y - 1.12 * radius, y + 1.12 * radius))
    ends = [(min(b[k] for b in boxes), max(b[k + 1] for b in boxes)) for k in (0, 2)]
    longest = max(high - low for low, high in ends) or 1.0
    limits = []
    for low, high in ends:
        half = max(0.5 * (high - low) + 0.07 * longest, 0.3 * longest)
        limits.append(((low + high) / 2 - half, (low + high) / 2 + half))
    return limits


def _ring(data: FigureData) -> tuple[tuple[float, float], float]:
    """Return middle and radius of the circle of R = 1, around the points' mean, which most points lie within."""
    places = np.array([(to_float(row["x"]), to_float(row["y"])) for row in _rows_of(data, "point")])
    middle = places[0] + (places - places[0]).mean(axis=0)
    radius = float(np.quantile(np.hypot(*(places - middle).T), 0.9)) or 1.0
    return (float(middle[0]), float(middle[1])), radius


def _draw_arrows(
    axes: Axes, marks: Marks, data: FigureData, limits: Sequence[tuple[float, float]], per_unit: float
) -> list[Area]:
    """Draw the adjectives as arrows, each with its opposite word across the middle; return the areas of their names."""
    rows = [row for row in _rows_of(data, "vector") if row["x"] is not None and row["r2"] is not None]
    if not rows:
        return []
    middle, radius = _ring(data)
    axes.add_patch(Circle(middle, radius, fill=False, edgecolor=SOFT, linewidth=0.6, linestyle=(0, (1, 3)), zorder=1.2))
    corner = np.array([limits[0][0], limits[1][0]])
    places = [(np.array([to_float(r["x"]), to_float(r["y"])]) - corner) * per_unit for r in _rows_of(data, "point")]
    taken = [Area(x - 3.5, y - 3.5, x + 3.5, y + 3.5) for x, y in places]
    points = len(taken)
    for row in rows:
        reach = radius * math.sqrt(max(to_float(row["r2"]), 0.0))
        way = np.array([to_float(row["x"]), to_float(row["y"])])
        tip, tail = np.array(middle) + reach * way, np.array(middle) - reach * way
        sure = row["p"] is not None and to_float(row["p"]) < data.words["alpha"]
        colour = INK if sure else SOFT
        arrow: dict[str, Any] = {
            **{"arrowstyle": "-|>,head_length=0.5,head_width=0.22", "shrinkA": 0, "shrinkB": 0, "color": colour},
            **{"linewidth": 1.3 if sure else 0.9, "linestyle": "-" if sure else (0, (4, 2))},
        }
        drawn: Any = axes.annotate("", (float(tip[0]), float(tip[1])), middle, arrowprops=arrow, zorder=2)
        name = f"{row['attribute']} – {row['antonym']}" if row["antonym"] else str(row["attribute"])
        p = [] if row["p"] is None else [("p", format_p(to_float(row["p"])).removeprefix("p = ").removeprefix("p "))]
        details = (("attribute", name), ("R²", format_number(to_float(row["r2"]))), *p)
        marks.add(drawn.arrow_patch, details, str(row["attribute"]))
        axes.plot([middle[0], tail[0]], [middle[1], tail[1]], color=colour, linewidth=0.6, alpha=0.6, zorder=1.9)
        high, low = row["antonym"] or row["attribute"], row["attribute"] if row["antonym"] else ""
        for word, at, sign, weight in ((high, tip, 1, "bold"), (low, tail, -1, "normal")):
            taken += _draw_word(axes, str(word), at, sign * way, weight, colour, (limits, per_unit), taken)
    return taken[points:]


def _draw_word(
    axes: Axes,
    word: str,
    at: Any,
    way: Any,
    weight: str,
    colour: str,
    where: tuple[Sequence[tuple[float, float]], float],
    taken: Sequence[Area],
) -> list[Area]:
    """Write a word beyond the end of an arrow, moved outwards while it overlaps another."""
    if not word:
        return []
    (limits, per_unit), size = where, 8.5
    wide, tall = width_pt(word, size, weight), 1.1 * size
    place = (np.array(at) - [limits[0][0], limits[1][0]]) * per_unit
    for out in range(4, 60, 3):
        middle = place + way * (out + abs(way[0]) * wide / 2 + abs(way[1]) * tall / 2)
        area = Area(middle[0] - wide / 2, middle[1] - tall / 2, middle[0] + wide / 2, middle[1] + tall / 2)
        if not any(area.shared(other) for other in taken):
            break
    x, y = (middle - place).tolist()
    _written(axes, word, (float(at[0]), float(at[1])), (x, y), size, colour, weight)
    return [area]


def _written(
    axes: Axes, text: str, at: tuple[float, float], by: tuple[float, float], size: float, colour: str, weight: str
) -> None:
    halo = [withStroke(linewidth=2.2, foreground=PAPER)]
    axes.annotate(
        text, at, by, textcoords="offset points", ha="center", va="center_baseline", fontsize=size, color=colour,
        fontweight=weight, zorder=5, path_effects=halo,
    )  # fmt: skip


MAP = FigureKind(MapSettings, data, draw)
