"""A heat map of prediction errors by class and attribute, with numbers in the cells (thesis Figure 3.9)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from palpate.analysis.figures.columns import bipolar_names, ordered_levels, to_float
from palpate.analysis.figures.figure_kind import DrawnFigure, FigureData, FigureInput, FigureKind, Marks
from palpate.analysis.figures.lettering import decimals_for, fold, format_number, widest_pt
from palpate.analysis.figures.predictions import Prediction, PredictionSettings, read_predictions
from palpate.analysis.figures.style import FAINT, INK, PAPER, SOFT, readable_ink, shade_scale
from palpate.analysis.plans.answers import Row
from palpate.analysis.plans.idle import Idle
from palpate.protocols.wording import count

NAMES = {"MAE": "mean absolute error", "RMSE": "root mean square error"}
GAP = 0.22
"""The gap between cells and margins, in cells."""
MARGIN = "all"
FONT = 8.0


class ClassHeatmapSettings(PredictionSettings):
    """The settings of a heat map of errors by class (the column `by`) and attribute, from a table of predictions.

    `measure` is "MAE", the mean absolute error, or "RMSE", the root mean square error. `order` keeps the study's order
    of classes ("given") or puts the class with the largest error first ("error"). `unit` is written at the colours.
    """

    figure: Literal["class_heatmap"]
    by: str = "class"
    measure: Literal["MAE", "RMSE"] = "MAE"
    order: Literal["given", "error"] = "given"
    unit: str = ""

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        yield Idle("stimulus", "in cells, which hold all stimuli of a class")


def data(inputs: FigureInput, settings: ClassHeatmapSettings) -> FigureData:
    """Return a row for each cell, then the margins: each class over all attributes, each attribute over all classes.

    A margin (its `class` or `attribute` is None) is the error of all its predictions, not a mean of cells. Raises
    DataRefused where a column is missing.
    """
    predictions = read_predictions(settings, inputs.selected, (settings.by, settings.attribute))
    classes, attributes = (
        list(ordered_levels(inputs.selected, name, (point.labels[name] for point in predictions.points)))
        for name in (settings.by, settings.attribute)
    )
    if settings.order == "error":
        errors = {
            level: _error(settings, _predictions_in(settings, predictions.points, level, None)) for level in classes
        }
        classes = sorted(classes, key=lambda level: -errors[level])
    cells: list[tuple[str | None, str | None]] = [(level, attribute) for level in classes for attribute in attributes]
    margins = [*((level, None) for level in classes), *((None, attribute) for attribute in attributes), (None, None)]
    rows: list[dict[str, Any]] = []
    for level, attribute in (*cells, *margins):
        chosen = _predictions_in(settings, predictions.points, level, attribute)
        value = _error(settings, chosen) if chosen else None
        place = {"class": level, "attribute": attribute}
        rows.append({**place, "measure": settings.measure, "value": value, "n": len(chosen)})
    filled = tuple(row for row in rows if row["n"])
    words: dict[str, Any] = {
        "classes": classes,
        "attributes": attributes,
        "measure": settings.measure,
        "unit": settings.unit,
    }
    words["names"] = bipolar_names(inputs.selected, attributes)
    name = NAMES[settings.measure]
    title = settings.title or f"{name[0].upper()}{name[1:]} by {settings.by}"
    empty = len(rows) - len(filled)
    unit = f" ({settings.unit})" if settings.unit else ""
    hatched = f" Hatched: {count(empty, 'cell')} without a prediction." if empty else ""
    caption = (
        f"{settings.measure}, the {NAMES[settings.measure]} of the predictions{unit}, by {settings.by} and"
        f" {settings.attribute}; darker is larger. Apart: over all of a line or column, each prediction counting the"
        f" same.{hatched}"
    )
    return FigureData(filled, title, f"{caption}{predictions.note()}", words)


def _predictions_in(
    settings: ClassHeatmapSettings, predictions: tuple[Prediction, ...], level: str | None, attribute: str | None
) -> list[Prediction]:
    """Return the predictions of a cell; None selects every class or attribute."""
    levels = ((settings.by, level), (settings.attribute, attribute))
    return [
        prediction
        for prediction in predictions
        if all(level is None or prediction.labels[name] == level for name, level in levels)
    ]


def _error(settings: ClassHeatmapSettings, predictions: list[Prediction]) -> float:
    """Return MAE or RMSE; errors are divided by the largest first, so that no square overflows or underflows."""
    sizes = np.sort(np.abs([prediction.error for prediction in predictions]))
    largest = float(sizes[-1])
    if largest == 0.0:
        return 0.0
    shares = sizes / largest
    return largest * float(np.mean(shares) if settings.measure == "MAE" else np.sqrt(np.mean(shares**2)))


def draw(data: FigureData) -> DrawnFigure:
    """Draw a row for each class and a column for each attribute, with separate margins below and on the right."""
    classes, attributes = data.words["classes"], data.words["attributes"]
    digits = decimals_for(to_float(row["value"]) for row in data.rows)
    heads = [fold(data.words["names"].get(name, name), 14) for name in attributes]
    wide = max(widest_pt([*heads, format_number(9.0, digits)], FONT) / 72 + 0.16, 0.62)
    high = 0.3 if len(classes) <= 30 else 0.22
    left = widest_pt([fold(name, 34) for name in (*classes, MARGIN)], FONT) / 72 + 0.15
    size = (
        left + wide * (len(attributes) + 1 + GAP) + 1.0,
        high * (len(classes) + 1 + GAP) + 0.45 + 0.14 * max(head.count("\n") + 1 for head in heads),
    )
    figure = Figure(figsize=(max(size[0], 3.2), max(size[1], 1.7)), layout="constrained")
    axes, marks = figure.add_subplot(), Marks()
    largest = max((to_float(row["value"]) for row in data.rows if not _is_margin(row)), default=0.0)
    scale, colours = Normalize(0.0, largest or 1.0, clip=True), shade_scale()
    axes.set(xlim=(-0.5, len(attributes) + 0.5 + GAP), ylim=(len(classes) + 0.5 + GAP, -0.5))
    axes.set_xticks([*range(len(attributes)), len(attributes) + GAP], [*heads, MARGIN], fontsize=FONT)
    axes.set_yticks(
        [*range(len(classes)), len(classes) + GAP], [*(fold(c, 34) for c in classes), MARGIN], fontsize=FONT
    )
    axes.tick_params(top=False, labeltop=True, labelbottom=False, pad=3)
    for label in (axes.get_xticklabels()[-1], axes.get_yticklabels()[-1]):
        label.set(fontweight="bold")
    for spine in axes.spines.values():
        spine.set_visible(False)
    for row in data.rows:
        _draw_cell(axes, marks, data.words, row, digits, colours(0.9 * scale(to_float(row["value"]))))
    # Cells without a prediction are hatched.
    filled = {(row["class"], row["attribute"]) for row in data.rows}
    for y, level in enumerate(classes):
        for x, attribute in enumerate(attributes):
            if (level, attribute) not in filled:
                look: dict[str, Any] = {"facecolor": PAPER, "edgecolor": FAINT, "hatch": "////", "linewidth": 0}
                axes.add_patch(Rectangle((x - 0.47, y - 0.47), 0.94, 0.94, **look))
    colormap = LinearSegmentedColormap.from_list("shown", [colours(0.9 * i / 20) for i in range(21)])
    bar = figure.colorbar(ScalarMappable(scale, colormap), ax=axes, fraction=0.05, pad=0.03, aspect=22, shrink=0.9)
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=7.5, colors=SOFT)
    unit = f" ({data.words['unit']})" if data.words["unit"] else ""
    bar.set_label(f"{data.words['measure']}{unit}", fontsize=8, color=INK)
    return DrawnFigure(figure, marks.all())


def _is_margin(row: Row) -> bool:
    return row["class"] is None or row["attribute"] is None


def _draw_cell(axes: Axes, marks: Marks, words: Mapping[str, Any], row: Row, digits: int, fill: Any) -> None:
    attributes, classes = words["attributes"], words["classes"]
    x = float(len(attributes) + GAP if row["attribute"] is None else attributes.index(row["attribute"]))
    y = float(len(classes) + GAP if row["class"] is None else classes.index(row["class"]))
    patch = Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=fill, edgecolor=PAPER, linewidth=1.2)
    axes.add_patch(patch)
    details = (
        ("class", str(row["class"] or "all classes")),
        ("attribute", str(row["attribute"] or "all attributes")),
        (str(row["measure"]), format_number(to_float(row["value"]), digits + 1)),
        ("predictions", str(row["n"])),
    )
    marks.add(patch, details, str(row["class"] or ""))
    text = format_number(to_float(row["value"]), digits)
    weight = "bold" if _is_margin(row) else "normal"
    axes.text(x, y, text, ha="center", va="center", fontsize=FONT, color=readable_ink(fill), fontweight=weight)


CLASS_HEATMAP = FigureKind(ClassHeatmapSettings, data, draw, takes="table")
