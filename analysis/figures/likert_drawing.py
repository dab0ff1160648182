"""The drawing of answers on points as boxes, from their table alone; bars have a page of their own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from palpate.analysis.figures.drawn import Drawn, FigureData
from palpate.analysis.figures.lettering import folded, number
from palpate.analysis.figures.likert_bars import draw_bars
from palpate.analysis.figures.marking import MOST, Marking
from palpate.analysis.figures.shown_columns import to_float
from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, PAPER, SOFT
from palpate.analysis.plans.answers import Row

WIDE_IN = 7.2
BOX = "#dfeaf3"


def draw(shown: FigureData) -> Drawn:
    """As the table's settings said: boxes or diverging bars."""
    return draw_bars(shown) if shown.words["style"] == "bars" else _boxes(shown)


def _boxes(shown: FigureData) -> Drawn:
    """A row for each item: box, dots and mean over one axis of points."""
    items = shown.words["items"]
    tall = 0.62 if len(items) <= 12 else 0.42
    figure = Figure(figsize=(WIDE_IN, tall * len(items) + 0.85), layout="constrained")
    axes, marking = figure.add_subplot(), Marking()
    low, high = shown.words["low"], shown.words["high"]
    axes.set(xlim=(low - 0.4, high + 0.4), ylim=(len(items) - 0.45, -0.6))
    marked = sum(row["shows"] == "answer" for row in shown.rows) <= MOST
    for place, item in enumerate(items):
        told = next(row for row in shown.rows if row["shows"] == "item" and row["item"] == item)
        answers = [row for row in shown.rows if row["shows"] == "answer" and row["item"] == item]
        _box(axes, told, place)
        _dots(axes, marking, answers, place, marked)
        _mean(axes, marking, told, place)
    _frame(axes, shown, items)
    return Drawn(figure, marking.all())


def _box(axes: Axes, told: Row, place: int) -> None:
    """Above the row's middle, so that the dots have the room below."""
    q1, middle, q3 = (to_float(told[name]) for name in ("q1", "median", "q3"))
    y, half = place - 0.12, 0.17
    axes.plot(
        [to_float(told["whisker_low"]), to_float(told["whisker_high"])], [y, y], color=SOFT, linewidth=1.0, zorder=2
    )
    for end in ("whisker_low", "whisker_high"):
        at = to_float(told[end])
        axes.plot([at, at], [y - half / 2, y + half / 2], color=SOFT, linewidth=1.0, zorder=2)
    axes.add_patch(Rectangle((q1, y - half), q3 - q1, 2 * half, facecolor=BOX, edgecolor=SOFT, linewidth=1.0, zorder=3))
    axes.plot([middle, middle], [y - half, y + half], color=INK, linewidth=2.4, zorder=4, solid_capstyle="butt")


def _dots(axes: Axes, marking: Marking, rows: Sequence[Row], place: int, marked: bool) -> None:
    """Equal answers lie side by side along the axis, in lines under the box."""
    values = [to_float(row["value"]) for row in rows]
    look: dict[str, Any] = {
        "linestyle": "",
        "marker": "o",
        "markersize": 4.2,
        "markeredgewidth": 0.4,
        "markeredgecolor": PAPER,
    }
    for row, (x, down) in zip(rows, _laid(values), strict=True):
        (dot,) = axes.plot([x], [place + 0.15 + down], color=OKABE_ITO[0], zorder=5, **look)
        if marked:
            value = number(to_float(row["value"]), 1).removesuffix(".0")
            marking.add(
                dot, (("participant", str(row["participant"])), (str(row["item"]), value)), str(row["participant"])
            )


def _laid(values: Sequence[float]) -> list[tuple[float, float]]:
    """Places of equal answers: in rows of up to nine, centred on the answer, pressed together where they are many."""
    most = max(map(list(values).count, values), default=1)
    abreast, lines = 9, -(-most // 9)
    step, down = 0.078, min(0.1, 0.22 / max(lines - 1, 1))
    seen: dict[float, int] = {}
    places = []
    for value in values:
        i = seen[value] = seen.get(value, -1) + 1
        count = min(abreast, list(values).count(value) - i // abreast * abreast)
        places.append((value + step * (i % abreast - (count - 1) / 2), i // abreast * down))
    return places


def _mean(axes: Axes, marking: Marking, told: Row, place: int) -> None:
    mean = to_float(told["mean"])
    look: dict[str, Any] = {
        "markerfacecolor": OKABE_ITO[1],
        "markeredgecolor": PAPER,
        "markeredgewidth": 0.9,
        "markersize": 7,
    }
    (mark,) = axes.plot([mean], [place - 0.12], marker="D", linestyle="", zorder=6, **look)
    names = {"mean": "mean", "sd": "SD", "median": "median"}
    parts = [(name, number(to_float(told[of]))) for of, name in names.items() if told[of] is not None]
    marking.add(mark, (("item", str(told["item"])), *parts, ("n", str(told["n"]))), str(told["item"]))
    spread = "" if told["sd"] is None else f" ± {number(to_float(told['sd']))}"
    place_of = axes.get_yaxis_transform()
    axes.text(1.01, place - 0.1, number(mean), transform=place_of, va="center", fontsize=9, fontweight="bold")
    axes.text(1.075, place - 0.1, spread, transform=place_of, va="center", fontsize=8, color=SOFT)


def _frame(axes: Axes, shown: FigureData, items: Sequence[str]) -> None:
    low, high = shown.words["low"], shown.words["high"]
    axes.set_yticks([i - 0.05 for i in range(len(items))], [written(shown, item) for item in items], fontsize=9)
    axes.set_xticks(range(low, high + 1))
    axes.grid(visible=True, axis="x", color=FAINT)
    axes.axvline((low + high) / 2, color=SOFT, linewidth=0.8, zorder=0.6)
    for side in ("left", "bottom"):
        axes.spines[side].set_visible(False)
    axes.text(1.01, -0.62, "mean ± SD", transform=axes.get_yaxis_transform(), va="bottom", fontsize=7.5, color=SOFT)
    for at, word, ha in ((low, shown.words["ends"][0], "left"), (high, shown.words["ends"][1], "right")):
        place = (at - 0.1 if ha == "left" else at + 0.1, 0)
        axes.annotate(
            folded(word, 30),
            place,
            (0, -20),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            ha=ha,
            va="top",
            fontsize=8.5,
            color=SOFT,
        )


def written(shown: FigureData, item: str) -> str:
    """An item's name as the drawing writes it."""
    return folded(item.replace("_", " "), int(shown.words["letters"]))
