"""The tables of a regenerated study for a manuscript: numbered, with title and notes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from palpate.analysis.regenerating.regenerated import Regenerated
from palpate.analysis.regenerating.shown import by_test, method_of, rests_on, test_table, test_title
from palpate.analysis.reports.tables import Table

MOST_LETTERS = 30
"""A cell of more letters wraps."""


@dataclass(frozen=True)
class Titled:
    """A table of a manuscript: its number, the test's name in the plan, its title, its rows and what stands below."""

    number: int
    name: str
    title: str
    table: Table
    notes: tuple[str, ...]


def titled_tables(found: Regenerated) -> Iterator[Titled]:
    """Each test as a table, in the plan's order; what qualifies every number stands below each."""
    qualified = tuple(" ".join(note.split()) for note in found.notes)
    for number, answered in enumerate(by_test(found.answered), start=1):
        table = test_table(answered)
        about = " ".join(filter(None, (method_of(answered), rests_on(answered))))
        notes = (*table.notes, *([about] if about else []), *qualified)
        yield Titled(number, answered[0].asked.name, test_title(answered), table, notes)


def table_letters(table: Table) -> int:
    """How many letters the table takes side by side: what decides whether a page must be turned. Heads may wrap."""
    cells = zip(*table.rows, strict=True) if table.rows else [() for _ in table.heads]
    return sum(_letters(head.name, column) for head, column in zip(table.heads, cells, strict=True))


def _letters(head: str, column: Iterable[str]) -> int:
    return min(MOST_LETTERS, max(len(text) for text in (*head.split(), *column))) + 2
