"""Tables of actual and predicted values, for three kinds of figure."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

from palpate.analysis.figures.columns import ordered_levels, read_numbers, require_columns
from palpate.analysis.figures.figure_kind import FigureSettings
from palpate.analysis.plans.answers import Selected
from palpate.analysis.ratings.dataset import DataRefused, natural_key
from palpate.analysis.ratings.person_cells import texts_of
from palpate.protocols.wording import count


class PredictionSettings(FigureSettings):
    """The columns of a table of predictions, which has one row for each stimulus and attribute.

    A named column must exist; the default column is used if the table has it.
    """

    actual: str = "actual"
    predicted: str = "predicted"
    stimulus: str = "stimulus"
    attribute: str = "attribute"


@dataclass(frozen=True)
class Prediction:
    """One prediction. `labels` has the levels of the requested columns, `more` numbers, NaN for missing ones."""

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
class Predictions:
    """The predictions in the order of their levels, and the number of rows without a value."""

    points: tuple[Prediction, ...]
    left_out: int

    def note(self) -> str:
        """Return the caption's note on rows that are not shown, else ""."""
        if not self.left_out:
            return ""
        return f" Not shown: {count(self.left_out, 'row')} without an actual or a predicted value."


def read_predictions(
    settings: PredictionSettings, selected: Selected, labels: Iterable[str], more: Iterable[str] = ()
) -> Predictions:
    """Return the rows with both values, sorted by their labels in the study's order, then by stimulus and values.

    Raises DataRefused where a column is missing or no row has both values.
    """
    frame, labels, more = selected.table, tuple(dict.fromkeys(labels)), tuple(dict.fromkeys(more))
    stimulus = chosen_column(settings, "stimulus", selected)
    columns = (settings.actual, settings.predicted, *([stimulus] if stimulus else []), *labels, *more)
    require_columns(settings, frame, columns)
    names = texts_of(frame, settings.stimulus) if settings.stimulus in frame.columns else [""] * len(frame)
    read = {name: texts_of(frame, name) for name in labels}
    numeric = {name: read_numbers(frame, name) for name in more}
    predictions = [
        Prediction(
            names[i],
            actual,
            predicted,
            {name: column[i] for name, column in read.items()},
            {name: column[i] for name, column in numeric.items()},
        )
        for i, (actual, predicted) in enumerate(
            zip(read_numbers(frame, settings.actual), read_numbers(frame, settings.predicted), strict=True)
        )
    ]
    known = [prediction for prediction in predictions if not math.isnan(prediction.error)]
    if not known:
        raise DataRefused(f"figure {settings.name!r}: no row has both an actual and a predicted value")
    ranks = {
        name: {level: i for i, level in enumerate(ordered_levels(selected, name, (p.labels[name] for p in known)))}
        for name in labels
    }

    def place(prediction: Prediction) -> tuple[object, ...]:
        levels = [ranks[name][prediction.labels[name]] for name in labels]
        return (*levels, natural_key(prediction.stimulus), prediction.actual, prediction.predicted)

    return Predictions(tuple(sorted(known, key=place)), len(predictions) - len(known))


def chosen_column(settings: FigureSettings, field_name: str, selected: Selected) -> str | None:
    """Return the column of a setting: the named one, or its usual name if the table has it, else None."""
    name = getattr(settings, field_name)
    if name is None or (field_name not in settings.model_fields_set and name not in selected.table.columns):
        return None
    return str(name)
