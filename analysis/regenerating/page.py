"""The report of a regenerated study: each test as a table with its method as text, and the page with all of them.

The page is one self-contained HTML file with interactive figures.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby

from palpate.analysis.crosschecking.checks import difference_text, disagreements, line_of, sentence
from palpate.analysis.figures.interactive import figure_markup
from palpate.analysis.figures.style import inline_svg
from palpate.analysis.plans.answers import QuestionResult, Row
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.plans.reading import AnalysisPlan
from palpate.analysis.ratings.dataset import Exclusion, Input
from palpate.analysis.ratings.sample import sample_facts
from palpate.analysis.ratings.session_choice import SessionRow
from palpate.analysis.regenerating.regeneration import RegeneratedStudy
from palpate.analysis.reports.figures import DrawnFigure
from palpate.analysis.reports.page import (
    REGENERATED,
    SIMULATED,
    Block,
    FigureBlock,
    Folded,
    Heading,
    Legend,
    Page,
    Points,
    Section,
    TableBlock,
    Words,
    bold,
    caption,
    fill_in,
    italic,
    long_table,
    page_html,
)
from palpate.analysis.reports.tables import Head, NumberedTable, Table, text_table, value_table
from palpate.protocols.canonical import parse
from palpate.protocols.wording import count

ONSET = {"p50": "p50_ms", "p99": "p99_ms", "maximum": "most_ms"}
BRIEF = 50
"""The most letters of a sentence that fits half a line."""
MOST_AT_ONCE = 3
"""The most outcomes of a test that are shown; the others are folded."""
HOW_TO_USE = (
    "Point at a mark to read its numbers. Click it, or a row of a table, to find the same one in every figure and "
    "table; Escape ends this. With the keyboard: Tab to a figure or table, arrow keys from mark to mark, Enter to "
    "choose."
)
NOTHING = "nothing"
"""The text for a rule of the plan that applied to nobody."""
Point = tuple[str, tuple[str, ...]]
MOST_ROWS = 2000
"""The most rows of a test on a page; the CSV file has all."""
OUTCOME = "outcome"


def test_table(results: Sequence[QuestionResult], known: Collection[str] = ()) -> Table:
    """Return one test's rows by outcome, with notes as footnotes, and reasons of refused outcomes.

    Outcomes with one row are named in a column, outcomes with several rows by headings.
    """
    kinds = {
        name: meaning
        for result in results
        if result.answer is not None
        for name, meaning in result.answer.kinds.items()
    }
    table = partial(value_table, meanings=kinds, known=known, headings=TESTS[results[0].settings.test].headings)
    rows_of = [
        ({"note": f"Not answered: {result.refused}"},) if result.answer is None else result.answer.rows
        for result in results
    ]
    if any(result.outcome for result in results) and all(len(own) == 1 for own in rows_of):
        return table([{OUTCOME: result.outcome, **row} for result, (row,) in zip(results, rows_of, strict=True)])
    rows: list[Row] = []
    groups: dict[int, str] = {}
    for result, own in zip(results, rows_of, strict=True):
        if result.outcome:
            groups[len(rows)] = result.outcome
        rows += own[:MOST_ROWS]
    whole = table(rows)
    most = max(map(len, rows_of))
    cut = [f"The first {MOST_ROWS:,} of {most:,} rows; all of them are in the test's CSV."] * (most > MOST_ROWS)
    return replace(whole, notes=(*whole.notes, *cut), groups=groups)


def by_test(results: Sequence[QuestionResult]) -> list[tuple[QuestionResult, ...]]:
    """Return the answers of each test, in the plan's order."""
    return [tuple(own) for _, own in groupby(results, key=lambda result: result.settings.name)]


def test_name(results: Sequence[QuestionResult]) -> str:
    """Return a test's name as text."""
    name = results[0].settings.name.replace("_", " ").replace("-", " ")
    return name[:1].upper() + name[1:]


def test_kind(results: Sequence[QuestionResult]) -> str:
    """Return the kind of a test as text, "" if its name already says it."""
    title = TESTS[results[0].settings.test].title
    return "" if title.lower() == test_name(results).lower() else title


def test_title(results: Sequence[QuestionResult]) -> str:
    """Return a test's name as text, with its kind if the name does not say it."""
    name, kind = test_name(results), test_kind(results)
    return f"{name}: {kind}" if kind else name


