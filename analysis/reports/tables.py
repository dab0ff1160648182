"""Tables of texts for a reader, whatever shows them: a page, a Word file, LaTeX or a terminal.

Values become texts by their columns: the digits of a column stand below each other, an undefined number is a dash with
its reason below the table, and each column says what it is.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from palpate.analysis.plans.answers import Row, Value
from palpate.analysis.reports.headings import counts, heading, is_p
from palpate.analysis.reports.numbers import NONE, fixed, p_cell

NO_NUMBER = "There is no such number for this row."
LONG_TEXT = 40
MOST_DECIMALS = 8
MOST_LETTERS = 30
"""A cell of more letters wraps on paper."""
SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
_NONE: Mapping[str, str] = MappingProxyType({})
_NO_GROUPS: Mapping[int, str] = MappingProxyType({})


@dataclass(frozen=True)
class Head:
    """A column's head: its name in words, how its cells are set, its name in files, and what it is.

    `kind` is text, number (right), words (may wrap) or hash.
    """

    name: str
    kind: str = "text"
    column: str = ""
    meaning: str = ""


@dataclass(frozen=True)
class Emphasis:
    """What stands out in a table: rows (the default method), cells (the best of a column), others' columns and rows."""

    rows: frozenset[int] = frozenset()
    cells: frozenset[tuple[int, int]] = frozenset()
    columns: frozenset[int] = frozenset()
    others: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Table:
    """Rows of texts under heads, and notes below.

    `groups` are headings above the rows at these places, `ruled` the rows with a rule above, `keys` the marks of
    figures that each row belongs to.
    """

    heads: tuple[Head, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    groups: Mapping[int, str] = field(default_factory=lambda: _NO_GROUPS)
    ruled: frozenset[int] = frozenset()
    keys: tuple[tuple[str, ...], ...] = ()
    emphasis: Emphasis = field(default_factory=Emphasis)

    @property
    def legend(self) -> tuple[Head, ...]:
        """The columns about which there is something to say."""
        return tuple(head for head in self.heads if head.meaning)


def text_table(heads: Iterable[str | Head], rows: Iterable[Sequence[str]], notes: Iterable[str] = ()) -> Table:
    """Return a table of texts as they are; a column given by its name alone holds short texts."""
    columns = tuple(Head(head) if isinstance(head, str) else head for head in heads)
    return Table(columns, tuple(tuple(row) for row in rows), tuple(notes))


def grouped_table(heads: Iterable[str | Head], rows: Iterable[Sequence[str]], notes: Iterable[str] = ()) -> Table:
    """Return a table that leaves its first cell empty where it repeats the one above, a rule above each other one."""
    table = text_table(heads, rows, notes)
    first = [row[0] for row in table.rows]
    repeats = [place > 0 and text == first[place - 1] for place, text in enumerate(first)]
    cells = tuple(("", *row[1:]) if again else row for row, again in zip(table.rows, repeats, strict=True))
    starts = {place for place, text in enumerate(row[0] for row in cells) if text and place > 0}
    return replace(table, rows=cells, ruled=frozenset(starts if any(repeats) else ()))


def number(name: str) -> Head:
    """Return the head of a column of numbers."""
    return Head(name, "number")


def words(name: str) -> Head:
    """Return the head of a column of sentences, which may wrap."""
    return Head(name, "words")


def value_table(
    rows: Sequence[Row],
    meanings: Mapping[str, str] = _NONE,
    known: Collection[str] = (),
    without: str = NO_NUMBER,
    headings: Mapping[str, str] = _NONE,
) -> Table:
    """Return the rows as texts under their columns' names in words, each row's `note` below at the number it is about.

    `meanings` say what columns are. `known` are the keys of marks: a row belongs to those that it names. `without` is
    said of a number that a row lacks without a note; where it is "", such a cell is left empty. `headings` names
    columns that have no usual heading.
    """
    notes = Footnotes()
    names = filled_columns(rows)
    columns = [column_texts(name, [row.get(name) for row in rows]) for name in names]
    texts = tuple(
        _with_note(cells, str(row.get("note") or ""), notes, without)
        for row, cells in zip(rows, zip(*columns, strict=True), strict=True)
    )
    heads = []
    for name in names:
        words = [value for row in rows if isinstance(value := row.get(name), str)]
        kind = "number" if not words else "words" if max(map(len, words)) > LONG_TEXT else "text"
        heads.append(Head(headings.get(name) or heading(name), kind, name, meanings.get(name, "")))
    return Table(tuple(heads), texts, notes.lines(), keys=tuple(row_keys(row, known) for row in rows))


def filled_columns(rows: Sequence[Row]) -> list[str]:
    """Return the columns that any row fills, "result" where none does; a row's note stands below the table."""
    names = dict.fromkeys(name for row in rows for name in row if name != "note")
    return [name for name in names if any(row.get(name) not in (None, "") for row in rows)] or ["result"]


def row_keys(row: Row, known: Collection[str]) -> tuple[str, ...]:
    """Return the marks' keys among a row's texts, each once."""
    return tuple(dict.fromkeys(value for value in row.values() if isinstance(value, str) and value in known))


def _with_note(cells: Sequence[str], note: str, notes: Footnotes, without: str) -> tuple[str, ...]:
    """Return a row's cells with the number of its note: at what is undefined, else at the row's first cell."""
    if NONE in cells:
        dash = notes.marked(NONE, note or without) if note or without else ""
        return tuple(dash if cell == NONE else cell for cell in cells)
    return (notes.marked(cells[0], note), *cells[1:]) if note else tuple(cells)


def column_texts(name: str, values: Sequence[Value]) -> list[str]:
    """Return a column's values as a reader sees them, all with the same decimals, so that they stand below each other.

    p is never 0, an undefined number is a dash; a text that is not there is left empty.
    """
    missing = "" if any(isinstance(value, str) for value in values) else NONE
    numbers = [value for value in values if isinstance(value, float) and math.isfinite(value)]
    decimals = _decimals(name, numbers)
    return [_text(name, value, decimals, missing) for value in values]


def _decimals(name: str, numbers: Sequence[float]) -> int:
    if counts(name) and all(value == int(value) and abs(value) < 1e6 for value in numbers):
        return 0
    largest = max(map(abs, numbers), default=0.0)
    if largest > 1 or not largest:
        return 2
    return min(MOST_DECIMALS, max(3, 1 - math.floor(math.log10(largest))))


def _text(name: str, value: Value, decimals: int, missing: str) -> str:
    if value is None or value == "":
        return missing
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    return f"{value}".replace("-", "−") if isinstance(value, int) else _number(name, value, decimals)


def _number(name: str, value: float, decimals: int) -> str:
    """Return a number with so many decimals, and no sign before zero."""
    if not math.isfinite(value):
        return NONE if math.isnan(value) else "∞" if value > 0 else "−∞"
    if is_p(name) and 0 <= value <= 1:
        return p_cell(value)
    if abs(value) >= 1e6:
        return fixed(value, decimals)
    text = f"{value:.{decimals}f}"
    return text.lstrip("-") if not text.strip("-0.") else text.replace("-", "−")


@dataclass(frozen=True)
class NumberedTable:
    """A table of a manuscript: its number, its name in the plan, its title, the table and what stands below."""

    number: int
    name: str
    title: str
    table: Table
    notes: tuple[str, ...]


def table_letters(table: Table) -> int:
    """Return how many letters a table takes side by side, which decides whether its page is turned. Heads may wrap."""
    cells = zip(*table.rows, strict=True) if table.rows else [() for _ in table.heads]
    widest = (max(map(len, (*head.name.split(), *column))) for head, column in zip(table.heads, cells, strict=True))
    return sum(min(MOST_LETTERS, letters) + 2 for letters in widest)


class Footnotes:
    """Notes of one table, each written once: `marked` gives a text its number and keeps the note."""

    def __init__(self) -> None:
        self._numbers: dict[str, str] = {}

    def marked(self, text: str, note: str) -> str:
        """Return the text with the number of its note, or as it is where there is no note."""
        if not note:
            return text
        number = self._numbers.setdefault(note, str(len(self._numbers) + 1).translate(SUPERSCRIPTS))
        return f"{text} {number}"

    def lines(self) -> tuple[str, ...]:
        """Return the notes as they stand below the table."""
        return tuple(f"{number} {note}" for note, number in self._numbers.items())
