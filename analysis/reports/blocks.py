"""What a report of an evaluation is made of: words, tables and figures, in sections."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

from palpate.analysis.reports.captions import Caption
from palpate.analysis.reports.tables import Grid, Head

NONE = "–"
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Words:
    """A paragraph; `look` is a class of the style sheet."""

    kind: ClassVar[str] = "words"
    text: str
    look: str = ""


@dataclass(frozen=True)
class Heading:
    """A heading within a section."""

    kind: ClassVar[str] = "heading"
    text: str
    anchor: str = ""


@dataclass(frozen=True)
class Points:
    """Statements with a label each."""

    kind: ClassVar[str] = "points"
    points: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Strong:
    """What stands out in a table: rows (the default method), cells (the best of a column), others' columns and rows."""

    rows: frozenset[int] = frozenset()
    cells: frozenset[tuple[int, int]] = frozenset()
    columns: frozenset[int] = frozenset()
    others: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Table:
    """A table with its title and what is to be said below it; `folded` ones are opened by their title."""

    kind: ClassVar[str] = "table"
    title: str
    grid: Grid
    note: str = ""
    folded: bool = False
    strong: Strong = field(default_factory=Strong)


@dataclass(frozen=True)
class Picture:
    """A figure's drawing on the page."""

    kind: ClassVar[str] = "figure"
    anchor: str
    title: str
    caption: Caption
    markup: Any
    file: str = ""


Block = Words | Heading | Points | Table | Picture


@dataclass(frozen=True)
class Section:
    """A part of the page with its place in the navigation."""

    anchor: str
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Column:
    """A column of a table: its name in the rows, its heading, how it is written, what it is."""

    name: str
    heading: str
    form: str = "text"
    told: str = ""
    better: str = ""
    """"low" or "high": which of the column's numbers is set in bold."""


def table(
    title: str, rows: Sequence[Row], columns: Sequence[Column], *, note: str = "", folded: bool = False,
    ours: str | None = None, theirs: Sequence[str] = (),
) -> Table:  # fmt: skip
    """The rows as a table; `ours` is the method whose rows stand out, `theirs` others' columns.

    A row that is `printed` holds somebody else's numbers: it is drawn as such and is the best of nothing.
    """
    kept = [column for column in columns if any(row.get(column.name) is not None for row in rows)]
    heads = tuple(Head(c.heading, c.form if c.form in ("text", "words") else "number", c.name, c.told) for c in kept)
    cells = tuple(tuple(written(row.get(c.name), c.form) for c in kept) for row in rows)
    strong = Strong(
        frozenset(i for i, row in enumerate(rows) if ours is not None and row.get("method") == ours),
        frozenset(place for j, column in enumerate(kept) for place in _best(rows, column, j)),
        frozenset(j for j, column in enumerate(kept) if column.name in theirs),
        frozenset(i for i, row in enumerate(rows) if row.get("printed")),
    )
    return Table(title, Grid(heads, cells), note, folded, strong)


def _best(rows: Sequence[Row], column: Column, place: int) -> list[tuple[int, int]]:
    own = [(i, row.get(column.name)) for i, row in enumerate(rows) if column.better and not row.get("printed")]
    values = {i: value for i, value in own if value is not None}
    if len(values) < 2:
        return []
    best = (min if column.better == "low" else max)(values.values())
    return [(i, place) for i, value in values.items() if written(value, column.form) == written(best, column.form)]


def written(value: Any, form: str) -> str:
    """A value as a reader sees it: "text", "int", "share", "s", "ms", "bytes", "tiny", or digits after the point."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return NONE
    if form in ("text", "words"):
        return str(value)
    return _FORMS[form](float(value)).replace("-", "−")


def in_seconds(value: float) -> str:
    """A time in the unit that keeps it short."""
    if value >= 120:
        return f"{value / 60:.0f} min"
    return f"{value:.0f} s" if value >= 10 else f"{value:.1f} s" if value >= 0.1 else f"{value * 1e3:.1f} ms"


def in_bytes(value: float) -> str:
    """A size in kB or MB (powers of ten)."""
    return f"{value / 1e6:.1f} MB" if value >= 1e6 else f"{value / 1e3:.0f} kB"


_FORMS: Mapping[str, Callable[[float], str]] = {
    "int": lambda value: f"{value:,.0f}",
    "share": lambda value: f"{value:.1%}",
    "0": lambda value: f"{value:.0f}",
    "1": lambda value: f"{value:.1f}",
    "2": lambda value: f"{value:.2f}",
    "3": lambda value: f"{value:.3f}",
    "s": in_seconds,
    "ms": lambda value: f"{value:.2f}" if value < 10 else f"{value:.0f}",
    "bytes": in_bytes,
    "tiny": lambda value: "0" if value == 0 else f"{value:.0e}",
}
