"""The tables of tests on a report's page: one for each question asked of the data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from analysis.reporting.analysed import Analysed, correction, reported_p
from analysis.reporting.page_table import Footnotes, Table, number, table, without_repeats
from analysis.reporting.page_text import NONE, count, degrees, fixed, p_cell, phrase, share
from analysis.reporting.sentences import all_sentences, effect_name, pair_sentence
from analysis.reporting.study_statistics import Question, Row, Test

CROSS = " × "
ALPHA = 0.05


@dataclass(frozen=True)
class VarianceTable:
    """An analysis of variance of every attribute, in a table and in sentences."""

    title: str
    words: str
    table: Table
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class Comparison:
    """The pairwise tests of one attribute and how many of them are below the level."""

    title: str
    summary: str
    table: Table
    sentences: tuple[str, ...]


def variance_tables(found: Analysed) -> Iterator[VarianceTable]:
    """The analyses of variance, in the order in which they were asked for."""
    for question in found.statistics.questions:
        if question.kind != "pairs":
            tests = [test for test in found.statistics.of(question) if test.rows]
            between = question.kind == "between"
            shown = _between_table(tests) if between else _within_table(tests)
            if tests:
                told = question_words(question, tests)
                yield VarianceTable(_title(question), told, shown, tuple(all_sentences(tests)))


def comparisons(found: Analysed) -> Iterator[Comparison]:
    """The pairwise tests of every attribute."""
    for question in found.statistics.questions:
        if question.kind == "pairs":
            for test in found.statistics.of(question):
                if test.rows:
                    title = f"{test.attribute}, {question.factors[0]}"
                    yield Comparison(title, _summary(test), _pairs_table(test), tuple(map(pair_sentence, test.rows)))


def refusals(found: Analysed) -> Iterator[str]:
    """The tests that could not be made, and why."""
    for test in found.statistics.tests:
        if test.refused:
            yield f"{test.attribute}, {_title(test.question)}: {test.refused}"


def question_words(question: Question, tests: list[Test]) -> str:
    """What was compared, of whom, and which averages went in."""
    people = sorted({test.participants for test in tests})
    who = count(people[-1], "participant") if len(people) == 1 else f"{people[0]} to {people[-1]} participants"
    return " ".join([f"{who}.", *_averaging(question, tests)])


def _averaging(question: Question, tests: list[Test]) -> Iterator[str]:
    factor = question.factors[0]
    if question.kind == "crossed":
        if max(test.ratings_per_cell[1] for test in tests) > 1:
            yield "Repeated ratings of one stimulus were averaged for each participant first."
        return
    over = phrase(question.averaged_over)
    if question.kind == "pooled":
        mean = f": the mean of their ratings over {over}" if over else ""
        yield f"Each participant has one value for each {factor}{mean}."
    else:
        yield f"Each participant has one value: the mean of all their ratings of the attribute, over {over}."


def _title(question: Question) -> str:
    names = CROSS.join(question.factors)
    if question.kind == "between":
        return f"{names}, between participants"
    if question.kind == "pairs":
        return f"pairs of {names}"
    return f"{names}, {question.scope}"


def _within_table(tests: list[Test]) -> Table:
    notes = Footnotes()
    rows = [(test.attribute, *_within_cells(row, notes)) for test in tests for row in test.rows]
    columns = (
        *("attribute", "effect", number("F"), number("df"), number("p"), number("ε (GG)"), number("p uncorrected")),
        *(number("p (HF)"), number("partial η²"), number("generalized η²")),
    )
    return table(columns, without_repeats(rows), notes.lines())


def _within_cells(row: Row, notes: Footnotes) -> tuple[str, ...]:
    epsilon = row["eps"] if correction(row) and row["eps"] is not None else 1.0
    return (
        notes.marked(effect_name(row["Source"]), row["note"]),
        fixed(row["F"]),
        f"{degrees(row['ddof1'] * epsilon)}, {degrees(row['ddof2'] * epsilon)}",
        p_cell(reported_p(row)),
        share(row["eps"]) if correction(row) else NONE,
        p_cell(row["p_unc"]),
        p_cell(row["p_HF_corr"]) if correction(row) else NONE,
        share(row["np2"]),
        share(row["ng2"]),
    )


def _between_table(tests: list[Test]) -> Table:
    notes = Footnotes()
    rows = [(test.attribute, *_between_cells(row, notes)) for test in tests for row in test.rows]
    return table(("attribute", "effect", number("F"), number("df"), number("p"), number("η²")), rows, notes.lines())


def _between_cells(row: Row, notes: Footnotes) -> tuple[str, ...]:
    return (
        notes.marked(row["Source"], row["note"]),
        fixed(row["F"]),
        f"{degrees(row['ddof1'])}, {degrees(row['ddof2'])}",
        p_cell(row["p_unc"]),
        share(row["eta2"]),
    )


def _pairs_table(test: Test) -> Table:
    notes = Footnotes()
    columns = (
        *("pair", number("mean difference"), number("95 % CI"), number("t"), number("df"), number("p uncorrected")),
        *(number("p Bonferroni"), number("p Holm"), number("Cohen's dz")),
    )
    return table(columns, [_pair_cells(row, notes) for row in test.rows], notes.lines())


def _pair_cells(row: Row, notes: Footnotes) -> tuple[str, ...]:
    return (
        notes.marked(f"{row['A']} − {row['B']}", row["note"]),
        fixed(row["mean_diff"]),
        f"[{fixed(row['ci_low'])}, {fixed(row['ci_high'])}]",
        fixed(row["T"]),
        degrees(row["dof"]),
        p_cell(row["p_unc"]),
        p_cell(row["p_bonferroni"]),
        p_cell(row["p_holm"]),
        fixed(row["dz"]),
    )


def _summary(test: Test) -> str:
    below = [sum(_below(row[column]) for row in test.rows) for column in ("p_bonferroni", "p_holm")]
    pairs = count(len(test.rows), "pair")
    return f"{below[0]} of {pairs} below .05 by Bonferroni, {below[1]} by Holm"


def _below(p: float | None) -> bool:
    return p is not None and p < ALPHA
