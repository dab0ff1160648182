"""Answers for a reader: each test as one table, its title, its method and what it rests on in words."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby

from palpate.analysis.plans.answers import Row
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.regenerating.plan_tests import QuestionResult
from palpate.analysis.regenerating.regeneration import RegeneratedStudy
from palpate.analysis.reports.tables import NumberedTable, Table, value_table

MOST_ROWS = 2000
"""A page that holds more rows of one test than this is no longer read; the CSV has them all."""
OUTCOME = "outcome"


def test_table(results: Sequence[QuestionResult], known: Collection[str] = ()) -> Table:
    """Return one test's rows, its outcomes below each other; notes as footnotes, a refused outcome with its reason.

    An outcome of one row stands in a column, outcomes of several rows each have a heading.
    """
    kinds = {
        name: meaning
        for result in results
        if result.answer is not None
        for name, meaning in result.answer.kinds.items()
    }
    table = partial(value_table, meanings=kinds, known=known, headings=TESTS[results[0].settings.test].headings)
    several = any(result.outcome for result in results)
    if several and all(result.answer is None or len(result.answer.rows) == 1 for result in results):
        return table([{OUTCOME: result.outcome, **row} for result in results for row in _rows(result)])
    rows: list[Row] = []
    groups: dict[int, str] = {}
    for result in results:
        if result.outcome:
            groups[len(rows)] = result.outcome
        rows += _rows(result)[:MOST_ROWS]
    whole = table(rows)
    return replace(whole, notes=(*whole.notes, *_cut(results)), groups=groups)


def _rows(result: QuestionResult) -> Sequence[Row]:
    """Return an outcome's rows; one that has no answer has one row of nothing, and the reason as its note."""
    return ({"note": f"Not answered: {result.refused}"},) if result.answer is None else result.answer.rows


def _cut(results: Sequence[QuestionResult]) -> list[str]:
    most = max((len(result.answer.rows) for result in results if result.answer is not None), default=0)
    return [f"The first {MOST_ROWS:,} of {most:,} rows; all of them are in the test's CSV."] if most > MOST_ROWS else []


def by_test(results: Sequence[QuestionResult]) -> list[tuple[QuestionResult, ...]]:
    """Return the answers of each test, in the plan's order."""
    return [tuple(own) for _, own in groupby(results, key=lambda result: result.settings.name)]


def test_name(results: Sequence[QuestionResult]) -> str:
    """Return a test's name in words."""
    name = results[0].settings.name.replace("_", " ").replace("-", " ")
    return name[:1].upper() + name[1:]


def test_kind(results: Sequence[QuestionResult]) -> str:
    """Return the kind of a test in words, "" where its name already says so."""
    title = TESTS[results[0].settings.test].title
    return "" if title.lower() == test_name(results).lower() else title


def test_title(results: Sequence[QuestionResult]) -> str:
    """Return a test's name in words, and its kind where the name does not say it."""
    name, kind = test_name(results), test_kind(results)
    return f"{name}: {kind}" if kind else name


def method_of(results: Sequence[QuestionResult]) -> str:
    """Return the method of the first outcome that has an answer, "" where none has."""
    method = next((result.answer.method for result in results if result.answer is not None), "")
    return method if not method or method.endswith(".") else f"{method}."


def notes_of(results: Sequence[QuestionResult]) -> tuple[str, ...]:
    """Return what the answers say beside their numbers, each once; what holds for some outcomes only names them."""
    outcomes_of: dict[str, list[str]] = {}
    answers = [(result.outcome, result.answer) for result in results if result.answer is not None]
    for outcome, answer in answers:
        for note in dict.fromkeys(answer.notes):
            outcomes_of.setdefault(note, []).append(outcome)
    return tuple(
        note if len(own) == len(answers) or not all(own) else f"{', '.join(own)}: {note}"
        for note, own in outcomes_of.items()
    )


def rests_on(results: Sequence[QuestionResult]) -> str:
    """Return how many participants and values the answers rest on, in words, and what was missing."""
    answers = [result.answer for result in results if result.answer is not None]
    if not answers:
        return ""
    people, values = ({getattr(a, name) for a in answers} for name in ("participants", "values"))
    gaps = dict.fromkeys(result.missing.text() for result in results if result.missing.text())
    first = f"{_range(people)} participants, {_range(values)} values{' for each outcome' * (len(answers) > 1)}."
    return " ".join([first, *(f"Missing: {text}." for text in gaps)])


def _range(numbers: set[int]) -> str:
    low, high = min(numbers), max(numbers)
    return f"{low:,}" if low == high else f"{low:,} to {high:,}"


def numbered_tables(study: RegeneratedStudy) -> Iterator[NumberedTable]:
    """Yield each test as a table of a manuscript, in the plan's order, with what qualifies its numbers below."""
    qualified = tuple(" ".join(note.split()) for note in study.notes)
    for number, answered in enumerate(by_test(study.answered), start=1):
        table = test_table(answered)
        about = " ".join(filter(None, (method_of(answered), rests_on(answered))))
        notes = (*table.notes, *([about] if about else []), *qualified)
        yield NumberedTable(number, answered[0].settings.name, test_title(answered), table, notes)
