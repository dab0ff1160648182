"""Tables as CSV texts: equal rows give equal bytes on every machine."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from palpate.protocols.tables import table_text

ROWS = 5_000
"""The number of rows of a table in memory as text."""
FORMULA = "=+-@\t\r"
"""The characters at the beginning of a cell that spreadsheets take for a formula."""


class NotFinite(ValueError):
    """A result is infinite, which cannot be written as a number."""


def csv_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return rows as CSV: missing values are empty, a float is the shortest text that reads back as the same float.

    Raises NotFinite with the column of a number that is infinite.
    """
    columns = list(dict.fromkeys(name for row in rows for name in row))
    return table_text(columns, ([_cell(name, row.get(name)) for name in columns] for row in rows))


def json_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row as JSON holds it: a number that is not finite becomes None."""
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value for name, value in row.items()
    }


def table_csv(table: pd.DataFrame) -> str:
    """Return a table as CSV, equal to that of its rows, but built by column, some thousand rows at a time."""

    def rows() -> Iterator[tuple[str, ...]]:
        for first in range(0, len(table), ROWS):
            columns = []
            for name, column in table.iloc[first : first + ROWS].items():
                values = [value.item() if isinstance(value, np.generic) else value for value in column.tolist()]
                # Most columns are of few texts, each of which is looked at once.
                texts = {value: _cell(str(name), value) for value in values if type(value) is str}
                columns.append([texts[v] if type(v) is str else _cell(str(name), v) for v in values])
            yield from zip(*columns, strict=True)

    return table_text([str(name) for name in table.columns], rows())


def _cell(name: str, value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float) and math.isnan(demand_not_infinite(name, value)):
        return ""
    if isinstance(value, str):
        return without_formula(value)
    return str(value).lower() if isinstance(value, bool) else str(value)


def demand_not_infinite(name: str, value: float) -> float:
    """Return the number, which may be NaN. Raises NotFinite with the column's name for infinity."""
    if math.isinf(value):
        raise NotFinite(f"column {name}: a number is infinite, so it is not a result; nothing was written")
    return value


def without_formula(text: str) -> str:
    """Return a text that no spreadsheet runs: a text that begins like a formula and is no number gets an apostrophe.

    So does a text with apostrophes before such a character, so that removing the first one always restores the text.
    """
    begins = text.lstrip("'")[:1]
    if not begins or begins not in FORMULA:
        return text
    try:
        float(text)
    except ValueError:
        return f"'{text}"
    return text


def records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows of a table, each by its columns' names."""
    return [{str(name): value for name, value in record.items()} for record in table.to_dict("records")]
