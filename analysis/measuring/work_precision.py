"""Error against run time: the bench's rows as a table, and a work-precision plot for each area."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import TYPE_CHECKING

from palpate.analysis.measuring.rows import MEASURED, Measurement

if TYPE_CHECKING:
    from rich.console import Console

OURS = "palpate"


def is_ours(row: Measurement) -> bool:
    """Return whether the method is this project's, by its name: `palpate`, or `palpate, exact`."""
    return row.method.casefold().startswith((OURS, "ours"))


def ratio_to_ours(row: Measurement, rows: Iterable[Measurement]) -> float | None:
    """Return the time relative to our first method on the same area, case and input; None if either has no time."""
    same = (row.area, row.case, row.input)
    reference = next((o for o in rows if is_ours(o) and (o.area, o.case, o.input) == same), None)
    if reference is None or not reference.seconds or row.seconds is None:
        return None
    return row.seconds / reference.seconds


def print_table(rows: Sequence[Measurement], console: Console | None = None) -> None:
    """Print a table for each area, grouped by case and input, with error and time side by side."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = console or Console()
    for area, of_area in groupby(rows, key=lambda row: row.area):
        own = list(of_area)
        title = f"{area}: error against run time"
        table = Table(title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, pad_edge=False)
        table.add_column("method", overflow="fold", min_width=24)
        for heading in ("error", "time", "x ours", "peak MB"):
            table.add_column(heading, justify="right", no_wrap=True)
        last = ("", "")
        for (case, input_name, kind), group in groupby(own, key=lambda row: (row.case, row.input, row.error_kind)):
            table.add_row(f"[bold]{escape(case)}[/bold], {escape(input_name)}")
            if (case, kind) != last:
                table.add_row(f"[dim]{escape(kind)}[/dim]")
            last = (case, kind)
            for row in group:
                ratio = ratio_to_ours(row, own)
                method = f"  [cyan]{escape(row.method)}[/cyan]" if is_ours(row) else f"  {escape(row.method)}"
                table.add_row(
                    f"{method}\n  [red]{escape(row.note)}[/red]" if row.note else method,
                    error_text(row),
                    time_text(row.seconds),
                    "" if ratio is None else f"{ratio:.3g}",
                    "" if row.peak_MB is None else f"{row.peak_MB:.2f}",
                )
            table.add_section()
        console.print(table)


def error_text(row: Measurement) -> str:
    """Return the error as text: an exact answer is `0`, and an undefined error is named."""
    if row.outcome != MEASURED or row.error is None:
        return row.outcome
    return "0" if row.error == 0 else f"{row.error:.1e}"


def time_text(seconds: float | None) -> str:
    """Return a time in a suitable unit."""
    if seconds is None:
        return ""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{_three_figures(seconds / size)} {unit}"
    return f"{_three_figures(seconds / 1e-6)} µs"


def _three_figures(number: float) -> str:
    """Return a number with three significant digits, never as a power of ten; an integer from 1000 on."""
    return f"{number:.0f}" if number >= 999.5 else f"{number:.3g}"
