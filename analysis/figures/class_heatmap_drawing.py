"""The drawing of a heatmap with numbers and margins, from its table alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from palpate.analysis.figures.drawn import Drawn, FigureData
from palpate.analysis.figures.lettering import decimals_for, folded, number, widest_pt
from palpate.analysis.figures.marking import Marking
from palpate.analysis.figures.shades import ink_on, ladder
from palpate.analysis.figures.shown_columns import to_float
from palpate.analysis.figures.style import FAINT, INK, PAPER, SOFT
from palpate.analysis.plans.answers import Row

GAP = 0.22
"""How far the margins stand from the cells, in cells."""
MARGIN = "all"
FONT = 8.0


def draw(shown: FigureData) -> Drawn:
    """A line for each class, a column for each attribute; the margins stand apart, below and at the right."""
    classes, attributes = shown.words["classes"], shown.words["attributes"]
    digits = decimals_for(to_float(row["value"]) for row in shown.rows)
    heads = [folded(shown.words["names"].get(each, each), 14) for each in attributes]
    wide = max(widest_pt([*heads, number(9.0, digits)], FONT) / 72 + 0.16, 0.62)
    high = 0.3 if len(classes) <= 30 else 0.22
    left = widest_pt([folded(each, 34) for each in (*classes, MARGIN)], FONT) / 72 + 0.15
    size = (
        left + wide * (len(attributes) + 1 + GAP) + 1.0,
        high * (len(classes) + 1 + GAP) + 0.45 + 0.14 * _lines(heads),
    )
    figure = Figure(figsize=(max(size[0], 3.2), max(size[1], 1.7)), layout="constrained")
    axes, marking = figure.add_subplot(), Marking()
    largest = max((to_float(row["value"]) for row in shown.rows if not _is_margin(row)), default=0.0)
    scale, colours = Normalize(0.0, largest or 1.0, clip=True), ladder()
    _grid(axes, shown.words, heads)
    for row in shown.rows:
        _cell(axes, marking, shown.words, row, digits, colours(0.9 * scale(to_float(row["value"]))))
    _empty(axes, shown)
    _key(figure, axes, shown.words, scale, colours)
    return Drawn(figure, marking.all())


def _lines(heads: Sequence[str]) -> int:
    return max(head.count("\n") + 1 for head in heads)


def _is_margin(row: Row) -> bool:
    return row["class"] is None or row["attribute"] is None


def _grid(axes: Axes, words: Mapping[str, Any], heads: Sequence[str]) -> None:
    classes, attributes = words["classes"], words["attributes"]
    axes.set(xlim=(-0.5, len(attributes) + 0.5 + GAP), ylim=(len(classes) + 0.5 + GAP, -0.5))
    axes.set_xticks([*range(len(attributes)), len(attributes) + GAP], [*heads, MARGIN], fontsize=FONT)
    axes.set_yticks(
        [*range(len(classes)), len(classes) + GAP], [*(folded(c, 34) for c in classes), MARGIN], fontsize=FONT
    )
    axes.tick_params(top=False, labeltop=True, labelbottom=False, pad=3)
    for label in (axes.get_xticklabels()[-1], axes.get_yticklabels()[-1]):
        label.set(fontweight="bold")
    for spine in axes.spines.values():
        spine.set_visible(False)


def _place(words: Mapping[str, Any], row: Row) -> tuple[float, float]:
    """The middle of a cell."""
    attributes, classes = words["attributes"], words["classes"]
    x = len(attributes) + GAP if row["attribute"] is None else attributes.index(row["attribute"])
    y = len(classes) + GAP if row["class"] is None else classes.index(row["class"])
    return float(x), float(y)


def _cell(axes: Axes, marking: Marking, words: Mapping[str, Any], row: Row, digits: int, fill: Any) -> None:
    x, y = _place(words, row)
    patch = Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=fill, edgecolor=PAPER, linewidth=1.2)
    axes.add_patch(patch)
    marking.add(patch, _told(row, digits), str(row["class"] or ""))
    text = number(to_float(row["value"]), digits)
    weight = "bold" if _is_margin(row) else "normal"
    axes.text(x, y, text, ha="center", va="center", fontsize=FONT, color=ink_on(fill), fontweight=weight)


def _told(row: Row, digits: int) -> tuple[tuple[str, str], ...]:
    value = number(to_float(row["value"]), digits + 1)
    places = (("class", row["class"] or "all classes"), ("attribute", row["attribute"] or "all attributes"))
    return (
        *((name, str(level)) for name, level in places),
        (str(row["measure"]), value),
        ("predictions", str(row["n"])),
    )


def _empty(axes: Axes, shown: FigureData) -> None:
    """What has no prediction is hatched."""
    filled = {(row["class"], row["attribute"]) for row in shown.rows}
    for y, level in enumerate(shown.words["classes"]):
        for x, attribute in enumerate(shown.words["attributes"]):
            if (level, attribute) not in filled:
                look: dict[str, Any] = {"facecolor": PAPER, "edgecolor": FAINT, "hatch": "////", "linewidth": 0}
                axes.add_patch(Rectangle((x - 0.47, y - 0.47), 0.94, 0.94, **look))


def _key(figure: Figure, axes: Axes, words: Mapping[str, Any], scale: Normalize, colours: Colormap) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap

    shown = LinearSegmentedColormap.from_list("shown", [colours(0.9 * i / 20) for i in range(21)])
    bar = figure.colorbar(ScalarMappable(scale, shown), ax=axes, fraction=0.05, pad=0.03, aspect=22, shrink=0.9)
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=7.5, colors=SOFT)
    unit = f" ({words['unit']})" if words["unit"] else ""
    bar.set_label(f"{words['measure']}{unit}", fontsize=8, color=INK)
