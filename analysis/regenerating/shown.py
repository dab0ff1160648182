"""Answers as tables for a reader: columns under their names in words, numbers with the digits that mean something."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import groupby

from analysis.plans.answers import Row, Value
from analysis.regenerating.running import Answered
from analysis.reporting.page_table import Column, Footnotes, Table, number, table, without_repeats, words
from analysis.reporting.page_text import NONE, fixed, p_cell

MOST_ROWS = 2000
"""A page that holds more rows of one test than this is no longer read; the CSV has them all."""
_NAMES: Mapping[str, str] = {
    "a": "A", "b": "B", "df1": "df₁", "df2": "df₂", "sd": "SD", "se": "SE", "n": "n", "t": "t", "f": "F", "F": "F",
    "r2": "R²", "chi2": "χ²", "p": "p", "low": "low", "high": "high",
}  # fmt: skip


def test_table(answered: Sequence[Answered]) -> Table:
    """One test's rows, its outcomes below each other; notes as footnotes, a refused outcome with its reason."""
    several = any(each.outcome for each in answered)
    heads = _heads(answered)
    notes = Footnotes()
    rows: list[tuple[str, ...]] = []
    for each in answered:
        about = (each.outcome,) if several else ()
        if each.answer is None:
            rows.append((*about, *_refused(heads, each.refused, notes)))
            continue
        rows += [(*about, *_cells(heads, row, notes)) for row in each.answer.rows[:MOST_ROWS]]
    columns = [*([Column("outcome")] if several else []), *(_column(name, answered) for name in heads)]
    shown = without_repeats(rows) if several else rows
    return table(columns, shown, (*notes.lines(), *_cut(answered)))


def _heads(answered: Sequence[Answered]) -> list[str]:
    """The columns that any row fills; a note stands below."""
    rows = [row for each in answered if each.answer is not None for row in each.answer.rows]
    names = dict.fromkeys(name for row in rows for name in row if name != "note")
    return [name for name in names if any(row.get(name) not in (None, "") for row in rows)] or ["result"]


def _cut(answered: Sequence[Answered]) -> list[str]:
    most = max((len(each.answer.rows) for each in answered if each.answer is not None), default=0)
    return [f"The first {MOST_ROWS:,} of {most:,} rows; all of them are in the test's CSV."] if most > MOST_ROWS else []


def _refused(heads: Sequence[str], why: str, notes: Footnotes) -> list[str]:
    return [notes.marked(NONE, f"Not answered: {why}"), *(NONE for _ in heads[1:])]


def _cells(heads: Sequence[str], row: Row, notes: Footnotes) -> list[str]:
    cells = [cell_text(name, row.get(name)) for name in heads]
    note = str(row.get("note") or "")
    return [notes.marked(cells[0], note), *cells[1:]]


def is_p(name: str) -> bool:
    """Whether a column holds p values, by its name."""
    return name == "p" or name.startswith("p_") or name.endswith("_p")


def cell_text(name: str, value: Value) -> str:
    """A value as a reader sees it: p never 0, three decimals for p, a dash for what is undefined."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return NONE
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | str):
        return f"{value}".replace("-", "−") if isinstance(value, int) else value
    if is_p(name) and 0 <= value <= 1:
        return p_cell(value)
    if value == int(value) and abs(value) < 1e6 and name.startswith(("df", "n_", "count")):
        return f"{value:.0f}"
    return fixed(value, 3 if abs(value) < 1 else 2)


def _column(name: str, answered: Sequence[Answered]) -> Column:
    values = [row.get(name) for each in answered if each.answer is not None for row in each.answer.rows]
    texts = [value for value in values if isinstance(value, str)]
    if not texts:
        return number(heading(name))
    return words(heading(name)) if max(map(len, texts)) > 40 else Column(heading(name))


def heading(name: str) -> str:
    """A column's name in words."""
    if name in _NAMES:
        return _NAMES[name]
    return name.replace("_", " ")


def by_test(answered: Sequence[Answered]) -> list[tuple[Answered, ...]]:
    """The answers of each test, in the plan's order."""
    return [tuple(own) for _, own in groupby(answered, key=lambda each: each.asked.name)]


def test_title(answered: Sequence[Answered]) -> str:
    """A test's name in words, and its kind where the name does not say it."""
    asked = answered[0].asked
    name, kind = (text.replace("_", " ").replace("-", " ") for text in (asked.name, asked.test))
    return name.capitalize() if kind in name else f"{name.capitalize()} ({kind})"


def method_of(answered: Sequence[Answered]) -> str:
    """The method of the first outcome that has an answer, "" where none has."""
    found = next((each.answer.method for each in answered if each.answer is not None), "")
    return found if not found or found.endswith(".") else f"{found}."


def rests_on(answered: Sequence[Answered]) -> str:
    """How many participants and values the answers rest on, in words, and what was missing."""
    answers = [each.answer for each in answered if each.answer is not None]
    if not answers:
        return ""
    people, values = ({getattr(a, name) for a in answers} for name in ("participants", "values"))
    told = dict.fromkeys(each.missing.text() for each in answered if each.missing.text())
    first = f"{_range(people)} participants, {_range(values)} values{' for each outcome' * (len(answers) > 1)}."
    return " ".join([first, *(f"Missing: {each}." for each in told)])


def _range(numbers: set[int]) -> str:
    low, high = min(numbers), max(numbers)
    return f"{low:,}" if low == high else f"{low:,} to {high:,}"
