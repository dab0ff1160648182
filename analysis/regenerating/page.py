"""The report of a regenerated study: one HTML file that needs nothing else, its figures to be looked at closer."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from palpate.analysis.crosschecking.checks import difference_text, disagreements, line_of, sentence
from palpate.analysis.figures.interactive import figure_markup
from palpate.analysis.figures.style import inline_svg
from palpate.analysis.plans.schema import AnalysisPlan
from palpate.analysis.ratings.dataset import Exclusion, Input
from palpate.analysis.ratings.sample import sample_facts
from palpate.analysis.regenerating.descriptions import (
    by_test,
    method_of,
    notes_of,
    rests_on,
    test_kind,
    test_name,
    test_table,
)
from palpate.analysis.regenerating.plan_figures import Picture
from palpate.analysis.regenerating.plan_tests import Answered
from palpate.analysis.regenerating.regeneration import Regenerated
from palpate.analysis.reports.blocks import (
    Block,
    FigureBlock,
    Folded,
    Heading,
    Legend,
    Points,
    Section,
    TableBlock,
    Words,
    bold,
    caption,
    fill_in,
    italic,
    long_table,
)
from palpate.analysis.reports.page import REGENERATED, SIMULATED, Page, page_html
from palpate.analysis.reports.tables import Head, Table, text_table, value_table
from palpate.protocols.wording import count

BRIEF = 50
"""A sentence of no more letters than this fits half a line."""
MOST_AT_ONCE = 3
"""Of a test with more outcomes the rest is folded."""
HOW_TO_USE = (
    "Point at a mark to read its numbers. Click it, or a row of a table, to find the same one in every figure and "
    "table; Escape ends this. With the keyboard: Tab to a figure or table, arrow keys from mark to mark, Enter to "
    "choose."
)
NOTHING = "nothing"
"""What a rule of the plan left out that met nothing."""
Point = tuple[str, tuple[str, ...]]


def report_html(found: Regenerated, pictures: Sequence[Picture | None], seconds: float) -> str:
    """Return the whole page as one text; the same for equal inputs. Every name in it is escaped."""
    return page_html(page_of(found, pictures, seconds), REGENERATED)


def page_of(found: Regenerated, pictures: Sequence[Picture | None], seconds: float) -> Page:
    """Return the page of a regenerated study; `seconds` is the time that its answers took."""
    figures = tuple(_figures(found, pictures))
    disagree = [f"Another package disagrees. {check.text()}" for check in disagreements(found.checks)]
    lead = "Regenerated from the recorded sessions of {} by its analysis plan."
    return Page(
        title=found.title,
        lead=fill_in(lead, italic(found.material.name)),
        banners=(*([SIMULATED] if found.material.simulated else []), *disagree),
        facts=facts(found),
        sections=(
            *([Section("figures", "Figures", figures)] if figures else []),
            Section("results", "Results", tuple(_results(found))),
            Section("tests", "Tests", tuple(_tests(found, mark_keys(pictures)))),
            Section("data", "Data and exclusions", tuple(_data(found))),
            Section("provenance", "Provenance", tuple(_provenance(found, seconds))),
        ),
    )


def mark_keys(pictures: Sequence[Picture | None]) -> frozenset[str]:
    """Return what can be chosen in the figures."""
    return frozenset(mark.key for picture in pictures if picture is not None for mark in picture.marks if mark.key)


def _figures(found: Regenerated, pictures: Sequence[Picture | None]) -> Iterator[Block]:
    """Yield every figure that could be drawn, with its numbers, and why the others could not."""
    drawn = [(place, *pair) for place, pair in enumerate(zip(found.pictured, pictures, strict=True), start=1)]
    if any(each.data is not None and picture is not None for _, each, picture in drawn):
        yield Words(HOW_TO_USE, "note how")
    number = 0
    for place, each, picture in drawn:
        if each.data is None or picture is None:
            continue
        number += 1
        title, prefix = (each.asked.title or each.data.title).rstrip("."), f"f{place}"
        markup = figure_markup(inline_svg(picture.svg, prefix), picture.marks, prefix, title)
        numbers = TableBlock(value_table(each.data.rows, known=mark_keys([picture]), without=""))
        below = (
            Folded("The numbers behind this figure", (numbers,), "long"),
            Words(f"Its numbers stand in figures/{each.asked.name}.csv.", "on-paper note"),
        )
        anchor, words = f"figure-{each.asked.name}", caption(each.data.caption)
        yield FigureBlock(anchor, f"Figure {number}. {title}.", words, markup, blocks=below)
    for each in found.pictured:
        if each.data is None:
            yield Words(fill_in("{} is not drawn: {}", bold(each.asked.name), each.refused))


def _results(found: Regenerated) -> Iterator[Block]:
    """Yield the sentences of every test that states its result in one."""
    ratings = found.material.ratings
    stated = [(test, points) for test in by_test(found.answered)
              if (points := tuple(headlines(test, {} if ratings is None else ratings.antonyms)))]  # fmt: skip
    if not stated:
        yield Words("No test of the plan states a result in one sentence; their tables stand below.")
    for test, points in stated:
        yield Heading(test_name(test), about=test_kind(test), link=f"test-{test[0].asked.name}")
        brief = all(len(parts) == 1 and len(parts[0]) <= BRIEF for _, parts in points)
        at_once = len(points) if brief or len(points) <= MOST_AT_ONCE + 1 else MOST_AT_ONCE
        yield Points(points[:at_once], brief and len(points) > 2)
        if rest := points[at_once:]:
            yield Folded(f"{len(rest)} more outcomes", (Points(rest),))


def headlines(test: Sequence[Answered], antonyms: Mapping[str, str]) -> Iterator[Point]:
    """Yield each outcome and its sentence in parts; it has both poles, as its name alone may be that of the low one."""
    for answered in test:
        outcome = answered.outcome
        label = f"{outcome} → {antonyms[outcome]}" if outcome in antonyms else outcome
        if answered.answer is None:
            yield label, (f"Not answered: {answered.refused}",)
        elif answered.answer.headline:
            yield label, parts_of(answered.answer.headline)


def parts_of(headline: str) -> tuple[str, ...]:
    """Return a sentence's results one by one; their semicolons stay, and what stands in brackets stays together."""
    parts: list[str] = []
    for part in headline.split("; "):
        opened = parts and sum(map(parts[-1].count, "([")) > sum(map(parts[-1].count, ")]"))
        if opened:
            parts[-1] = f"{parts[-1]}; {part}"
        else:
            parts.append(part)
    return (*(f"{part};" for part in parts[:-1]), parts[-1])


