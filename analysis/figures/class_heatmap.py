"""The error of a prediction for each class and attribute, written in the cells (thesis Figure 3.9)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal

import numpy as np

from palpate.analysis.figures.class_heatmap_drawing import draw
from palpate.analysis.figures.drawn import FigureData, FigureKind, Shown
from palpate.analysis.figures.predictions import Point, PredictionSettings, read_points
from palpate.analysis.figures.shown_columns import in_order, pair_names
from palpate.analysis.plans.answers import Selected
from palpate.analysis.plans.idle import Idle
from palpate.protocols.wording import count

__all__ = ["CLASS_HEATMAP", "ClassHeatmapSettings", "data", "draw"]
NAMES = {"MAE": "mean absolute error", "RMSE": "root mean square error"}


class ClassHeatmapSettings(PredictionSettings):
    """The error by class (the column `by`) and attribute, from a table of predictions.

    `measure` is "MAE", the mean absolute error, or "RMSE", the root mean square error. `order` keeps the study's order
    of classes ("given") or puts the class with the largest error first ("error"). `unit` is written at the colours.
    """

    figure: Literal["class_heatmap"]
    by: str = "class"
    measure: Literal["MAE", "RMSE"] = "MAE"
    order: Literal["given", "error"] = "given"
    unit: str = ""

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that change nothing beside the others."""
        yield from super().idle()
        yield Idle("stimulus", "in cells, which hold all stimuli of a class")


def data(shown: Shown, settings: ClassHeatmapSettings) -> FigureData:
    """One row for each cell, then the margins: each class over all attributes, each attribute over all classes.

    A margin (its `class` or `attribute` is None) is the error of all its predictions, not a mean of cells. Raises
    DataRefused where a column is missing.
    """
    found = read_points(settings, shown.selected, (settings.by, settings.attribute))
    classes, attributes = (_levels(shown.selected, name, found.points) for name in (settings.by, settings.attribute))
    if settings.order == "error":
        errors = {each: _measured(settings, _of(settings, found.points, each, None)) for each in classes}
        classes = sorted(classes, key=lambda each: -errors[each])
    cells: list[tuple[str | None, str | None]] = [(each, attribute) for each in classes for attribute in attributes]
    margins = [*((each, None) for each in classes), *((None, attribute) for attribute in attributes), (None, None)]
    rows = [_row(settings, found.points, *place) for place in (*cells, *margins)]
    known = tuple(row for row in rows if row["n"])
    words: dict[str, Any] = {
        "classes": classes,
        "attributes": attributes,
        "measure": settings.measure,
        "unit": settings.unit,
    }
    words["names"] = pair_names(shown.selected, attributes)
    name = NAMES[settings.measure]
    title = settings.title or f"{name[0].upper()}{name[1:]} by {settings.by}"
    empty = len(rows) - len(known)
    return FigureData(known, title, f"{_caption(settings, empty)}{found.said()}", words)


def _levels(selected: Selected, name: str, points: tuple[Point, ...]) -> list[str]:
    return list(in_order(selected, name, (point.labels[name] for point in points)))


def _of(
    settings: ClassHeatmapSettings, points: tuple[Point, ...], level: str | None, attribute: str | None
) -> list[Point]:
    """The predictions of a cell; None stands for every class or attribute."""
    wanted = ((settings.by, level), (settings.attribute, attribute))
    return [point for point in points if all(each is None or point.labels[name] == each for name, each in wanted)]


def _row(
    settings: ClassHeatmapSettings, points: tuple[Point, ...], level: str | None, attribute: str | None
) -> dict[str, Any]:
    of = _of(settings, points, level, attribute)
    value = _measured(settings, of) if of else None
    return {"class": level, "attribute": attribute, "measure": settings.measure, "value": value, "n": len(of)}


def _measured(settings: ClassHeatmapSettings, points: list[Point]) -> float:
    """MAE or RMSE; errors are divided by the largest first, so that no square overflows or vanishes."""
    sizes = np.sort(np.abs([point.error for point in points]))
    largest = float(sizes[-1])
    if largest == 0.0:
        return 0.0
    shares = sizes / largest
    return largest * float(np.mean(shares) if settings.measure == "MAE" else np.sqrt(np.mean(shares**2)))


def _caption(settings: ClassHeatmapSettings, empty: int) -> str:
    unit = f" ({settings.unit})" if settings.unit else ""
    hatched = f" Hatched: {count(empty, 'cell')} without a prediction." if empty else ""
    return (
        f"{settings.measure}, the {NAMES[settings.measure]} of the predictions{unit}, by {settings.by} and"
        f" {settings.attribute}; darker is larger. Apart: over all of a line or column, each prediction counting the"
        f" same.{hatched}"
    )


CLASS_HEATMAP = FigureKind(ClassHeatmapSettings, data, draw, takes="table")
