"""A map of stimuli: near ones feel alike, ellipses show how sure a place is, arrows where an adjective grows."""

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

from palpate.analysis.figures.columns import answer_of, in_order, real, require, to_float, uniform
from palpate.analysis.figures.figure_kind import AskedFigure, Drawn, FigureData, FigureKind, Marking, Shown
from palpate.analysis.figures.label_places import Area, placed
from palpate.analysis.figures.lettering import folded, number, p_written, shortened, width_pt
from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, PAPER, SOFT, looks, tint
from palpate.analysis.plans.answers import Answer, Row, Selected
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.dataset import DataRefused, natural_key
from palpate.analysis.ratings.person_cells import texts_of
from palpate.protocols.undefined import nan_to_none
from palpate.protocols.wording import phrase

PLACES = ("dim", "dimension", "pc", "component")
DIRECTIONS = ("direction",)
NEAR = 1e-6


class MapSettings(AskedFigure):
    """The configuration of one test of `mds` (or `pca`) in two of its `dimensions`; `tests` may name `vectors` too.

    `over` and `items` are the tests' own: the columns that name a point and a vector.
    `class_column` gives each class of stimuli a colour and a shape: a column of the answer or of the stimuli.
    `label_column` writes another column than the stimulus at the points. `ellipses` and `vectors` say whether they are
    drawn where the tests have them.
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
        """Yield the settings that change nothing beside the others."""
        answer = "in a map, which shows the answer of its test as it is"
        yield from (Idle(name, answer) for name in ("outcomes", "normalise"))
        if self.class_column is None and self.label_column is None:
            yield from (Idle(name, answer) for name in ("where", "table", "source"))
        if self.dimensions != (1, 2):
            yield Idle("ellipses", "in other dimensions than 1 and 2, where none are drawn")
        if not self.vectors:
            yield Idle("items", "with `vectors: false`")


def data(shown: Shown, settings: MapSettings) -> FigureData:
    """Rows of three sorts (`shows`): each "point" with its class and place, each "ellipse", each "vector".

    A vector points to where the attribute's value grows, to the second word of its scale. Raises DataRefused where no
    named test has places, or a class is not one for each stimulus.
    """
    answer = _only(settings, shown, PLACES, settings.over)
    if answer is None:
        raise DataRefused(
            f"figure {settings.name!r}: `tests` must name a test whose rows have `{settings.over}` and the dimensions"
            f" {settings.dimensions[0]} and {settings.dimensions[1]} (mds, pca);"
            f" named: {', '.join(settings.tests) or 'none'}"
        )
    vectors = _only(settings, shown, DIRECTIONS, settings.items) if settings.vectors else None
    if settings.vectors and len(settings.tests) > 1 + (vectors is not None):
        raise DataRefused(
            f"figure {settings.name!r}: a map shows one test with places and one of vectors, whose rows have"
            f" `{settings.items}` and directions; named: {', '.join(settings.tests)}"
        )
    points = _points(settings, shown.selected, answer)
    if vectors is not None:
        _same_map(settings, points, vectors)
    rows = [*points, *_ellipses(settings, answer), *(_vectors(settings, shown.selected, vectors) if vectors else [])]
    classes = _class_order(settings, shown.selected, points)
    words: dict[str, Any] = {
        "classes": classes,
        "class_name": settings.class_column or "",
        "dimensions": list(settings.dimensions),
    }
    words["alpha"] = shown.selected.alpha
    found = uniform(rows)
    return FigureData(found, settings.title or "Map of the stimuli", _caption(shown, answer, found), words)


def _only(settings: MapSettings, shown: Shown, kinds: Sequence[str], label: str) -> Answer | None:
    """The one answer with a label and two coordinates; None where no test has them."""
    found = []
    for name in settings.tests:
        answer = answer_of(settings, shown, name)
        if (
            answer.rows
            and label in answer.rows[0]
            and all(_column(answer.rows[0], kinds, k) for k in settings.dimensions)
        ):
            found.append(name)
    if len(found) > 1:
        raise DataRefused(f"figure {settings.name!r}: {phrase(found)} would be drawn in one place; name one of them")
    return answer_of(settings, shown, found[0]) if found else None


def _column(row: Row, kinds: Sequence[str], dimension: int) -> str | None:
    """The column of a dimension, however it is written: dim1, Dim_1, dimension 1."""
    wanted = {f"{kind}{dimension}" for kind in kinds}
    return next((name for name in row if re.sub(r"[^a-z0-9]", "", name.lower()) in wanted), None)


def _coordinates(settings: MapSettings, row: Row, kinds: Sequence[str]) -> tuple[float, float]:
    names = [_column(row, kinds, dimension) for dimension in settings.dimensions]
    x, y = (real(row[str(name)], f"figure {settings.name!r}") for name in names)
    return x, y


def _points(settings: MapSettings, selected: Selected, answer: Answer) -> list[dict[str, Any]]:
    classes = _per_stimulus(settings, selected, answer, settings.class_column)
    labels = _per_stimulus(settings, selected, answer, settings.label_column)
    order = {
        name: i
        for i, name in enumerate(in_order(selected, settings.over, (str(r[settings.over]) for r in answer.rows)))
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


def _same_map(settings: MapSettings, points: list[dict[str, Any]], vectors: Answer) -> None:
    """Refuse vectors that were fitted to another configuration: they would point nowhere in this one."""
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
            f"figure {settings.name!r}: its vectors were fitted to another map than it shows ({phrase(apart[:3])} lie"
            " elsewhere); give the test of vectors the `on` and the other settings of the map's test"
        )


def _per_stimulus(settings: MapSettings, selected: Selected, answer: Answer, column: str | None) -> dict[str, str]:
    """What a column says of each stimulus: from the answer's own rows, else from the study's."""
    if column is None:
        return {}
    if column in answer.rows[0]:
        return {str(row[settings.over]): str(row[column]) for row in answer.rows}
    frame = selected.table if column in selected.table.columns else selected.trials
    require(settings, frame, [settings.over, column])
    pairs = set(zip(texts_of(frame, settings.over), texts_of(frame, column), strict=True))
    found = dict(pairs)
    if len(found) < len(pairs):
        twice = sorted({name for name, level in pairs if found[name] != level}, key=natural_key)
        raise DataRefused(f"figure {settings.name!r}: column {column!r} has several levels for {phrase(twice[:5])}")
    return found


def _class_order(settings: MapSettings, selected: Selected, points: list[dict[str, Any]]) -> list[str]:
    found = {str(point["class"]) for point in points if point["class"] is not None}
    return list(in_order(selected, settings.class_column or "", found))


def _ellipses(settings: MapSettings, answer: Answer) -> list[dict[str, Any]]:
    """Only a map in the dimensions that the ellipses were made in can show them."""
    if not settings.ellipses or settings.dimensions != (1, 2):
        return []
    found = []
    for row in answer.more.get("ellipses", ()):
        where = f"figure {settings.name!r}, ellipse of {row[settings.over]!r}"
        x, y = (real(row[name], where) for name in ("centre_1", "centre_2"))
        major, minor, angle = (real(row[name], where) for name in ("semi_major", "semi_minor", "angle_deg"))
        if not any(math.isnan(part) for part in (x, y, major, minor, angle)):
            sizes = {"semi_major": major, "semi_minor": minor, "angle_deg": angle}
            found.append({"shows": "ellipse", "stimulus": str(row[settings.over]), "x": x, "y": y, **sizes})
    return sorted(found, key=lambda row: natural_key(str(row["stimulus"])))


def _vectors(settings: MapSettings, selected: Selected, answer: Answer) -> list[dict[str, Any]]:
    order = {
        name: i
        for i, name in enumerate(in_order(selected, settings.items, (str(r[settings.items]) for r in answer.rows)))
    }
    found = []
    for row in sorted(answer.rows, key=lambda row: order[str(row[settings.items])]):
        name, (x, y) = str(row[settings.items]), _coordinates(settings, row, DIRECTIONS)
        where = f"figure {settings.name!r}, vector {name!r}"
        r2, p = real(row["r2"], where), real(row.get("p"), where)
        antonym = str(row.get("antonym") or selected.antonyms.get(name, ""))
        numbers = {"x": nan_to_none(x), "y": nan_to_none(y), "r2": nan_to_none(r2), "p": nan_to_none(p)}
        found.append({"shows": "vector", "attribute": name, "antonym": antonym, **numbers})
    return found


def _caption(shown: Shown, answer: Answer, rows: Sequence[Row]) -> str:
    kinds = {str(row["shows"]) for row in rows}
    parts = [answer.method.rstrip(".") + ".", *([answer.headline.rstrip(".") + "."] if answer.headline else [])]
    parts.append("Both axes have one scale; their directions and signs mean nothing by themselves.")
    if "ellipse" in kinds:
        told = [note for note in answer.notes if note.lower().startswith("ellipses: ")]
        where = told[0][len("ellipses: ") :].rstrip(".") if told else "as the test resampled it"
        parts.append(f"Ellipses: where a stimulus may lie ({where}).")
    if "vector" in kinds:
        parts.append(
            "Arrows: where an attribute's value grows, towards the second word of its scale; as long as its multiple"
            f" correlation R with the map, the ring being R = 1; dashed: p not below {shown.selected.alpha:g}."
        )
        undefined = [
            str(row["attribute"])
            for row in rows
            if row["shows"] == "vector" and (row["x"] is None or row["r2"] is None)
        ]
        parts += [f"Without a direction: {phrase(undefined)}."] if undefined else []
    return " ".join(parts)


MAP_IN = 6.3
"""The longer side of the map."""


def draw(shown: FigureData) -> Drawn:
    """Ellipses below, then arrows, then points with their names; the classes' colours and shapes at the right."""
    limits = _limits(shown)
    spans = [high - low for low, high in limits]
    per_unit = MAP_IN / max(spans)
    classes = shown.words["classes"]
    legend_in = 0.5 + 0.075 * max((min(len(c), 26) for c in classes), default=-6)
    figure = Figure(figsize=(spans[0] * per_unit + 0.75 + legend_in, spans[1] * per_unit + 0.65), layout="constrained")
    axes, marking = figure.add_subplot(), Marking()
    axes.set(xlim=limits[0], ylim=limits[1], aspect="equal")
    _frame(axes, shown)
    look = dict(zip(classes, looks(len(classes)), strict=True))
    points = _of(shown, "point")
    colours = {str(row["stimulus"]): _look(look, row)[0] for row in points}
    for row in _of(shown, "ellipse"):
        _ellipse(axes, row, colours.get(str(row["stimulus"]), SOFT))
    taken = _arrows(axes, marking, shown, limits, per_unit * 72)
    for row in points:
        _point(axes, marking, row, *_look(look, row))
    _names(axes, points, limits, per_unit * 72, taken)
    if classes:
        _legend(figure, look, str(shown.words["class_name"]))
    return Drawn(figure, marking.all())


