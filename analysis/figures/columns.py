"""Reading the columns and answers of a figure as plain texts and numbers; missing ones are refused."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import pandas as pd

from palpate.analysis.plans.answers import Answer, Row, Selected, Value
from palpate.analysis.ratings.dataset import DataRefused, natural
from palpate.analysis.statistics.cells import numbers_of
from palpate.protocols.did_you_mean import nearest

if TYPE_CHECKING:
    from palpate.analysis.figures.figure_kind import FigureInput, FigureSettings


def require_columns(settings: FigureSettings, frame: pd.DataFrame, names: Iterable[str]) -> None:
    """Raise DataRefused unless the figure's columns are all present and its table has rows."""
    for name in names:
        if name not in frame.columns:
            raise DataRefused(f"figure {settings.name!r}: no column {name!r}; {nearest(name, map(str, frame.columns))}")
    if frame.empty:
        raise DataRefused(
            f"figure {settings.name!r}: no row is left to show; look at `where`, `outcomes` and exclusions"
        )


def read_numbers(frame: pd.DataFrame, name: str) -> list[float]:
    """Return a column's numbers, even from a table of text; NaN for missing ones. Raises BadValue."""
    column = frame[name]
    if column.dtype.kind not in "fiu":
        column = pd.Series([_parse(value) for value in column.tolist()], dtype=object)
    return [float(value) for value in numbers_of(column, name)]


def _parse(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    try:
        return float(value) if value.strip() else math.nan
    except ValueError:
        return value


def ordered_levels(selected: Selected, name: str, values: Iterable[str]) -> tuple[str, ...]:
    """Return the levels that occur, in the study's order, then the rest in natural order."""
    present = set(values)
    known = [level for level in selected.levels.get(name, ()) if level in present]
    return (*known, *natural(present - set(known)))


def bipolar_names(selected: Selected, attributes: Iterable[str]) -> dict[str, str]:
    """Return attributes as "low - high" names for figures, where the study has both words."""
    return {name: f"{name} – {selected.antonyms[name]}" for name in attributes if selected.antonyms.get(name)}


def find_answer(settings: FigureSettings, inputs: FigureInput, columns: Sequence[str], role: str) -> Answer:
    """Return the only answer, among the tests that the figure names, whose rows have these columns.

    Raises DataRefused unless there is exactly one.
    """
    answers = [
        answer
        for answer in (answer_of_test(settings, inputs, name) for name in settings.tests)
        if answer.rows and all(column in answer.rows[0] for column in columns)
    ]
    if len(answers) != 1:
        raise DataRefused(
            f"figure {settings.name!r}: `tests` must name one {role} (a test with the columns {', '.join(columns)});"
            f" among {', '.join(settings.tests) or 'no test'} there are {len(answers)}"
        )
    return answers[0]


def answer_of_test(settings: FigureSettings, inputs: FigureInput, name: str) -> Answer:
    """Return a test's only answer, else its answer for the figure's outcome. Raises DataRefused if there is none."""
    if name not in inputs.answers:
        raise DataRefused(f"figure {settings.name!r}: no test {name!r}; {nearest(name, inputs.answers)}")
    by_outcome = inputs.answers[name]
    if len(by_outcome) == 1:
        return next(iter(by_outcome.values()))
    for outcome in inputs.selected.outcomes if len(inputs.selected.outcomes) == 1 else ():
        if outcome in by_outcome:
            return by_outcome[outcome]
    raise DataRefused(
        f"figure {settings.name!r}: test {name!r} answers for {', '.join(by_outcome) or 'no outcome'};"
        " name the one to show in the figure's `outcomes`"
    )


def finite_or_nan(value: Value, where: str) -> float:
    """Return the number in a row, NaN if undefined. Raises DataRefused for anything else."""
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float) or math.isinf(value):
        raise DataRefused(f"{where}: {value!r} is not a finite number")
    return float(value)


def to_float(value: Value) -> float:
    """Return a number of a figure's own row. Raises TypeError if it is none."""
    if value is None or isinstance(value, str):
        raise TypeError(f"{value!r} where a figure's row has a number")
    return float(value)


def fill_columns(rows: Sequence[Mapping[str, Value]]) -> tuple[Row, ...]:
    """Return the rows with the same columns in all, None where a row has no value."""
    columns = list(dict.fromkeys(column for row in rows for column in row))
    return tuple({column: row.get(column) for column in columns} for row in rows)
