"""The printed result of an evaluation: warnings, and the methods as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.table import Table


def print_banners(lines: Sequence[str]) -> None:
    """Print the warnings that precede all numbers."""
    from rich.console import Console

    console = Console(highlight=False)
    for line in lines:
        console.print(line, style="yellow", markup=False)


def methods_table(rows: Sequence[Mapping[str, Any]], columns: Sequence[tuple[str, str, str]]) -> Table:
    """Return a table with a row per method; columns are a row's key, its heading, and its form (`tables.written`)."""
    from rich.table import Table

    from palpate.analysis.reports.tables import written

    table = Table(box=None, pad_edge=False, collapse_padding=True)
    table.add_column("method", no_wrap=True, min_width=max(len(row["method"]) for row in rows))
    for _, heading, _ in columns:
        table.add_column(heading, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(row["method"], *(written(row[name], form) for name, _, form in columns))
    return table
