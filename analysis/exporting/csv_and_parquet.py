"""Tidy tables as CSV files, or as Parquet files, with their codebook."""

from __future__ import annotations

from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any

from palpate.analysis.exporting.description import (
    Description,
    changes_text,
    json_for_people,
    readme_text,
    redacted_lines,
    withheld_lines,
)
from palpate.analysis.exporting.guard import Guard
from palpate.analysis.exporting.source import Watch, no_progress
from palpate.analysis.exporting.stimuli import copy_files, stimulus_files
from palpate.analysis.exporting.tables import DataSet, codebook, shared_definition
from palpate.analysis.exporting.tabular import ExportRefused, write_csv
from palpate.protocols.files import open_bytes, write_text

STUDY = "study.json"
ROWS = 50_000
"""Number of rows in memory at a time."""


def write_csv_files(
    data_set: DataSet, description: Description, guard: Guard, draft: Path, watch: Watch = no_progress
) -> None:
    """Write a CSV file for each table, codebook.csv, study.json, README.md and the stimuli's files."""
    for table in watch(data_set.tables, "writing tables"):
        name = f"{table.name}.csv"
        guard.demand_columns(name, [column.name for column in table.columns])
        write_csv(draft / name, table, guard.watched(table, name))
    holds = [f"`{table.name}.csv`: {table.description}" for table in data_set.tables]
    _write_accompanying_files(data_set, description, guard, draft, holds)


def write_parquet_files(
    data_set: DataSet, description: Description, guard: Guard, draft: Path, watch: Watch = no_progress
) -> None:
    """Write a Parquet file for each table with the descriptions of its columns; codebook.csv and so on as for CSV."""
    pyarrow = _pyarrow()
    kinds = {"text": pyarrow.string(), "number": pyarrow.float64(), "whole": pyarrow.int64(), "truth": pyarrow.bool_()}
    for table in watch(data_set.tables, "writing tables"):
        name = f"{table.name}.parquet"
        guard.demand_columns(name, [column.name for column in table.columns])
        # What a column means stands in the schema of the file; rows are written in pieces.
        schema = pyarrow.schema(
            [
                pyarrow.field(c.name, kinds[c.kind], metadata={"description": c.description, "unit": c.unit})
                for c in table.columns
            ],
            metadata={"description": table.description},
        )
        with (
            open_bytes(draft / name) as file,
            pyarrow.parquet.ParquetWriter(file, schema, compression="zstd") as writer,
        ):
            left = iter(guard.watched(table, name))
            while piece := list(islice(left, ROWS)):
                columns = {column.name: [row.get(column.name) for row in piece] for column in table.columns}
                writer.write_table(pyarrow.table(columns, schema=schema))
    holds = [f"`{table.name}.parquet`: {table.description}" for table in data_set.tables]
    _write_accompanying_files(data_set, description, guard, draft, holds)


def demand_parquet() -> None:
    """Raise ExportRefused where pyarrow is missing."""
    _pyarrow()


def _write_accompanying_files(
    data_set: DataSet, description: Description, guard: Guard, draft: Path, holds: list[str]
) -> None:
    book = codebook(data_set)
    write_csv(draft / "codebook.csv", book, book.rows())
    write_text(draft / STUDY, json_for_people(shared_definition(data_set)))
    files = stimulus_files(data_set.source, data_set.without)
    copy_files(files, draft / "stimuli")
    notes = [
        "`codebook.csv`: what every column means.",
        f"`{STUDY}`: the study's definition, stimuli included.",
        f"`stimuli/`: {files.note}" if files.files else files.note,
        "A missing value is an empty cell; truth is `true` or `false`. Read levels such as None or NA as texts: in"
        " pandas, `read_csv(..., keep_default_na=False)`.",
        *withheld_lines(data_set),
        *redacted_lines(guard),
    ]  # fmt: skip
    write_text(draft / "README.md", readme_text(description, data_set.source, [*holds, *notes]))
    write_text(draft / "CHANGES.md", changes_text(data_set.source))


def _pyarrow() -> Any:
    try:
        import_module("pyarrow.parquet")
        return import_module("pyarrow")
    except ImportError:
        raise ExportRefused('--parquet needs pyarrow, which is not installed: pip install "palpate[export]"') from None