def _of(shown: FigureData, shows: str) -> list[Row]:
    return [row for row in shown.rows if row["shows"] == shows]


def _look(look: dict[str, tuple[str, str]], row: Row) -> tuple[str, str]:
    return look.get(str(row["class"]), (OKABE_ITO[0], "o"))


def _limits(shown: FigureData) -> list[tuple[float, float]]:
    """Both axes with room for ellipses, arrows and names; the shorter one at least 0.55 of the longer."""
    boxes = [_reach(row) for row in shown.rows if row["shows"] != "vector"]
    if _of(shown, "vector"):
        (x, y), radius = _ring(shown)
        boxes.append((x - 1.12 * radius, x + 1.12 * radius, y - 1.12 * radius, y + 1.12 * radius))
    ends = [(min(b[k] for b in boxes), max(b[k + 1] for b in boxes)) for k in (0, 2)]
    longest = max(high - low for low, high in ends) or 1.0
    found = []
    for low, high in ends:
        half = max(0.5 * (high - low) + 0.07 * longest, 0.3 * longest)
        found.append(((low + high) / 2 - half, (low + high) / 2 + half))
    return found


def _reach(row: Row) -> tuple[float, float, float, float]:
    """How far a point or an ellipse reaches along both axes."""
    x, y = to_float(row["x"]), to_float(row["y"])
    if row["shows"] == "point":
        return x, x, y, y
    major, minor, angle = (to_float(row[name]) for name in ("semi_major", "semi_minor", "angle_deg"))
    turn = math.radians(angle)
    wide = math.hypot(major * math.cos(turn), minor * math.sin(turn))
    tall = math.hypot(major * math.sin(turn), minor * math.cos(turn))
    return x - wide, x + wide, y - tall, y + tall


