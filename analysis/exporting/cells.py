"""A value as the text of a cell: the shortest that reads back as the same value."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from math import isfinite
from pathlib import Path
from typing import IO

from palpate.analysis.exporting.tabular import ExportRefused, Row, Table, Value
from palpate.analysis.reports.csv_files import demand_not_infinite, without_formula
from palpate.protocols.files import open_text

NOT_AVAILABLE = "n/a"
"""How BIDS says that a value is missing."""
_LARGEST = 2**53


def cell(value: Value, missing: str = "") -> str:
    """The text of a value; `missing` where there is none."""
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
    """Write a comma-separated table, RFC 4180 with LF; how many rows it has. A missing value is an empty cell.

    A text that a spreadsheet would run as a formula gets an apostrophe before it.
    """
    names = [column.name for column in table.columns]
    with open_text(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        return _counted(writer.writerow([_csv_cell(name, row.get(name)) for name in names]) for row in rows)


def _csv_cell(name: str, value: Value) -> str:
    if isinstance(value, float):
        demand_not_infinite(name, value)
    return without_formula(cell(value))


def write_tsv(path: Path, table: Table, rows: Iterable[Row]) -> int:
    """Write a tab-separated table as BIDS wants it; how many rows it has. A missing value is n/a.

    BIDS knows no quotes: runs of blanks and line breaks in a participant's words become one blank, and words that a
    spreadsheet would run as a formula get an apostrophe before them; elsewhere tabs and line breaks are refused, as is
    a text that reads n/a.
    """
    with open_text(path) as file:
        file.write("\t".join(column.name for column in table.columns) + "\n")
        return _counted(_write_line(file, line) for line in tsv_lines(path.name, table, rows))


def tsv_lines(where: str, table: Table, rows: Iterable[Row]) -> Iterable[Sequence[str]]:
    """The cells of each row as BIDS has them."""
    names = [(column.name, column.said) for column in table.columns]
    for number, row in enumerate(rows, start=1):
        yield [_tsv_cell(where, number, name, row.get(name), said) for name, said in names]


def _tsv_cell(where: str, number: int, name: str, value: Value, said: bool) -> str:
    if isinstance(value, float):
        demand_not_infinite(name, value)
    text = cell(value, NOT_AVAILABLE)
    if not isinstance(value, str):
        return text
    if said:
        return without_formula(" ".join(text.split())) or NOT_AVAILABLE
    if value == NOT_AVAILABLE or any(each in value for each in "\t\r\n"):
        raise ExportRefused(
            f"{where}: row {number}, column {name!r}: {value!r:.60} cannot stand in a BIDS table (tabs, line breaks,"
            f" and n/a mean something else there); use --csv, or leave the column out with --without {name}"
        )
    return text


def _write_line(file: IO[str], cells: Sequence[str]) -> int:
    return file.write("\t".join(cells) + "\n")


def _counted(written: Iterable[int]) -> int:
    return sum(1 for _ in written)