def method_of(results: Sequence[QuestionResult]) -> str:
    """Return the method of the first outcome with an answer, "" if none has one."""
    method = next((result.answer.method for result in results if result.answer is not None), "")
    return method if not method or method.endswith(".") else f"{method}."


def notes_of(results: Sequence[QuestionResult]) -> tuple[str, ...]:
    """Return the answers' notes without duplicates; a note on some outcomes only names them."""
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
    """Return how many participants and values the answers use, and what was missing, as text."""
    answers = [result.answer for result in results if result.answer is not None]
    if not answers:
        return ""
    people = _range_text([answer.participants for answer in answers])
    values = _range_text([answer.values for answer in answers])
    gaps = dict.fromkeys(result.missing.text() for result in results if result.missing.text())
    first = f"{people} participants, {values} values{' for each outcome' * (len(answers) > 1)}."
    return " ".join([first, *(f"Missing: {text}." for text in gaps)])


def _range_text(numbers: Sequence[int]) -> str:
    """Return the least and the greatest of some numbers as text; one number if they are equal."""
    least, most = min(numbers), max(numbers)
    return f"{least:,}" if least == most else f"{least:,} to {most:,}"


def numbered_tables(study: RegeneratedStudy) -> Iterator[NumberedTable]:
    """Yield each test as a table for a manuscript, in the plan's order, with qualifications of its numbers below."""
    qualified = tuple(" ".join(note.split()) for note in study.notes)
    for number, answered in enumerate(by_test(study.answered), start=1):
        table = test_table(answered)
        about = " ".join(filter(None, (method_of(answered), rests_on(answered))))
        notes = (*table.notes, *([about] if about else []), *qualified)
        yield NumberedTable(number, answered[0].settings.name, test_title(answered), table, notes)


def report_html(study: RegeneratedStudy, drawings: Sequence[DrawnFigure | None], seconds: float) -> str:
    """Return the whole page as HTML; equal inputs give equal texts. Every name in it is escaped."""
    return page_html(page_of(study, drawings, seconds), REGENERATED)


def page_of(study: RegeneratedStudy, drawings: Sequence[DrawnFigure | None], seconds: float) -> Page:
    """Return the page of a regenerated study; `seconds` is the total time of its answers."""
    figures = tuple(_figures(study, drawings))
    disagree = [f"Another package disagrees. {check.text()}" for check in disagreements(study.checks)]
    inputs = _inputs(study.inputs)
    provenance: tuple[Block, ...] = (
        Words(
            "Every number on this page comes from these inputs. The same inputs give the same page, byte for byte. "
            f"The answers took {seconds_text(seconds)} when they were first computed here."
        ),
        *long_table(inputs, f"All {len(inputs.rows):,} inputs and their SHA-256", "statistics.json"),
        Heading("Software"),
        TableBlock(text_table(("package", "version"), study.software.items())),
    )
    lead = "Regenerated from the recorded sessions of {} by its analysis plan."
    # The sentences of every test that states its result in one.
    results: list[Block] = []
    ratings = study.material.ratings
    stated = [(test, points) for test in by_test(study.answered)
              if (points := tuple(headlines(test, {} if ratings is None else ratings.antonyms)))]  # fmt: skip
    if not stated:
        results.append(Words("No test of the plan states a result in one sentence; their tables stand below."))
    for test, points in stated:
        results.append(Heading(test_name(test), about=test_kind(test), link=f"test-{test[0].settings.name}"))
        brief = all(len(parts) == 1 and len(parts[0]) <= BRIEF for _, parts in points)
        at_once = len(points) if brief or len(points) <= MOST_AT_ONCE + 1 else MOST_AT_ONCE
        results.append(Points(points[:at_once], brief and len(points) > 2))
        if rest := points[at_once:]:
            results.append(Folded(f"{len(rest)} more outcomes", (Points(rest),)))
    return Page(
        title=study.title,
        lead=fill_in(lead, italic(study.material.name)),
        banners=(*([SIMULATED] if study.material.simulated else []), *disagree),
        facts=facts(study),
        sections=(
            *([Section("figures", "Figures", figures)] if figures else []),
            Section("results", "Results", tuple(results)),
            Section("tests", "Tests", tuple(_tests(study, mark_keys(drawings)))),
            Section("data", "Data and exclusions", tuple(_data(study))),
            Section("provenance", "Provenance", provenance),
        ),
    )