def _ring(shown: FigureData) -> tuple[tuple[float, float], float]:
    """Middle and radius of the ring of R = 1: about the points' mean, as far as most of them."""
    places = np.array([(to_float(row["x"]), to_float(row["y"])) for row in _of(shown, "point")])
    middle = places[0] + (places - places[0]).mean(axis=0)
    radius = float(np.quantile(np.hypot(*(places - middle).T), 0.9)) or 1.0
    return (float(middle[0]), float(middle[1])), radius


def _frame(axes: Axes, shown: FigureData) -> None:
    axes.grid(visible=True, color=FAINT, linewidth=0.4)
    for spine in axes.spines.values():
        spine.set(visible=True, color=FAINT)
    axes.tick_params(labelsize=7.5, labelcolor=SOFT)
    axes.locator_params(nbins=7)
    first, second = shown.words["dimensions"]
    axes.set_xlabel(f"dimension {first}", color=SOFT)
    axes.set_ylabel(f"dimension {second}", color=SOFT)


def _ellipse(axes: Axes, row: Row, colour: str) -> None:
    sides = 2 * to_float(row["semi_major"]), 2 * to_float(row["semi_minor"])
    place = (to_float(row["x"]), to_float(row["y"]))
    fill = Ellipse(place, *sides, angle=to_float(row["angle_deg"]), facecolor=colour, alpha=0.10, linewidth=0, zorder=1)
    edge = Ellipse(
        place,
        *sides,
        angle=to_float(row["angle_deg"]),
        fill=False,
        edgecolor=tint(colour, 0.6),
        linewidth=0.6,
        zorder=1.1,
    )
    axes.add_patch(fill)
    axes.add_patch(edge)


