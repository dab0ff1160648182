"""The tables of tests in a report, one for each question about the data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from palpate.analysis.first_look.analysis import Analysis, correction, reported_p, with_nan
from palpate.analysis.first_look.study_statistics import Question, Row, Test, differing_factors, levels_by_group
from palpate.analysis.reports.tables import (
    NONE,
    Footnotes,
    Table,
    degrees,
    fixed,
    grouped_table,
    number,
    p_cell,
    share,
    text_table,
)
from palpate.analysis.statistics.apa import apa_f, apa_t
from palpate.protocols.wording import count, phrase

CROSS = " × "
ALPHA = 0.05
MOST_LEVELS = 8
GROUPS_APART = "Groups are not a factor of these tests."
NOT_TESTED = "not tested; the reason is given below"


@dataclass(frozen=True)
class VarianceTable:
    """The analysis of variance of every attribute, as a table and as sentences."""

    title: str
    words: str
    table: Table
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class PairsTable:
    """The pairwise tests of one attribute, and how many are significant."""

    title: str
    summary: str
    table: Table
    sentences: tuple[str, ...]


def variance_tables(analysis: Analysis) -> Iterator[VarianceTable]:
    """Yield the analyses of variance in the order of the questions."""
    for question in analysis.statistics.questions:
        if question.kind != "pairs":
            tests = [test for test in analysis.statistics.of(question) if test.rows]
            between = question.kind == "between"
            table = _between_table(tests) if between else _within_table(tests)
            if tests:
                description = question_words(question, tests, grouped=bool(analysis.ratings.between))
                description = f"{description} {describe_group_levels(analysis)}".rstrip() if between else description
                yield VarianceTable(_title(question), description, table, tuple(all_sentences(tests)))


def comparisons(analysis: Analysis) -> Iterator[PairsTable]:
    """Yield the pairwise tests of every attribute."""
    for question in analysis.statistics.questions:
        for test in analysis.statistics.of(question) if question.kind == "pairs" else ():
            if test.rows:
                below = {
                    column: sum(row[column] is not None and row[column] < ALPHA for row in test.rows)
                    for column in ("p_bonferroni", "p_holm")
                }
                pairs = count(len(test.rows), "pair")
                summary = f"{below['p_bonferroni']} of {pairs} below .05 by Bonferroni, {below['p_holm']} by Holm"
                title, sentences = f"{test.attribute}, {question.factors[0]}", tuple(map(pair_sentence, test.rows))
                yield PairsTable(title, summary, _pairs_table(test), sentences)


def refusals(analysis: Analysis) -> Iterator[str]:
    """Yield the tests that could not be computed, one line per reason."""
    stopped: dict[str, dict[str, list[str]]] = {}
    for test in analysis.statistics.tests:
        if test.refused:
            stopped.setdefault(test.refused, {}).setdefault(_title(test.question), []).append(test.attribute)
    every = len(analysis.ratings.attributes)
    for reason, titles in stopped.items():
        named = [
            title if every == 1 else f"{title} ({f'all {every} attributes' if len(own) == every else phrase(own)})"
            for title, own in titles.items()
        ]
        yield f"{'; '.join(named)}: {reason}"


def describe_group_levels(analysis: Analysis) -> str:
    """Return a sentence on whether the groups differ in stimuli as well as people; "" without levels by group."""
    factors, differing = analysis.ratings.cells, differing_factors(analysis.ratings)
    if not differing:
        return f"The groups met the same levels of {phrase(factors)}." if factors else ""
    groups = levels_by_group(analysis.ratings, differing[0])
    by_group = "; ".join(f"{group}: {phrase(levels)}" for group, levels in groups.items())
    listed = f" ({by_group})" if max(map(len, groups.values())) <= MOST_LEVELS else ""
    return (
        f"The groups met different levels of {phrase(differing)}{listed}, so that an effect of the group may be one "
        "of these levels as well as one of the people."
    )


def question_words(question: Question, tests: list[Test], *, grouped: bool) -> str:
    """Return what was compared, for whom, which averages were used, and whether existing groups are ignored."""
    people = sorted({test.participants for test in tests})
    who = count(people[-1], "participant") if len(people) == 1 else f"{people[0]} to {people[-1]} participants"
    apart = question.kind == "between" or question.group is not None
    return " ".join([f"{who}.", *_averaging(question, tests), *([GROUPS_APART] if grouped and not apart else [])])


def _averaging(question: Question, tests: list[Test]) -> Iterator[str]:
    most, over = max(test.ratings_per_cell[1] for test in tests), phrase(question.averaged_over)
    mean = f"the mean of {per_value(tests)}" + (f", over {over}" if over else "")
    if question.kind == "between":
        yield f"Each participant has one value, {mean}." if most > 1 else "Each participant has one rating."
    elif question.kind == "pooled":
        means = f", {mean}" if most > 1 else ""
        yield f"Each participant has one value for each {question.factors[0]}{means}."
    elif most > 1:
        yield f"Each participant has one value in each cell, {mean}."


def per_value(tests: list[Test]) -> str:
    """Return how many ratings a participant's value averages."""
    least, most = (pick(test.ratings_per_cell[i] for test in tests) for i, pick in ((0, min), (1, max)))
    return count(most, "rating") if least == most else f"{least:,} to {most:,} ratings"


def pairs_words(question: Question, tests: list[Test], *, grouped: bool) -> str:
    """Return what a comparison of pairs compares, and how many ratings the means of each level average."""
    description = f"Levels of {question.factors[0]}, compared within participants."
    least, most = (pick(test.ratings_per_cell[i] for test in tests) for i, pick in ((0, min), (1, max)))
    if most > 1 and least == most:
        description += f" A participant's value at a level is the mean of {count(most, 'rating')}."
    elif most > 1:
        description += (
            f" A participant's value is the mean of {_by_number(tests)}: the levels' means rest on unequal numbers."
        )
    return f"{description} {GROUPS_APART}" if grouped else description


