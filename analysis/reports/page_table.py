"""A table of texts, as a page shows it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Column:
    """A column's name and how its cells are set: text, number (right), words (may wrap) or hash."""

    name: str
    kind: str = "text"


@dataclass(frozen=True)
class Table:
    """Rows of texts under columns, and notes below. An empty first cell repeats the one above it."""

    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()

    def starts_group(self, index: int) -> bool:
        """Whether a rule is drawn above this row: a new first cell in a table that leaves repeated ones out."""
        grouped = any(not row[0] for row in self.rows)
        return index > 0 and grouped and bool(self.rows[index][0])


def number(name: str) -> Column:
    """A column of numbers."""
    return Column(name, "number")


def words(name: str) -> Column:
    """A column of sentences, which may wrap."""
    return Column(name, "words")


def table(columns: Sequence[str | Column], rows: Iterable[Sequence[str]], notes: Sequence[str] = ()) -> Table:
    """A table; a column given by its name alone holds short texts."""
    heads = tuple(Column(column) if isinstance(column, str) else column for column in columns)
    return Table(heads, tuple(tuple(row) for row in rows), tuple(notes))


def without_repeats(rows: Iterable[Sequence[str]]) -> list[tuple[str, ...]]:
    """The rows with the first cell left empty where it equals the one above."""
    shown, last = [], None
    for row in rows:
        shown.append(("" if row[0] == last else row[0], *row[1:]))
        last = row[0]
    return shown


class Footnotes:
    """Notes of one table, each written once: `marked` gives a text its number and keeps the note."""

    def __init__(self) -> None:
        self._numbers: dict[str, str] = {}

    def marked(self, text: str, note: str) -> str:
        """The text with the number of its note, or as it is where there is no note."""
        if not note:
            return text
        number = self._numbers.setdefault(note, str(len(self._numbers) + 1).translate(SUPERSCRIPTS))
        return f"{text} {number}"

    def lines(self) -> tuple[str, ...]:
        """The notes as they stand below the table."""
        return tuple(f"{number} {note}" for note, number in self._numbers.items())