def _arrows(
    axes: Axes, marking: Marking, shown: FigureData, limits: Sequence[tuple[float, float]], per_unit: float
) -> list[Area]:
    """The adjectives, each with its other end across the middle; gives the areas of their names."""
    rows = [row for row in _of(shown, "vector") if row["x"] is not None and row["r2"] is not None]
    if not rows:
        return []
    middle, radius = _ring(shown)
    axes.add_patch(Circle(middle, radius, fill=False, edgecolor=SOFT, linewidth=0.6, linestyle=(0, (1, 3)), zorder=1.2))
    corner = np.array([limits[0][0], limits[1][0]])
    places = [(np.array([to_float(r["x"]), to_float(r["y"])]) - corner) * per_unit for r in _of(shown, "point")]
    taken = [Area(x - 3.5, y - 3.5, x + 3.5, y + 3.5) for x, y in places]
    points = len(taken)
    for row in rows:
        reach = radius * math.sqrt(max(to_float(row["r2"]), 0.0))
        way = np.array([to_float(row["x"]), to_float(row["y"])])
        tip, tail = np.array(middle) + reach * way, np.array(middle) - reach * way
        sure = row["p"] is not None and to_float(row["p"]) < shown.words["alpha"]
        style: dict[str, Any] = {"color": INK if sure else SOFT, "linewidth": 1.3 if sure else 0.9}
        arrow: dict[str, Any] = {
            "arrowstyle": "-|>,head_length=0.5,head_width=0.22",
            "shrinkA": 0,
            "shrinkB": 0,
            **style,
        }
        drawn: Any = axes.annotate(
            "",
            (float(tip[0]), float(tip[1])),
            middle,
            arrowprops={**arrow, "linestyle": "-" if sure else (0, (4, 2))},
            zorder=2,
        )
        marking.add(drawn.arrow_patch, _told_vector(row), str(row["attribute"]))
        axes.plot(
            [middle[0], tail[0]], [middle[1], tail[1]], color=style["color"], linewidth=0.6, alpha=0.6, zorder=1.9
        )
        high, low = row["antonym"] or row["attribute"], row["attribute"] if row["antonym"] else ""
        for word, at, sign, weight in ((high, tip, 1, "bold"), (low, tail, -1, "normal")):
            taken += _word(axes, str(word), at, sign * way, weight, style["color"], (limits, per_unit), taken)
    return taken[points:]