def _by_number(tests: list[Test]) -> str:
    """Return the levels by their number of ratings: `3 ratings for original, 9 for amplitude and position`."""
    levels: dict[str, list[str]] = {}
    for level in tests[0].ratings_per_level:
        ends = {end for test in tests for end in test.ratings_per_level.get(level, ())}
        levels.setdefault(f"{min(ends)}" if len(ends) == 1 else f"{min(ends)} to {max(ends)}", []).append(level)
    unit = "rating" if next(iter(levels)) == "1" else "ratings"
    parts = [f"{number} for {phrase(names)}" for number, names in levels.items()]
    return ", ".join(parts).replace(" for", f" {unit} for", 1)


def _title(question: Question) -> str:
    names = CROSS.join(question.factors)
    if question.kind == "between":
        return f"{names}, between participants"
    if question.kind == "pairs":
        return f"pairs of {names}"
    return f"{names}, {question.scope}"


def _within_table(tests: list[Test]) -> Table:
    """Return the effects within participants; corrected columns are empty where nothing is corrected."""
    notes, rows = Footnotes(), []
    for attribute, row in ((test.attribute, row) for test in tests for row in test.rows):
        corrected = bool(correction(row))
        epsilon = row["eps"] if corrected and row["eps"] is not None else 1.0
        df = f"{degrees(row['ddof1'] * epsilon)}, {degrees(row['ddof2'] * epsilon)}"
        effect = notes.marked(effect_name(row["Source"]), row["note"])
        squares = (fixed(row["SS"]), fixed(row["SS_error"]), fixed(row["F"]), df, p_cell(reported_p(row)))
        gg, hf = (share(row["eps"]), share(row["eps_HF"])) if corrected else (NONE, NONE)
        p_hf = p_cell(row["p_HF_corr"]) if corrected else NONE
        etas = share(row["np2"]), share(row["ng2"])
        rows.append((attribute, effect, *squares, gg, p_cell(row["p_unc"]), hf, p_hf, *etas))
    columns = (
        *("attribute", "effect", number("SS"), number("SS error"), number("F"), number("df"), number("p")),
        *(number("ε (GG)"), number("p uncorrected"), number("ε (HF)"), number("p (HF)")),
        *(number("partial η²"), number("generalized η²")),
    )
    return grouped_table(columns, rows, notes.lines())


def _between_table(tests: list[Test]) -> Table:
    notes = Footnotes()
    rows = [
        (
            *(test.attribute, notes.marked(row["Source"], row["note"]), fixed(row["SS"]), fixed(row["SS_error"])),
            *(fixed(row["F"]), f"{degrees(row['ddof1'])}, {degrees(row['ddof2'])}"),
            *(p_cell(row["p_unc"]), share(row["eta2"])),
        )
        for test in tests
        for row in test.rows
    ]
    return text_table(
        ("attribute", "effect", *map(number, ("SS", "SS error", "F", "df", "p", "η²"))), rows, notes.lines()
    )


def _pairs_table(test: Test) -> Table:
    notes = Footnotes()
    rows = [
        (
            *(notes.marked(f"{row['A']} − {row['B']}", row["note"]), fixed(row["mean_diff"])),
            *(f"[{fixed(row['ci_low'])}, {fixed(row['ci_high'])}]", fixed(row["T"]), degrees(row["dof"])),
            *(p_cell(row[name]) for name in ("p_unc", "p_bonferroni", "p_holm")),
            fixed(row["dz"]),
        )
        for row in test.rows
    ]
    columns = (
        *("pair", number("mean difference"), number("95 % CI"), number("t"), number("df"), number("p uncorrected")),
        *(number("p Bonferroni"), number("p Holm"), number("Cohen's dz")),
    )
    return text_table(columns, rows, notes.lines())


def headlines(analysis: Analysis) -> Iterator[tuple[str, str]]:
    """Yield each attribute with its first result as a sentence, or a note that it was not tested."""
    for attribute in analysis.ratings.attributes:
        test = analysis.headline(attribute)
        if test is not None:
            sentences = "; ".join(sentence(row) for row in test.rows)
            yield attribute_title(analysis, attribute), sentences or NOT_TESTED


def attribute_title(analysis: Analysis, attribute: str) -> str:
    """Return an attribute with both words: `Easy-to-pull – Hard-to-pull`."""
    antonym = analysis.ratings.antonyms.get(attribute)
    return f"{attribute} – {antonym}" if antonym else attribute


def sentence(row: Row) -> str:
    """Return an effect with its test: `variant: F(4.20, 163.90) = 12.34, p < .001, ...`."""
    return f"{effect_name(row['Source'])}: {apa_f(with_nan(row))}"


def pair_sentence(row: Row) -> str:
    """Return a pair with its test, with p adjusted by Holm's method."""
    adjusted = with_nan(row) | {"p_adjust": "holm", "p_corr": with_nan(row)["p_holm"]}
    return f"{row['A']} − {row['B']}: {apa_t(adjusted)}"


def all_sentences(tests: tuple[Test, ...] | list[Test]) -> Iterator[str]:
    """Yield every effect of every test as a sentence with its attribute."""
    for test in tests:
        for row in test.rows:
            yield f"{test.attribute}, {sentence(row)}"


def effect_name(source: str) -> str:
    """Return an effect in the form for readers: `car × variant`."""
    return source.replace(":", " × ")
