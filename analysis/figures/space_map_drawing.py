"""The drawing of a map of stimuli, from its table alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Ellipse
from matplotlib.patheffects import withStroke

from palpate.analysis.figures.drawn import Drawn, FigureData
from palpate.analysis.figures.lettering import folded, number, p_written, shortened, width_pt
from palpate.analysis.figures.map_names import Area, placed
from palpate.analysis.figures.marking import Marking
from palpate.analysis.figures.shades import looks, tint
from palpate.analysis.figures.shown_columns import to_float
from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, PAPER, SOFT
from palpate.analysis.plans.answers import Row

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
