"""The report of a first look: one self-contained HTML file, with equal bytes for equal inputs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from palpate.analysis.figures.style import drawing, inline_svg, save, svg_text
from palpate.analysis.first_look import page_data
from palpate.analysis.first_look.analysis import Analysis, software
from palpate.analysis.first_look.figures import pictures, shown_factors
from palpate.analysis.first_look.page_data import averaged
from palpate.analysis.first_look.page_tests import (
    GROUPS_APART,
    comparisons,
    describe_group_levels,
    headlines,
    pairs_words,
    refusals,
    variance_tables,
)
from palpate.analysis.ratings.design_report import data_notes
from palpate.analysis.reports.page import (
    SIMULATED,
    STILL,
    Block,
    Caption,
    FigureBlock,
    Folded,
    Heading,
    Page,
    Points,
    Preformatted,
    Section,
    Sentences,
    TableBlock,
    Words,
    fill_in,
    italic,
    long_table,
    page_html,
)
from palpate.analysis.reports.tables import NONE, Head, Table, fixed, number, text_table
from palpate.protocols.files import staged_files, write_text
from palpate.protocols.wording import phrase


def write_report(analysis: Analysis, path: Path) -> Path:
    """Write the report to `path` and create its folder."""
    return write_text(path, report_html(analysis))


def report_html(analysis: Analysis) -> str:
    """Return the whole report as HTML, with every name escaped and every figure inline."""
    return page_html(page_of(analysis), STILL)


def page_of(analysis: Analysis) -> Page:
    """Return the page of an analysed data set; equal analyses give equal pages."""
    inputs = page_data.inputs(analysis.ratings)
    provenance: tuple[Block, ...] = (
        Words("Every number on this page comes from these inputs. The same inputs give the same page, byte for byte."),
        *long_table(inputs, f"All {len(inputs.rows)} inputs and their SHA-256"),
        Heading("Software"),
        TableBlock(text_table(("package", "version"), software().items())),
    )
    tested = [Section("pairwise", "Pairwise tests", pairs)] if (pairs := tuple(_pairs(analysis))) else []
    results: list[Block] = []
    first = next((analysis.headline(attribute) for attribute in analysis.ratings.attributes), None)
    if first is None:
        results.append(Words("No test was made: the data set has no factor to compare."))
    else:
        over = phrase(first.question.averaged_over)
        means = f" Each participant's ratings were averaged over {over} first." if over else ""
        factors = phrase(first.question.factors)
        results.append(Words(f"The effect of {factors} on each attribute, {first.question.scope}.{means}"))
    results.append(Points(tuple(headlines(analysis))))
    if refused := tuple(refusals(analysis)):
        results.append(Heading("Not tested"))
        results.append(Sentences(refused))
    return Page(
        title=analysis.title,
        lead=page_data.lead(analysis.ratings),
        banners=(SIMULATED,) if analysis.ratings.simulated else (),
        facts=tuple(page_data.facts(analysis.ratings)),
        sections=(
            Section("results", "Results", tuple(results)),
            Section("figures", "Figures", tuple(_figures(analysis))),
            Section("data", "Data and exclusions", tuple(_data(analysis))),
            Section("anova", "Analyses of variance", tuple(_variance(analysis))),
            *tested,
            Section("methods", "Methods", tuple(map(Words, methods(analysis)))),
            Section("provenance", "Provenance", provenance),
        ),
    )


def save_figures(analysis: Analysis, folder: Path) -> list[Path]:
    """Write every figure as SVG and PNG to `folder` and return the paths; none if no factor has levels to show."""
    paths: list[Path] = []
    with staged_files(folder) as draft:
        for picture in pictures(analysis.ratings):
            with drawing(picture.name):
                paths += save(picture.draw(picture.data).figure, draft, picture.name)
    return [folder / path.name for path in paths]


def _figures(analysis: Analysis) -> Iterator[Block]:
    from markupsafe import Markup

    numbers = Folded("The numbers behind this figure", (TableBlock(level_table(analysis)),))
    place = 0
    for place, picture in enumerate(pictures(analysis.ratings), start=1):
        with drawing(picture.name):
            svg = inline_svg(svg_text(picture.draw(picture.data).figure), f"f{place}")
        title, anchor = picture.data.title, f"figure-{place}"
        markup = Markup('<div role="img" aria-label="{}">{}</div>').format(title, Markup(svg))
        yield FigureBlock(anchor, f"Figure {place}. {title}", Caption(picture.data.caption), markup, blocks=(numbers,))
    if not place:
        yield Words("No factor varies within participants: there is nothing that a figure could compare.")
    yield Heading("Means of every stimulus")
    means = "Mean rating and, in brackets, standard deviation over n participants"
    yield Words(fill_in(f"{means}; unrounded in stimulus_means.csv, which {{}} writes.", italic("palpate analyse")))
    table = stimulus_table(analysis)
    yield from long_table(table, f"All {len(table.rows)} stimuli")


def _data(analysis: Analysis) -> Iterator[Block]:
    ratings = analysis.ratings
    yield Heading("Check of the design")
    yield Words(page_data.check_words(analysis))
    yield from map(Words, page_data.inclusions(ratings))
    yield from (Preformatted(problem.text()) for problem in analysis.design.problems)
    yield from map(Preformatted, data_notes(analysis.design.notes, ratings.exclusions, ratings.sessions))
    yield Heading("Exclusion ledger")
    ledger = page_data.exclusions(ratings)
    yield TableBlock(ledger) if ledger.rows else Words("Nothing was left out.")
    yield Heading("Participants")
    people = page_data.participants(ratings)
    yield from long_table(people, f"All {len(people.rows)} participants")


def _variance(analysis: Analysis) -> Iterator[Block]:
    tables = list(variance_tables(analysis))
    if not tables:
        yield Words("None was made.")
        return
    every = "Every number, unrounded and with its uncorrected degrees of freedom, stands in anova.csv, which {} writes."
    yield Words(fill_in(every, italic("palpate analyse")))
    for variance in tables:
        yield Heading(variance.title)
        yield Words(variance.words)
        yield TableBlock(variance.table)
        yield Folded("As sentences", (Sentences(variance.sentences),))


def _pairs(analysis: Analysis) -> Iterator[Block]:
    for question in analysis.statistics.questions:
        tests = [test for test in analysis.statistics.of(question) if test.rows]
        if question.kind == "pairs" and tests:
            yield Words(pairs_words(question, tests, grouped=bool(analysis.ratings.between)))
    for pairs in comparisons(analysis):
        yield Folded(f"{pairs.title}: {pairs.summary}", (TableBlock(pairs.table), Sentences(pairs.sentences)))


def level_table(analysis: Analysis) -> Table:
    """Return the table of the numbers in both figures."""
    factors = shown_factors(analysis.ratings)
    rows = [
        (
            str(row["attribute"]),
            *(str(row[factor]) for factor in factors),
            fixed(row["mean"]),
            fixed(row["sd"]),
            str(row["n"]),
        )
        for row in analysis.levels.to_dict("records")
    ]
    return text_table(("attribute", *factors, number("mean"), number("SD"), number("participants")), rows)


def stimulus_table(analysis: Analysis) -> Table:
    """Return mean and, in brackets, SD over the n participants: a row per stimulus, a column per attribute."""
    attributes = analysis.ratings.attributes
    labels = [
        name for name in analysis.stimuli.columns[: analysis.stimuli.columns.get_loc("kind")] if name != "attribute"
    ]
    cells: dict[tuple[str, ...], dict[str, str]] = {}
    people: dict[tuple[str, ...], set[int]] = {}
    for row in analysis.stimuli.to_dict("records"):
        key = tuple(str(row[name]) for name in labels)
        cells.setdefault(key, {})[row["attribute"]] = f"{fixed(row['mean'])} ({fixed(row['sd'])})"
        people.setdefault(key, set()).add(int(row["n"]))
    rows = [
        (
            *key,
            *(own.get(attribute, NONE) for attribute in attributes),
            " to ".join(map(str, sorted({min(people[key]), max(people[key])}))),
        )
        for key, own in cells.items()
    ]
    heads: list[str | Head] = [*labels, *map(number, attributes), number("n")]
    return text_table(heads, rows)


def methods(analysis: Analysis) -> Iterator[str]:
    """Yield the paragraphs on methods that the tests of this data set need."""
    questions, ratings = analysis.statistics.questions, analysis.ratings
    kinds = {question.kind for question in questions}
    named = f" {'The factor' if len(ratings.within) == 1 else 'Factors'} within participants: {phrase(ratings.within)}."
    yield f"{MEANS}{named if ratings.within else ''} {EXACT_MEANS}"
    if kinds & {"crossed", "pooled"}:
        yield from REPEATED_MEASURES
    everyone = [question for question in questions if question.group is None]
    shared = [f"the analysis of {' × '.join(question.factors)}" for question in everyone
              if question.kind in ("crossed", "pooled")]  # fmt: skip
    shared += [f"the pairs of {question.factors[0]}" for question in everyone if question.kind == "pairs"]
    if ratings.between and shared:
        yield f"{GROUPS_APART} These are {phrase(shared)}: there everyone is one sample, whatever the group."
    if "between" in kinds:
        yield f"{BETWEEN} {describe_group_levels(analysis)}".rstrip()
    if "pairs" in kinds:
        yield PAIRS
    # Then say what was not done: adjusting across attributes, rounding p to zero, imputing.
    own = len(ratings.attributes)
    apart = f"The {own} attributes are tested one by one and p values are not adjusted across them. " if own > 1 else ""
    merged, means = averaged(ratings)
    if merged:
        imputed = f"No value is imputed, but {merged:,} ratings that shared cells are replaced by {means:,} means."
    else:
        imputed = "No value is replaced or imputed, and a missing cell is never averaged away: its tests are not made."
    yield f"{apart}No p value is ever rounded to zero. {imputed}"


MEANS = (
    "Means and standard deviations are taken over participants: each participant's ratings of a level are "
    "averaged first, so that everybody counts once, and the standard deviation (n − 1) is that of these means."
)
EXACT_MEANS = "Means and standard deviations are computed in exact arithmetic and rounded once."
REPEATED_MEASURES = (
    "Factors within participants are tested by the univariate repeated-measures analysis of variance: F is the mean "
    "square of the effect over the mean square of its interaction with participants. Wherever an effect has more than "
    "one degree of freedom, p and both degrees of freedom are corrected by the epsilon of Greenhouse and Geisser "
    "(1959), always and without a test of sphericity first; the uncorrected p and that by the epsilon of Huynh and "
    "Feldt (1976) stand beside it. With fewer than d + 1 participants for an effect of d degrees of freedom the "
    "latter is undefined and left out.",
    "Two effect sizes are given, and they are not the same: partial η² is the sum of squares of the effect over that "
    "sum plus its error; generalized η² (Olejnik & Algina, 2003) divides by the sum of squares of the effect, of "
    "participants and of every error term, and so can be compared between designs.",
)
BETWEEN = (
    "Groups of participants are compared by a one-way analysis of variance of participants' means, one value for "
    "each participant; η² is the sum of squares between groups over the total."
)
PAIRS = (
    "Pairs of levels are compared by two-sided t tests of the differences within participants, each with the "
    "standard error of its own differences (n − 1 degrees of freedom). Both adjustments are shown: Bonferroni and "
    "Holm (1979); the family is the pairs of one attribute. Cohen's dz is the mean difference over the standard "
    "deviation of the differences. The confidence intervals are not adjusted."
)
