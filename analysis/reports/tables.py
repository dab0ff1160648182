"""Rows of values as a table of texts for a reader: digits by column, a dash with its reason, what each column is."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from palpate.analysis.plans.answers import Row, Value
from palpate.analysis.reports.headings import counts, heading, is_p
from palpate.analysis.reports.numbers import NONE, fixed, p_cell
from palpate.analysis.reports.page_table import Footnotes

NO_NUMBER = "There is no such number for this row."
LONG_TEXT = 40
MOST_DECIMALS = 8
_NONE: Mapping[str, str] = MappingProxyType({})
_NO_GROUPS: Mapping[int, str] = MappingProxyType({})


@dataclass(frozen=True)
class Head:
    """A column: its name in words, how it is set (text, number, words, hash), its name in the CSV, what it is."""

    name: str
    kind: str = "text"
    column: str = ""
    told: str = ""


@dataclass(frozen=True)
class Grid:
    """A table of texts. `groups` are headings above the rows at these places, `keys` the marks each row belongs to."""

    heads: tuple[Head, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    groups: Mapping[int, str] = field(default_factory=lambda: _NO_GROUPS)
    keys: tuple[tuple[str, ...], ...] = ()

    @property
    def legend(self) -> tuple[Head, ...]:
        """The columns about which there is something to say."""
        return tuple(head for head in self.heads if head.told)


def plain_grid(heads: Iterable[str | Head], rows: Iterable[Sequence[str]]) -> Grid:
    """A table of texts as they are; a column given by its name alone holds short texts."""
    return Grid(
        tuple(Head(head) if isinstance(head, str) else head for head in heads), tuple(tuple(row) for row in rows)
    )


def value_grid(
    rows: Sequence[Row],
    kinds: Mapping[str, str] = _NONE,
    known: Collection[str] = (),
    without: str = NO_NUMBER,
    headings: Mapping[str, str] = _NONE,
) -> Grid:
    """The rows as texts under their columns' names in words; a row's `note` stands below, at the number it is about.

    `known` are the keys of marks: a row belongs to those that it names. `without` is said of a number that a row lacks
    without a note; where it is "", such a cell is left empty. `headings` names columns that have no usual heading.
    """
    notes = Footnotes()
    names = filled_columns(rows)
    texts = [_marked(row, cells, notes, without) for row, cells in zip(rows, _by_row(names, rows), strict=True)]
    heads = tuple(
        replace(_head(name, rows, headings.get(name) or heading(name)), told=kinds.get(name, "")) for name in names
    )
    return Grid(heads, tuple(texts), notes.lines(), keys=tuple(row_keys(row, known) for row in rows))


def filled_columns(rows: Sequence[Row]) -> list[str]:
    """The columns that any row fills, "result" where none does; a row's note stands below the table."""
    names = dict.fromkeys(name for row in rows for name in row if name != "note")
    return [name for name in names if any(row.get(name) not in (None, "") for row in rows)] or ["result"]


def row_keys(row: Row, known: Collection[str]) -> tuple[str, ...]:
    """The marks' keys among a row's texts, each once."""
    return tuple(dict.fromkeys(value for value in row.values() if isinstance(value, str) and value in known))


def _head(name: str, rows: Sequence[Row], words: str) -> Head:
    texts = [value for row in rows if isinstance(value := row.get(name), str)]
    if not texts:
        return Head(words, "number", name)
    return Head(words, "words" if max(map(len, texts)) > LONG_TEXT else "text", name)


def _by_row(names: Sequence[str], rows: Sequence[Row]) -> list[tuple[str, ...]]:
    columns = [column_texts(name, [row.get(name) for row in rows]) for name in names]
    return list(zip(*columns, strict=True)) if columns else [() for _ in rows]


def _marked(row: Row, cells: Sequence[str], notes: Footnotes, without: str) -> tuple[str, ...]:
    """The row's cells with the number of its note: at what is undefined, else at the row's first cell."""
    note = str(row.get("note") or "")
    if NONE in cells:
        told = notes.marked(NONE, note or without) if note or without else ""
        return tuple(told if cell == NONE else cell for cell in cells)
    return (notes.marked(cells[0], note), *cells[1:]) if note else tuple(cells)


def column_texts(name: str, values: Sequence[Value]) -> list[str]:
    """A column's values as a reader sees them, all with the same decimals, so that they stand below each other.

    p is never 0, an undefined number is a dash; a text that is not there is left empty.
    """
    lacking = "" if any(isinstance(value, str) for value in values) else NONE
    numbers = [value for value in values if isinstance(value, float) and math.isfinite(value)]
    decimals = _decimals(name, numbers)
    return [_text(name, value, decimals, lacking) for value in values]


def _decimals(name: str, numbers: Sequence[float]) -> int:
    if counts(name) and all(value == int(value) and abs(value) < 1e6 for value in numbers):
        return 0
    largest = max(map(abs, numbers), default=0.0)
    if largest > 1 or not largest:
        return 2
    return min(MOST_DECIMALS, max(3, 1 - math.floor(math.log10(largest))))


def _text(name: str, value: Value, decimals: int, lacking: str) -> str:
    if value is None or value == "":
        return lacking
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str | int):
        return value if isinstance(value, str) else f"{value}".replace("-", "−")
    return _number(name, value, decimals)


def _number(name: str, value: float, decimals: int) -> str:
    if not math.isfinite(value):
        return NONE if math.isnan(value) else "∞" if value > 0 else "−∞"
    if is_p(name) and 0 <= value <= 1:
        return p_cell(value)
    return fixed(value, decimals) if abs(value) >= 1e6 else _rounded(value, decimals)


def _rounded(value: float, decimals: int) -> str:
    """With so many decimals, and no sign before zero."""
    text = f"{value:.{decimals}f}"
    return text.lstrip("-") if not text.strip("-0.") else text.replace("-", "−")