def mark_keys(drawings: Sequence[DrawnFigure | None]) -> frozenset[str]:
    """Return the keys of the marks in the figures."""
    return frozenset(mark.key for drawing in drawings if drawing is not None for mark in drawing.marks if mark.key)


def _figures(study: RegeneratedStudy, drawings: Sequence[DrawnFigure | None]) -> Iterator[Block]:
    """Yield every figure that could be drawn, with its numbers, and the reasons for the others."""
    drawn = [(place, figure.data, drawing) for place, (figure, drawing)
             in enumerate(zip(study.figures, drawings, strict=True), start=1)
             if figure.data is not None and drawing is not None]  # fmt: skip
    if drawn:
        yield Words(HOW_TO_USE, "note how")
    for number, (place, data, drawing) in enumerate(drawn, start=1):
        name, title, prefix = drawing.name, drawing.title, f"f{place}"
        markup = figure_markup(inline_svg(drawing.svg, prefix), drawing.marks, prefix, title)
        numbers = TableBlock(value_table(data.rows, known=mark_keys([drawing]), without=""))
        below = (
            Folded("The numbers behind this figure", (numbers,), "long"),
            Words(f"Its numbers stand in figures/{name}.csv.", "on-paper note"),
        )
        yield FigureBlock(f"figure-{name}", f"Figure {number}. {title}.", caption(data.caption), markup, blocks=below)
    for figure in study.figures:
        if figure.data is None:
            yield Words(fill_in("{} is not drawn: {}", bold(figure.settings.name), figure.refused))


def headlines(test: Sequence[QuestionResult], antonyms: Mapping[str, str]) -> Iterator[Point]:
    """Yield each outcome with its sentence in parts, named by both poles, as its name may be the low pole's only."""
    for answered in test:
        outcome = answered.outcome
        label = f"{outcome} → {antonyms[outcome]}" if outcome in antonyms else outcome
        if answered.answer is None:
            yield label, (f"Not answered: {answered.refused}",)
        elif answered.answer.headline:
            yield label, parts_of(answered.answer.headline)


def parts_of(headline: str) -> tuple[str, ...]:
    """Return a sentence's results one by one, with their semicolons; text in brackets is not divided."""
    parts: list[str] = []
    for part in headline.split("; "):
        opened = parts and sum(map(parts[-1].count, "([")) > sum(map(parts[-1].count, ")]"))
        if opened:
            parts[-1] = f"{parts[-1]}; {part}"
        else:
            parts.append(part)
    return (*(f"{part};" for part in parts[:-1]), parts[-1])


def _tests(study: RegeneratedStudy, known: Collection[str]) -> Iterator[Block]:
    """Yield every test: its method, its data, its table; `known` are the keys of the figures' marks."""
    yield Words("Every number is unrounded in statistics.json, and each test has its own table in the folder tests.")
    for test in by_test(study.answered):
        name = test[0].settings.name
        yield Heading(test_name(test), f"test-{name}", test_kind(test))
        checked = line_of([check for check in study.checks or () if check.test == name])
        words = ((method_of(test), ""), (rests_on(test), "lead"), (checked, "note"))
        yield from (Words(text, look) for text, look in words if text)
        yield from (Words(note, "lead") for note in notes_of(test))
        table = test_table(test, known)
        yield from long_table(table, f"All {len(table.rows):,} rows", f"tests/{name}.csv")
        if table.legend:
            yield Folded("What the columns are", (Legend(table),), "legend")
    yield Heading("A second opinion", "second-opinion")
    yield Words(sentence(study.checks))
    if study.checks:
        heads = (
            *("test", "outcome", Head("checked with", "words"), Head("numbers", "number")),
            "largest relative difference",
        )
        rows = [
            (check.test, check.outcome, check.checked_with(), str(check.numbers or ""), difference_text(check))
            for check in study.checks
        ]
        yield Folded("Every answer: what it was checked with", (TableBlock(text_table(heads, rows)),))