def _tests(found: Regenerated, known: Collection[str]) -> Iterator[Block]:
    """Yield every test: its method, what it rests on, its table; `known` are the keys of the figures' marks."""
    yield Words(
        "Every number stands unrounded in statistics.json, each test in a table of its own in the folder tests."
    )
    for test in by_test(found.answered):
        name = test[0].asked.name
        yield Heading(test_name(test), f"test-{name}", test_kind(test))
        checked = line_of([check for check in found.checks or () if check.test == name])
        words = ((method_of(test), ""), (rests_on(test), "lead"), (checked, "note"))
        yield from (Words(text, look) for text, look in words if text)
        yield from (Words(note, "lead") for note in notes_of(test))
        table = test_table(test, known)
        yield from long_table(table, f"All {len(table.rows):,} rows", f"tests/{name}.csv")
        if table.legend:
            yield Folded("What the columns are", (Legend(table),), "legend")
    yield Heading("A second opinion", "second-opinion")
    yield Words(sentence(found.checks))
    if found.checks:
        yield Folded("Every answer: what it was checked with", (TableBlock(_checks(found)),))


def _checks(found: Regenerated) -> Table:
    heads = ("test", "outcome", Head("checked with", "words"), Head("numbers", "number"), "largest relative difference")
    rows = [
        (check.test, check.outcome, check.checked_with(), str(check.numbers or ""), difference_text(check))
        for check in found.checks or ()
    ]
    return text_table(heads, rows)


