"""The columns and answers that a figure is made from, as plain texts and numbers; what lacks is refused by name."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import pandas as pd

from palpate.analysis.plans.answers import Answer, Row, Selected, Value
from palpate.analysis.ratings.dataset import DataRefused, natural
from palpate.analysis.statistics.columns import numbers_of
from palpate.protocols.did_you_mean import nearest

if TYPE_CHECKING:
    from palpate.analysis.figures.figure_kind import AskedFigure, Shown


def require(figure: AskedFigure, frame: pd.DataFrame, names: Iterable[str]) -> None:
    """Refuse a figure whose columns are not all there, or whose table is empty."""
    for name in names:
        if name not in frame.columns:
            raise DataRefused(f"figure {figure.name!r}: no column {name!r}; {nearest(name, map(str, frame.columns))}")
    if frame.empty:
        raise DataRefused(f"figure {figure.name!r}: no row is left to show; look at `where`, `outcomes` and exclusions")


def numbers(frame: pd.DataFrame, name: str) -> list[float]:
    """A column of numbers, also where a table of text holds them; NaN where there is none. Raises BadValue."""
    column = frame[name]
    if column.dtype.kind not in "fiu":
        column = pd.Series([_read(value) for value in column.tolist()], dtype=object)
    return [float(value) for value in numbers_of(column, name)]


def _read(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    try:
        return float(value) if value.strip() else math.nan
    except ValueError:
        return value


def in_order(selected: Selected, name: str, found: Iterable[str]) -> tuple[str, ...]:
    """The levels that occur: in the study's order, then the rest in natural order."""
    present = set(found)
    known = [level for level in selected.levels.get(name, ()) if level in present]
    return (*known, *natural(present - set(known)))


def pair_names(selected: Selected, attributes: Iterable[str]) -> dict[str, str]:
    """Attributes by both ends of their scales, as a figure writes them, where the study knows both."""
    return {each: f"{each} – {selected.antonyms[each]}" for each in attributes if selected.antonyms.get(each)}


def the_answer(figure: AskedFigure, shown: Shown, columns: Sequence[str], role: str) -> Answer:
    """The only answer, among the tests that the figure names, whose rows have these columns."""
    fit = [answer for name in figure.tests if (answer := _fitting(figure, shown, name, columns)) is not None]
    if len(fit) != 1:
        raise DataRefused(
            f"figure {figure.name!r}: `tests` must name one {role} (a test with the columns {', '.join(columns)});"
            f" among {', '.join(figure.tests) or 'no test'} there are {len(fit)}"
        )
    return fit[0]


def optional_answer(figure: AskedFigure, shown: Shown, columns: Sequence[str], role: str) -> Answer | None:
    """As `the_answer`, None where no test that the figure names fits."""
    fit = [name for name in figure.tests if _fitting(figure, shown, name, columns) is not None]
    return the_answer(figure, shown, columns, role) if fit else None


def _fitting(figure: AskedFigure, shown: Shown, name: str, columns: Sequence[str]) -> Answer | None:
    answer = answer_of(figure, shown, name)
    return answer if answer.rows and all(column in answer.rows[0] for column in columns) else None


def answer_of(figure: AskedFigure, shown: Shown, name: str) -> Answer:
    """The answer of one test: its only one, else that for the figure's own outcome."""
    if name not in shown.answers:
        raise DataRefused(f"figure {figure.name!r}: no test {name!r}; {nearest(name, shown.answers)}")
    by_outcome = shown.answers[name]
    if len(by_outcome) == 1:
        return next(iter(by_outcome.values()))
    for outcome in shown.selected.outcomes if len(shown.selected.outcomes) == 1 else ():
        if outcome in by_outcome:
            return by_outcome[outcome]
    raise DataRefused(
        f"figure {figure.name!r}: test {name!r} answers for {', '.join(by_outcome) or 'no outcome'};"
        " name the one to show in the figure's `outcomes`"
    )


def real(value: Value, where: str) -> float:
    """A number out of a row; NaN where it is undefined. Raises DataRefused for what is none."""
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float) or math.isinf(value):
        raise DataRefused(f"{where}: {value!r} is no finite number")
    return float(value)


def to_float(value: Value) -> float:
    """A number out of a figure's own row, where its data put one. Raises TypeError where there is none."""
    if value is None or isinstance(value, str):
        raise TypeError(f"{value!r} where a figure's row has a number")
    return float(value)


def uniform(rows: Sequence[Mapping[str, Value]]) -> tuple[Row, ...]:
    """Rows that all have the same columns, None where one has no value."""
    columns = list(dict.fromkeys(column for row in rows for column in row))
    return tuple({column: row.get(column) for column in columns} for row in rows)
