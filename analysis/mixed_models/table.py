"""The columns that a model needs, complete and in an order that depends on their contents alone."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from palpate.analysis.statistics.cells import Missing, check_columns, check_options
from palpate.analysis.statistics.column_values import numbers_of
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.labels import coded
from palpate.analysis.statistics.refusals import BadValue, IncompleteCells, TooFew, listed


@dataclass(frozen=True)
class Table:
    """The rows that have a value, sorted by their contents; `dropped` counts those without one."""

    frame: pd.DataFrame
    y: Floats
    dropped: int


def read_table(
    data: pd.DataFrame, dv: Hashable, factors: Sequence[str], numbers: Sequence[str], missing: Missing
) -> Table:
    """The sorted table of one outcome and these columns.

    Raises UnknownColumn, BadValue, BadOption, IncompleteCells (rows without a value that `missing` does not allow) or
    TooFew (fewer than three rows).
    """
    check_options(missing, None)
    check_columns(data, [dv, *factors, *numbers])
    y = numbers_of(data[dv], dv)
    empty = np.isnan(y)
    if empty.any():
        _allow(dv, np.flatnonzero(empty).tolist(), missing)
    kept = data.loc[~empty, [*factors, *numbers]] if empty.any() else data[[*factors, *numbers]]
    y = y[~empty]
    if len(y) < 3:
        raise TooFew(f"{len(y)} rows have a value in column {dv!r}; a mixed model needs many more")
    order = np.lexsort(list(_keys(kept, y, factors, numbers)))
    return Table(kept.iloc[order].reset_index(drop=True), y[order], int(empty.sum()))


def _keys(kept: pd.DataFrame, y: Floats, factors: Sequence[str], numbers: Sequence[str]) -> Iterable[Any]:
    """What rows are sorted by, the last key first; rows that share all of them are the same in everything."""
    yield y
    yield from (numbers_of(kept[name], name) for name in numbers)
    yield from (coded(kept[name], name).codes for name in sorted(factors))


def _allow(dv: Hashable, rows: list[int], missing: Missing) -> None:
    if missing == "raise":
        where = listed((f"row {row + 1}" for row in rows), len(rows))
        raise IncompleteCells(
            f"column {dv!r} has no value in {where}; a mixed model needs no value for every cell: "
            "pass missing='listwise' to leave these rows out"
        )


def refuse_constant(y: Floats, dv: Hashable) -> None:
    """Refuse an outcome without variation."""
    if y.min() == y.max():
        raise BadValue(f"column {dv!r} has one value, {y[0]:g}, in every row; there is nothing to explain")
