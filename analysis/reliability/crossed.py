"""A long table to a matrix of rows (targets, cases, units) by columns (raters, items)."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.analysis.statistics.cells import (
    Aggregate,
    Coded,
    cell_means,
    check_columns,
    check_options,
    coded,
    name_list,
    numbers_of,
)
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadOption, DuplicatedCells, IncompleteCells, TooFew, listed, shown

Gaps: TypeAlias = Literal["raise", "drop_rows", "drop_columns", "keep"]
Codes: TypeAlias = NDArray[np.intp]
LARGEST = 50_000_000


@dataclass(frozen=True)
class Crossed:
    """One value per row and column, NaN if missing; labels are in natural order, independent of the order of rows.

    `dropped` are the rows or columns that were left out because of gaps, `values_per_cell` the fewest and most values
    that a cell is the mean of.
    """

    values: Floats
    rows: list[Hashable]
    columns: list[Hashable]
    dropped: list[Hashable]
    values_per_cell: tuple[int, int] = (1, 1)

    def attrs(self, rows: str, columns: str) -> dict[str, Any]:
        """Return the facts about the table that qualify a result."""
        facts: dict[str, Any] = {rows: len(self.rows), columns: len(self.columns), "dropped": self.dropped}
        return facts if self.values_per_cell == (1, 1) else facts | {"values_per_cell": self.values_per_cell}


def cross_table(
    data: pd.DataFrame,
    dv: Hashable,
    rows: Hashable | Iterable[Hashable],
    columns: Hashable,
    *,
    gaps: Gaps = "raise",
    aggregate: Aggregate = None,
) -> Crossed:
    """Return the matrix of a long table. Several names in `rows` give one row per combination that occurs.

    Raises UnknownColumn, BadValue, IncompleteCells, DuplicatedCells or BadOption.
    """
    check_options("raise", aggregate)
    if not isinstance(gaps, str) or gaps not in ("raise", "drop_rows", "drop_columns", "keep"):
        raise BadOption(f"missing={shown(gaps)} is unknown: 'raise', or leave out what has gaps")
    names = name_list(rows)
    if not names:
        raise BadOption("no column is named for the rows of the table; name one or several")
    check_columns(data, [dv, columns, *names])
    y, across, down = numbers_of(data[dv], dv), coded(data[columns], columns), combine_labels(data, names)
    where = (" and ".join(map(str, names)), str(columns))
    shape = (len(down.labels), len(across.labels))
    if math.prod(shape) > max(LARGEST, 16 * len(y)):
        raise IncompleteCells(
            f"{shape[0]:,} {where[0]} by {shape[1]:,} {where[1]} make {math.prod(shape):,} cells for {len(y):,} rows; "
            "check the columns"
        )
    flat = down.codes * shape[1] + across.codes
    count = np.bincount(flat, minlength=math.prod(shape))
    if count.max(initial=0) > 1 and aggregate is None:
        several = np.flatnonzero(count > 1)
        listing = listed((_place(int(at), down.labels, across.labels, where) for at in several), len(several))
        raise DuplicatedCells(f"several values at {listing}; pass aggregate='mean' to average them")
    values, count = cell_means(y, flat, count).reshape(shape), count.reshape(shape)
    if gaps != "keep" and np.isnan(values).any():
        return _without_gaps(values, count, (down.labels, across.labels), gaps, where)
    return Crossed(values, down.labels, across.labels, [], _range(count))


def combine_labels(data: pd.DataFrame, names: Sequence[Hashable]) -> Coded:
    """Return one code per combination of labels in these columns; several labels become a tuple."""
    parts = [coded(data[name], name) for name in names]
    if len(parts) == 1:
        return parts[0]
    flat = parts[0].codes
    for part in parts[1:]:
        _, flat = np.unique(flat, return_inverse=True)  # codes stay small, however many columns there are
        flat = flat * len(part.labels) + part.codes
    _, first, codes = np.unique(flat, return_index=True, return_inverse=True)
    labels = [tuple(part.labels[int(part.codes[at])] for part in parts) for at in first.tolist()]
    return Coded(codes.astype(np.intp), list(labels))


def refuse_few(table: Crossed, rows: str, columns: str, least: tuple[int, int] = (2, 2)) -> None:
    """Refuse a table with fewer rows or columns than a statistic needs."""
    kinds = ((rows, table.rows, least[0]), (columns, table.columns, least[1]))
    for what, labels, needed in kinds:
        if len(labels) < needed:
            left = f" ({len(table.dropped)} left out for missing values)" if table.dropped else ""
            named = f", {labels[0]!r}" if len(labels) == 1 else ""
            raise TooFew(f"too few {what}: {len(labels)}{named}{left}; at least {needed} are needed")


def _place(at: int, rows: list[Hashable], columns: list[Hashable], where: tuple[str, str]) -> str:
    row, column = divmod(at, len(columns))
    return f"{where[0]}={rows[row]!r}, {where[1]}={columns[column]!r}"


def _without_gaps(
    values: Floats, count: Codes, labels: tuple[list[Hashable], list[Hashable]], gaps: Gaps, where: tuple[str, str]
) -> Crossed:
    lost = np.isnan(values)
    if gaps == "raise":
        places = np.flatnonzero(lost)
        listing = listed((_place(int(at), *labels, where) for at in places), len(places))
        raise IncompleteCells(
            f"no value at {listing}; {len(places)} of {values.size} cells are missing; leave out what has gaps, or "
            "compare only those who share all"
        )
    axis = 0 if gaps == "drop_rows" else 1
    whole: NDArray[np.bool_] = np.logical_not(np.logical_or.reduce(lost, axis=1 - axis))
    if not whole.any():
        raise IncompleteCells(f"no {where[axis]} has a value in every cell; nothing is left")
    complete = [label for label, is_whole in zip(labels[axis], whole, strict=True) if is_whole]
    dropped = [label for label, is_whole in zip(labels[axis], whole, strict=True) if not is_whole]
    rows, columns = (complete, labels[1]) if axis == 0 else (labels[0], complete)
    return Crossed(np.compress(whole, values, axis), rows, columns, dropped, _range(np.compress(whole, count, axis)))


def _range(count: Codes) -> tuple[int, int]:
    filled = count[count > 0]
    return (int(filled.min()), int(filled.max())) if filled.size else (0, 0)