def _word(
    axes: Axes,
    word: str,
    at: Any,
    way: Any,
    weight: str,
    colour: str,
    where: tuple[Sequence[tuple[float, float]], float],
    taken: Sequence[Area],
) -> list[Area]:
    """A word beyond the end of an arrow, moved outwards while it lies on another."""
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


def _point(axes: Axes, marking: Marking, row: Row, colour: str, shape: str) -> None:
    look: dict[str, Any] = {
        "markersize": 6.2,
        "markerfacecolor": colour,
        "markeredgecolor": PAPER,
        "markeredgewidth": 0.7,
    }
    (point,) = axes.plot([to_float(row["x"])], [to_float(row["y"])], linestyle="", marker=shape, zorder=4, **look)
    names = [("stimulus", str(row["stimulus"]))]
    names += [("label", str(row["label"]))] if row["label"] != row["stimulus"] else []
    names += [("class", str(row["class"]))] if row["class"] is not None else []
    places = [("place", f"{number(to_float(row['x']))}, {number(to_float(row['y']))}")]
    marking.add(point, (*names, *places), str(row["stimulus"]))


def _told_vector(row: Row) -> tuple[tuple[str, str], ...]:
    name = f"{row['attribute']} – {row['antonym']}" if row["antonym"] else str(row["attribute"])
    p = [] if row["p"] is None else [("p", p_written(to_float(row["p"])).removeprefix("p = ").removeprefix("p "))]
    return (("attribute", name), ("R²", number(to_float(row["r2"]))), *p)


def _names(
    axes: Axes, points: Sequence[Row], limits: Sequence[tuple[float, float]], per_unit: float, taken: Sequence[Area]
) -> None:
    """The points' names; in a crowded map those without a free place are told on pointing only."""
    size = 7.0 if len(points) <= 60 else 5.6
    names = [shortened(str(row["label"]), 22) for row in points]
    places = [
        ((to_float(r["x"]) - limits[0][0]) * per_unit, (to_float(r["y"]) - limits[1][0]) * per_unit) for r in points
    ]
    for row, name, spot in zip(points, names, placed(places, names, size, taken), strict=True):
        if spot.free or len(points) <= 12:
            _written(axes, name, (to_float(row["x"]), to_float(row["y"])), (spot.x, spot.y), size, INK, "normal")


def _legend(figure: Figure, look: dict[str, tuple[str, str]], name: str) -> None:
    handles = [
        Line2D(
            [], [], linestyle="", marker=shape, markersize=6.2, color=colour, markeredgecolor=PAPER, markeredgewidth=0.5
        )
        for colour, shape in look.values()
    ]
    figure.legend(
        handles, [folded(level, 26) for level in look], title=name, loc="outside right upper", frameon=False,
        fontsize=8 if len(look) <= 24 else 6, labelcolor=INK, handletextpad=0.2, alignment="left",
    )  # fmt: skip


MAP = FigureKind(MapSettings, data, draw)
