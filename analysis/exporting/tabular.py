"""A table to be shared: its columns with their meaning, and its rows one after another."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from types import MappingProxyType
from typing import Literal

from palpate.analysis.reports.csv_files import demand_not_infinite, without_formula
from palpate.protocols.files import open_text

Kind = Literal["text", "number", "whole", "truth"]
Value = str | float | int | bool | None
Row = dict[str, Value]
_NO_LEVELS: Mapping[str, str] = MappingProxyType({})
NOT_AVAILABLE = "n/a"
"""BIDS's text for a missing value."""
_LARGEST = 2**53


class ExportRefused(ValueError):
    """The data cannot be exported as requested; the message says where, what is wrong and what to do."""


@dataclass(frozen=True)
class Column:
    """A column: its meaning, kind, unit and levels.

    A `key` column cannot be left out, since the table is meaningless without it. `free_answer` marks participants' free
    answers, in words or numbers. `low` and `high` are the least and the greatest possible value.
    """

    name: str
    description: str
    kind: Kind = "text"
    unit: str = ""
    levels: Mapping[str, str] = field(default_factory=lambda: _NO_LEVELS)
    key: bool = False
    free_answer: bool = False
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Table:
    """A table; `rows` generates its rows at every call, so that a large table is never in memory as a whole."""

    name: str
    description: str
    columns: tuple[Column, ...]
    rows: Callable[[], Iterable[Row]]

    def without(self, names: frozenset[str]) -> Table:
        """Return the table without the columns with these names; the rows may still have them."""
        return replace(self, columns=tuple(column for column in self.columns if column.name not in names))

    def renamed(self, names: Mapping[str, str]) -> Table:
        """Return the table with renamed columns."""
        columns = tuple(replace(column, name=names.get(column.name, column.name)) for column in self.columns)

        def rows() -> Iterator[Row]:
            for row in self.rows():
                yield {names.get(name, name): value for name, value in row.items()}

        return replace(self, columns=columns, rows=rows)


def cell_text(value: Value, missing: str = "") -> str:
    """Return the text of a value; `missing` for None."""
    if value is None or value == "":
        return missing
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        if not isfinite(value):
            return missing
        return str(int(value)) if value.is_integer() and abs(value) < _LARGEST else repr(value)
    return str(value)


def write_csv(path: Path, table: Table, rows: Iterable[Row]) -> int:
    """Write a comma-separated table (RFC 4180 with LF); return the number of rows. A missing value is an empty cell.

    A text that a spreadsheet would run as a formula is prefixed with an apostrophe.
    """
    names = [column.name for column in table.columns]
    with open_text(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        written = 0
        for row in rows:
            for name in names:
                if isinstance(number := row.get(name), float):
                    demand_not_infinite(name, number)
            writer.writerow([without_formula(cell_text(row.get(name))) for name in names])
            written += 1
        return written


def write_tsv(path: Path, table: Table, rows: Iterable[Row]) -> int:
    """Write a tab-separated table in BIDS's form; return the number of rows. A missing value is n/a.

    BIDS has no quotes: runs of blanks and line breaks in a participant's words become one blank, and words that a
    spreadsheet would run as a formula are prefixed with an apostrophe; elsewhere tabs, line breaks and the text n/a are
    refused.
    """
    with open_text(path) as file:
        file.write("\t".join(column.name for column in table.columns) + "\n")
        written = 0
        for line in tsv_lines(path.name, table, rows):
            file.write("\t".join(line) + "\n")
            written += 1
        return written


def tsv_lines(where: str, table: Table, rows: Iterable[Row]) -> Iterable[Sequence[str]]:
    """Yield the cells of each row in BIDS's form."""
    names = [(column.name, column.free_answer) for column in table.columns]
    for number, row in enumerate(rows, start=1):
        yield [_tsv_cell(where, number, name, row.get(name), free_answer) for name, free_answer in names]


def _tsv_cell(where: str, number: int, name: str, value: Value, free_answer: bool) -> str:
    if isinstance(value, float):
        demand_not_infinite(name, value)
    text = cell_text(value, NOT_AVAILABLE)
    if not isinstance(value, str):
        return text
    if free_answer:
        return without_formula(" ".join(text.split())) or NOT_AVAILABLE
    if value == NOT_AVAILABLE or any(letter in value for letter in "\t\r\n"):
        raise ExportRefused(
            f"{where}: row {number}, column {name!r}: {value!r:.60} cannot stand in a BIDS table (tabs, line breaks,"
            f" and n/a mean something else there); use --csv, or leave the column out with --without {name}"
        )
    return text
