"""The report of a regenerated study: one HTML file that needs nothing else, its figures to be looked at closer."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.analysis.crosschecking.checks import difference_text, disagreements, line_of, sentence
from palpate.analysis.figures.interactive import figure_markup, key_text, script
from palpate.analysis.figures.style import inline_svg
from palpate.analysis.ratings.dataset import Input, Ratings
from palpate.analysis.regenerating.page_data import declared, facts, left_out, seconds_told
from palpate.analysis.regenerating.pictured import Picture
from palpate.analysis.regenerating.regenerated import Regenerated
from palpate.analysis.regenerating.running import Answered
from palpate.analysis.regenerating.shown import by_test, method_of, notes_of, rests_on, test_grid, test_kind, test_name
from palpate.analysis.reports.captions import Caption, caption, parts_of
from palpate.analysis.reports.tables import Grid, Head, plain_grid, value_grid
from palpate.analysis.reports.templates import environment

TEMPLATES = Path(__file__).resolve().parent / "templates"
CSS = Path(__file__).resolve().parent.parent / "reports" / "templates" / "report.css"

BRIEF = 50
"""A sentence of no more letters than this fits half a line."""
MOST_AT_ONCE = 3
"""Of a test with more outcomes the rest is folded."""
MOST_COLUMNS = 40
"""Columns of numbers beyond this one stand on the left."""


@dataclass(frozen=True)
class Headline:
    """What one outcome of a test says in a sentence, in parts that stand below each other."""

    outcome: str
    parts: tuple[str, ...]


@dataclass(frozen=True)
class TestPart:
    """One test on the page: name, kind, sentences, method, what it rests on, its table and the table's file."""

    anchor: str
    name: str
    kind: str
    headlines: tuple[Headline, ...]
    method: str
    rests_on: str
    checked: str
    notes: tuple[str, ...]
    grid: Grid
    file: str

    @property
    def brief(self) -> bool:
        """Whether its sentences are short enough to stand in two columns, all of them."""
        return all(len(each.parts) == 1 and len(each.parts[0]) <= BRIEF for each in self.headlines)

    @property
    def at_once(self) -> int:
        """How many of its sentences stand on the page before the rest is opened."""
        return len(self.headlines) if self.brief or len(self.headlines) <= MOST_AT_ONCE + 1 else MOST_AT_ONCE


@dataclass(frozen=True)
class FigurePart:
    """One figure on the page: its drawing, its caption, and the rows it shows with the file that holds them."""

    anchor: str
    title: str
    caption: Caption
    markup: Any
    grid: Grid
    file: str


def test_parts(found: Regenerated, known: Collection[str] = ()) -> Iterator[TestPart]:
    """The page's part for every test of the plan; `known` are the keys of the figures' marks."""
    for answered in by_test(found.answered):
        name = answered[0].asked.name
        yield TestPart(
            anchor=f"test-{name}",
            name=test_name(answered),
            kind=test_kind(answered),
            headlines=tuple(_headlines(answered, found.material.ratings)),
            method=method_of(answered),
            rests_on=rests_on(answered),
            checked=line_of([check for check in found.checks or () if check.test == name]),
            notes=notes_of(answered),
            grid=test_grid(answered, known),
            file=f"tests/{name}.csv",
        )


def _headlines(answered: Sequence[Answered], ratings: Ratings | None) -> Iterator[Headline]:
    """The sentences; an outcome is shown with both poles, as its name alone may be that of the low one."""
    antonyms = {} if ratings is None else ratings.antonyms
    for each in answered:
        outcome = f"{each.outcome} → {antonyms[each.outcome]}" if each.outcome in antonyms else each.outcome
        if each.answer is None:
            yield Headline(outcome, (f"Not answered: {each.refused}",))
        elif each.answer.headline:
            yield Headline(outcome, parts_of(each.answer.headline))


def figure_parts(found: Regenerated, pictures: Sequence[Picture | None]) -> Iterator[FigurePart]:
    """The page's part for every figure that could be drawn."""
    for place, (each, picture) in enumerate(zip(found.pictured, pictures, strict=True), start=1):
        if each.data is None or picture is None:
            continue
        title = (each.asked.title or each.data.title).rstrip(".")
        prefix = f"f{place}"
        yield FigurePart(
            anchor=f"figure-{each.asked.name}",
            title=title,
            caption=caption(each.data.caption),
            markup=figure_markup(inline_svg(picture.svg, prefix), picture.marks, prefix, title),
            grid=value_grid(each.data.rows, known=mark_keys([picture]), without=""),
            file=f"figures/{each.asked.name}.csv",
        )


def mark_keys(pictures: Sequence[Picture | None]) -> frozenset[str]:
    """What can be chosen in the figures."""
    return frozenset(mark.key for picture in pictures if picture is not None for mark in picture.marks if mark.key)


def report_html(found: Regenerated, pictures: Sequence[Picture | None], seconds: float) -> str:
    """The whole page as one text; the same for equal inputs. Every name in it is escaped."""
    from markupsafe import Markup

    code = script()
    return (
        environment(TEMPLATES, CSS.parent)
        .get_template("regenerated.html")
        .render(
            found=found,
            facts=facts(found),
            tests=list(test_parts(found, mark_keys(pictures))),
            figures=list(figure_parts(found, pictures)),
            not_drawn=[(each.asked.name, each.refused) for each in found.pictured if each.data is None],
            left_out=left_out(found.exclusions),
            disagreements=[check.text() for check in disagreements(found.checks)],
            second_opinion=sentence(found.checks),
            checks=_checks(found),
            inputs=_inputs(found.inputs),
            versions=_inputs(found.material.versions),
            software=plain_grid(("package", "version"), found.software.items()),
            declared=declared(found),
            seconds=seconds_told(seconds),
            key_text=key_text,
            css=Markup(_css()),
            script=Markup(code),
            script_hash=_hash(code),
        )
    )


def _css() -> str:
    """The look of every report, this page's own, and on which side each column of a table stands."""
    sides = ",".join(f".n{place} td:nth-child({place})" for place in range(1, MOST_COLUMNS + 1))
    own = (TEMPLATES / "regenerated.css").read_text(encoding="utf-8")
    return CSS.read_text(encoding="utf-8") + own + sides + " { text-align: right; }\n"


def _hash(code: str) -> str:
    """The script's hash for the page's content policy: no other script on the page ever runs."""
    import base64
    import hashlib

    return base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()


def _checks(found: Regenerated) -> Grid:
    heads = ("test", "outcome", Head("checked with", "words"), Head("numbers", "number"), "largest relative difference")
    rows = [
        (check.test, check.outcome, check.checked_with(), str(check.numbers or ""), difference_text(check))
        for check in found.checks or ()
    ]
    return plain_grid(heads, rows)


def _inputs(inputs: Iterable[Input]) -> Grid:
    heads = ("input", Head("SHA-256", "hash"), Head("note", "words"))
    return plain_grid(heads, [(each.name, each.sha256, each.note) for each in inputs])
