"""What stands on a report's page, as plain data: texts and tables, nothing of HTML."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from palpate.analysis.first_look import page_data
from palpate.analysis.first_look.analysed import Analysed, software
from palpate.analysis.first_look.page_methods import methods
from palpate.analysis.first_look.page_tests import (
    PairsTable,
    VarianceTable,
    comparisons,
    pairs_words,
    refusals,
    variance_tables,
)
from palpate.analysis.first_look.pictures import shown_factors
from palpate.analysis.first_look.sentences import headlines
from palpate.analysis.ratings.notes import data_notes
from palpate.analysis.reports.numbers import NONE, fixed, phrase
from palpate.analysis.reports.page_table import Column, Table, number, table


@dataclass(frozen=True)
class Page:
    """A report without its figures."""

    title: str
    lead: str
    simulated: bool
    facts: tuple[tuple[str, str], ...]
    results_intro: str
    headlines: tuple[tuple[str, str], ...]
    not_tested: tuple[str, ...]
    means: Table
    check: str
    inclusions: tuple[str, ...]
    findings: tuple[str, ...]
    exclusions: Table
    participants: Table
    analyses: tuple[VarianceTable, ...]
    comparisons_intro: tuple[str, ...]
    comparisons: tuple[PairsTable, ...]
    methods: tuple[str, ...]
    inputs: Table
    software: Table


def page_of(found: Analysed) -> Page:
    """The page of an analysed data set: equal analyses give equal pages."""
    ratings = found.ratings
    return Page(
        title=found.title,
        lead=page_data.lead(ratings),
        simulated=ratings.simulated,
        facts=tuple(page_data.facts(ratings)),
        results_intro=_results_intro(found),
        headlines=tuple(headlines(found)),
        not_tested=tuple(refusals(found)),
        means=stimulus_table(found),
        check=page_data.check_words(found),
        inclusions=tuple(page_data.inclusions(ratings)),
        findings=(
            *(each.text() for each in found.design.problems),
            *data_notes(found.design.notes, ratings.exclusions, ratings.sessions),
        ),
        exclusions=page_data.exclusions(ratings),
        participants=page_data.participants(ratings),
        analyses=tuple(variance_tables(found)),
        comparisons_intro=tuple(_comparisons_intro(found)),
        comparisons=tuple(comparisons(found)),
        methods=tuple(methods(found)),
        inputs=page_data.inputs(ratings),
        software=table(("package", "version"), software().items()),
    )


def level_table(found: Analysed) -> Table:
    """The numbers that both figures show."""
    factors = shown_factors(found.ratings)
    rows = [
        (
            str(row["attribute"]),
            *(str(row[factor]) for factor in factors),
            fixed(row["mean"]),
            fixed(row["sd"]),
            str(row["n"]),
        )
        for row in found.levels.to_dict("records")
    ]
    return table(("attribute", *factors, number("mean"), number("SD"), number("participants")), rows)


def stimulus_table(found: Analysed) -> Table:
    """Mean and, in brackets, SD over the n participants of every stimulus: a row for each, a column an attribute."""
    attributes = found.ratings.attributes
    labels = [name for name in found.stimuli.columns[: found.stimuli.columns.get_loc("kind")] if name != "attribute"]
    cells: dict[tuple[str, ...], dict[str, str]] = {}
    people: dict[tuple[str, ...], set[int]] = {}
    for row in found.stimuli.to_dict("records"):
        key = tuple(str(row[name]) for name in labels)
        cells.setdefault(key, {})[row["attribute"]] = f"{fixed(row['mean'])} ({fixed(row['sd'])})"
        people.setdefault(key, set()).add(int(row["n"]))
    rows = [(*key, *(own.get(each, NONE) for each in attributes), _range(people[key])) for key, own in cells.items()]
    heads: list[str | Column] = [*labels, *map(number, attributes), number("n")]
    return table(heads, rows)


def _range(numbers: set[int]) -> str:
    return f"{min(numbers)}" if len(numbers) == 1 else f"{min(numbers)} to {max(numbers)}"


def _results_intro(found: Analysed) -> str:
    first = next((found.headline(attribute) for attribute in found.ratings.attributes), None)
    if first is None:
        return "No test was made: the data set has no factor to compare."
    over = phrase(first.question.averaged_over)
    means = f" Each participant's ratings were averaged over {over} first." if over else ""
    return f"The effect of {phrase(first.question.factors)} on each attribute, {first.question.scope}.{means}"


def _comparisons_intro(found: Analysed) -> Iterator[str]:
    for question in found.statistics.questions:
        tests = [test for test in found.statistics.of(question) if test.rows]
        if question.kind == "pairs" and tests:
            yield pairs_words(question, tests, grouped=bool(found.ratings.between))