def _data(found: Regenerated) -> Iterator[Block]:
    yield from map(Words, declared(found))
    if found.material.versions:
        yield Words("The sessions were not all recorded with the same version of the study and its models.", "banner")
        yield TableBlock(_inputs(found.material.versions))
    yield from (Words(note, "lines") for note in found.notes)
    yield Heading("Exclusion ledger")
    ledger = left_out(found.exclusions)
    yield TableBlock(ledger.reasons) if ledger.reasons.rows else Words("Nothing was left out.")
    if ledger.lines.rows:
        yield Folded("Line by line: whose, and how many", (TableBlock(ledger.lines),))


def _provenance(found: Regenerated, seconds: float) -> Iterator[Block]:
    yield Words(
        "Every number on this page comes from these inputs. The same inputs give the same page, byte for byte. "
        f"The answers took {seconds_told(seconds)} when they were first computed here."
    )
    inputs = _inputs(found.inputs)
    yield from long_table(inputs, f"All {len(inputs.rows):,} inputs and their SHA-256", "statistics.json")
    yield Heading("Software")
    yield TableBlock(text_table(("package", "version"), found.software.items()))


def _inputs(inputs: Iterable[Input]) -> Table:
    heads = ("input", Head("SHA-256", "hash"), Head("note", "words"))
    return text_table(heads, [(each.name, each.sha256, each.note) for each in inputs])


def facts(found: Regenerated) -> list[tuple[str, str]]:
    """What stands at the head of the page."""
    material = found.material
    values = len(material.ratings.table) if material.ratings is not None else len(material.words)
    what = "Ratings" if material.ratings is not None else "Words"
    lines = [each for each in found.exclusions if each.what != NOTHING]
    return [
        ("Participants", f"{len(material.participants):,}"),
        *sample_facts(found.sample),
        ("Trials", f"{len(material.trials):,}"),
        *([(what, f"{values:,}")] if values else []),
        ("Exclusion ledger", count(len(lines), "line") if lines else "nothing left out"),
        ("Plan, SHA-256", found.plan.sha256[:12]),
    ]


def declared(found: Regenerated) -> list[str]:
    """What the plan fixes for all tests, in sentences."""
    plan: AnalysisPlan = found.plan.declared
    told = {
        "refuse": "A test that needs a missing cell is refused.",
        "listwise": "A participant who lacks a cell is left out of the tests that need it (listwise).",
        "mixed_model": "Where cells are missing, a linear mixed model answers an analysis of variance.",
    }
    sessions = "Interrupted sessions count." if plan.sessions == "also_interrupted" else "Only complete sessions count."
    scale = "" if plan.normalise == "none" else f" Ratings are normalised: {plan.normalise.replace('_', ' ')}."
    drawn = f" What is resampled uses {plan.draws:,} draws from seed {plan.seed}."
    return [f"Significance level α = {plan.alpha:g}. {sessions} {told[plan.missing]}{scale}{drawn}"]


def seconds_told(seconds: float) -> str:
    """A time with the digits that mean something."""
    return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.1f} s" if seconds >= 0.1 else "less than 0.1 s"


@dataclass(frozen=True)
class LeftOut:
    """The exclusion ledger: one row for each reason, and every line of it."""

    reasons: Table
    lines: Table


def left_out(exclusions: Sequence[Exclusion]) -> LeftOut:
    """The ledger by reason, with its counts; a rule that met nothing says so."""
    lines = [(each.what, each.who, each.why, f"{each.rows:,}") for each in exclusions if each.what != NOTHING]
    together: dict[tuple[str, str], list[Exclusion]] = {}
    for each in exclusions:
        together.setdefault((each.why, each.what), []).append(each)
    reasons = [_reason(why, what, own) for (why, what), own in together.items()]
    return LeftOut(
        text_table((Head("why", "words"), "what", Head("lines", "number"), Head("rows", "number")), reasons),
        text_table(("what", "whose", Head("why", "words"), Head("rows", "number")), lines),
    )


def _reason(why: str, what: str, own: Sequence[Exclusion]) -> tuple[str, str, str, str]:
    if what == NOTHING:
        return why, "met nothing", "0", "0"
    return why, what, f"{len(own):,}", f"{sum(each.rows for each in own):,}"
