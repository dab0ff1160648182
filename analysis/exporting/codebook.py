"""The codebook: what every column of every table means; and the study's definition, which everything was asked by."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from palpate.analysis.exporting.tables import Shared
from palpate.analysis.exporting.tabular import Column, Row, Table

COLUMNS = (
    Column("table", "The table."),
    Column("column", "The column."),
    Column("kind", "What kind of value it holds: text, number, whole (number), truth (true or false)."),
    Column("unit", "The unit of a number."),
    Column("description", "What it means."),
    Column("levels", "The values that it may hold, each with its meaning: value = meaning, divided by ' | '."),
)


def codebook(shared: Shared) -> Table:
    """One row for each column of each table."""
    return Table("codebook", "What every column of every table means.", COLUMNS, lambda: _rows(shared))


def _rows(shared: Shared) -> Iterator[Row]:
    for table in shared.tables:
        for column in table.columns:
            levels = " | ".join(f"{value} = {told}" for value, told in column.levels.items())
            yield {"table": table.name, "column": column.name, "kind": column.kind, "unit": column.unit,
                   "description": column.description, "levels": levels}  # fmt: skip


def definition(shared: Shared) -> dict[str, Any]:
    """The study's definition as it was compiled, without the stimulus columns that were left out."""
    found = dict(shared.source.definition)
    found["stimuli"] = [
        {**each, "columns": {k: v for k, v in each.get("columns", {}).items() if k not in shared.without}}
        for each in found["stimuli"]
    ]
    return found