def _data(study: RegeneratedStudy) -> Iterator[Block]:
    yield from map(Words, declared(study))
    if study.material.versions:
        yield Words("The sessions were not all recorded with the same version of the study and its models.", "banner")
        yield TableBlock(_inputs(study.material.versions))
    yield from (Words(note, "lines") for note in study.notes)
    yield Heading("Exclusion ledger")
    ledger = left_out(study.exclusions)
    yield TableBlock(ledger.reasons) if ledger.reasons.rows else Words("Nothing was left out.")
    if ledger.lines.rows:
        yield Folded("Line by line: whose, and how many", (TableBlock(ledger.lines),))


def _inputs(inputs: Iterable[Input]) -> Table:
    heads = ("input", Head("SHA-256", "hash"), Head("note", "words"))
    return text_table(heads, [(entry.name, entry.sha256, entry.note) for entry in inputs])


def facts(study: RegeneratedStudy) -> list[tuple[str, str]]:
    """Return the facts at the head of the page, as labels and texts."""
    material = study.material
    values = len(material.ratings.table) if material.ratings is not None else len(material.words)
    what = "Ratings" if material.ratings is not None else "Words"
    lines = [line for line in study.exclusions if line.what != NOTHING]
    return [
        ("Participants", f"{len(material.participants):,}"),
        *sample_facts(study.sample),
        *onset_facts(material.sessions),
        ("Trials", f"{len(material.trials):,}"),
        *([(what, f"{values:,}")] if values else []),
        ("Exclusion ledger", count(len(lines), "line") if lines else "nothing left out"),
        ("Plan, SHA-256", study.plan.sha256[:12]),
    ]


def onset_facts(sessions: Sequence[SessionRow]) -> list[tuple[str, str]]:
    """Return what the rig's certificates say of the onset of stimuli, a line for each device and certificate."""
    lines: Counter[str] = Counter()
    for session in sessions:
        for device, certificate in parse(session.certificates.encode()).items():
            times = ", ".join(f"{name} {certificate[key]:.1f} ms" for name, key in ONSET.items())
            lines[f"{device}: {times}, level {certificate['level_dB']:+.2f} dB; {certificate['date']}"] += 1
    return [("Command to onset, certified", f"{line} ({count(n, 'session')})") for line, n in sorted(lines.items())]


def declared(study: RegeneratedStudy) -> list[str]:
    """Return the plan's settings for all tests, as sentences."""
    plan: AnalysisPlan = study.plan.declared
    policies = {
        "refuse": "A test that needs a missing cell is refused.",
        "listwise": "A participant who lacks a cell is left out of the tests that need it (listwise).",
        "mixed_model": "Where cells are missing, a linear mixed model answers an analysis of variance.",
    }
    sessions = "Interrupted sessions count." if plan.sessions == "also_interrupted" else "Only complete sessions count."
    scale = "" if plan.normalise == "none" else f" Ratings are normalised: {plan.normalise.replace('_', ' ')}."
    drawn = f" What is resampled uses {plan.draws:,} draws from seed {plan.seed}."
    return [f"Significance level α = {plan.alpha:g}. {sessions} {policies[plan.missing]}{scale}{drawn}"]


def seconds_text(seconds: float) -> str:
    """Return a time with its significant digits."""
    return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.1f} s" if seconds >= 0.1 else "less than 0.1 s"


@dataclass(frozen=True)
class LeftOut:
    """The table of exclusions: one row per reason, and all lines."""

    reasons: Table
    lines: Table


def left_out(exclusions: Sequence[Exclusion]) -> LeftOut:
    """Return the exclusions by reason with counts; a rule that excluded nothing is included."""
    lines = [(line.what, line.who, line.why, f"{line.rows:,}") for line in exclusions if line.what != NOTHING]
    together: dict[tuple[str, str], list[Exclusion]] = {}
    for line in exclusions:
        together.setdefault((line.why, line.what), []).append(line)
    reasons = [
        (why, "met nothing", "0", "0")
        if what == NOTHING
        else (why, what, f"{len(own):,}", f"{sum(line.rows for line in own):,}")
        for (why, what), own in together.items()
    ]
    return LeftOut(
        text_table((Head("why", "words"), "what", Head("lines", "number"), Head("rows", "number")), reasons),
        text_table(("what", "whose", Head("why", "words"), Head("rows", "number")), lines),
    )
