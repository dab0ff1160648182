"""A table of actual and predicted values, as three figures read it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import pandas as pd

from palpate.analysis.figures.columns import in_order, numbers, require
from palpate.analysis.figures.figure_kind import AskedFigure
from palpate.analysis.plans.answers import Selected
from palpate.analysis.ratings.dataset import DataRefused, natural_key
from palpate.analysis.ratings.person_cells import texts_of
from palpate.protocols.wording import count


class PredictionSettings(AskedFigure):
    """The columns of a table of predictions: one row for each stimulus and attribute.

    A column that is named must be there; one that is not named is read where the table has it.
    """

    actual: str = "actual"
    predicted: str = "predicted"
    stimulus: str = "stimulus"
    attribute: str = "attribute"


@dataclass(frozen=True)
class Point:
    """One prediction. `labels` holds the levels of the columns asked for, `more` numbers, NaN where there is none."""

    stimulus: str
    actual: float
    predicted: float
    labels: dict[str, str] = field(default_factory=dict)
    more: dict[str, float] = field(default_factory=dict)

    @property
    def error(self) -> float:
        """Predicted minus actual."""
        return self.predicted - self.actual


@dataclass(frozen=True)
class Points:
    """The predictions in the order of their levels, and how many rows had no value."""

    points: tuple[Point, ...]
    left_out: int

    def said(self) -> str:
        """The rows that are not shown, as a caption says it."""
        if not self.left_out:
            return ""
        return f" Not shown: {count(self.left_out, 'row')} without an actual or a predicted value."


def read_points(
    settings: PredictionSettings, selected: Selected, labels: Iterable[str], more: Iterable[str] = ()
) -> Points:
    """The rows with both values, sorted by their labels in the study's order, then by stimulus and values.

    Raises DataRefused where a column is missing or no row has both values.
    """
    frame, labels, more = selected.table, tuple(dict.fromkeys(labels)), tuple(dict.fromkeys(more))
    stimulus = chosen(settings, "stimulus", selected)
    named = (settings.actual, settings.predicted, *([stimulus] if stimulus else []), *labels, *more)
    require(settings, frame, named)
    points = _points(settings, frame, labels, more)
    known = [each for each in points if not math.isnan(each.error)]
    if not known:
        raise DataRefused(f"figure {settings.name!r}: no row has both an actual and a predicted value")
    ranks = {name: _ranks(selected, name, (each.labels[name] for each in known)) for name in labels}

    def place(point: Point) -> tuple[object, ...]:
        levels = [ranks[name][point.labels[name]] for name in labels]
        return (*levels, natural_key(point.stimulus), point.actual, point.predicted)

    return Points(tuple(sorted(known, key=place)), len(points) - len(known))


def _ranks(selected: Selected, name: str, found: Iterable[str]) -> dict[str, int]:
    return {level: i for i, level in enumerate(in_order(selected, name, found))}


def _points(
    settings: PredictionSettings, frame: pd.DataFrame, labels: tuple[str, ...], more: tuple[str, ...]
) -> list[Point]:
    names = texts_of(frame, settings.stimulus) if settings.stimulus in frame.columns else [""] * len(frame)
    read = {name: texts_of(frame, name) for name in labels}
    numeric = {name: numbers(frame, name) for name in more}
    return [
        Point(
            names[i],
            actual,
            predicted,
            {name: column[i] for name, column in read.items()},
            {name: column[i] for name, column in numeric.items()},
        )
        for i, (actual, predicted) in enumerate(
            zip(numbers(frame, settings.actual), numbers(frame, settings.predicted), strict=True)
        )
    ]


def chosen(settings: AskedFigure, field_name: str, selected: Selected) -> str | None:
    """The column of that setting: as named, or by its usual name where the table has it, else None."""
    name = getattr(settings, field_name)
    if name is None or (field_name not in settings.model_fields_set and name not in selected.table.columns):
        return None
    return str(name)
