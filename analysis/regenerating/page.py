"""The report of a regenerated study: one HTML file that needs nothing else, its figures to be looked at closer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.figures.style import inline_svg
from analysis.plans.answers import Row
from analysis.regenerating.pictured import Picture, Pictured
from analysis.regenerating.regenerated import Regenerated
from analysis.regenerating.running import Answered
from analysis.regenerating.shown import by_test, cell_text, heading, method_of, rests_on, test_table, test_title
from analysis.reporting.page_table import Column, Table, number, table, words
from analysis.reporting.page_text import count

TEMPLATES = Path(__file__).parent / "templates"
CSS = Path(__file__).parent.parent / "reporting" / "templates" / "report.css"


@dataclass(frozen=True)
class TestPart:
    """One test on the page: title, sentences, method, what it rests on, its table."""

    anchor: str
    title: str
    headlines: tuple[tuple[str, str], ...]
    method: str
    rests_on: str
    notes: tuple[str, ...]
    table: Table


@dataclass(frozen=True)
class FigurePart:
    """One figure on the page: its drawing, its caption, and the rows it shows, each with the key it can be found by."""

    anchor: str
    title: str
    caption: str
    markup: Any
    table: Table
    keys: tuple[str, ...]


def test_parts(found: Regenerated) -> Iterator[TestPart]:
    """The page's part for every test of the plan."""
    for answered in by_test(found.answered):
        answers = [each for each in answered if each.answer is not None]
        yield TestPart(
            anchor=f"test-{answered[0].asked.name}",
            title=test_title(answered),
            headlines=tuple(_headlines(answered)),
            method=method_of(answered),
            rests_on=rests_on(answered),
            notes=tuple(dict.fromkeys(note for each in answers if each.answer for note in each.answer.notes)),
            table=test_table(answered),
        )


def _headlines(answered: Sequence[Answered]) -> Iterator[tuple[str, str]]:
    for each in answered:
        if each.answer is None:
            yield each.outcome, f"Not answered: {each.refused}"
        elif each.answer.headline:
            yield each.outcome, each.answer.headline


def figure_parts(found: Regenerated, pictures: Sequence[Picture | None]) -> Iterator[FigurePart]:
    """The page's part for every figure that could be drawn."""
    from analysis.figures.interactive import figure_markup

    for place, (each, picture) in enumerate(zip(found.pictured, pictures, strict=True), start=1):
        if each.data is None or picture is None:
            continue
        shown, keys = _figure_table(each, picture)
        yield FigurePart(
            anchor=f"figure-{each.asked.name}",
            title=each.asked.title or each.data.title,
            caption=each.data.caption,
            markup=figure_markup(inline_svg(picture.svg, f"f{place}"), picture.marks, f"f{place}"),
            table=shown,
            keys=keys,
        )


def _figure_table(each: Pictured, picture: Picture) -> tuple[Table, tuple[str, ...]]:
    """The figure's rows as a table, and for each row the key of the marks that it belongs to ("" for none)."""
    rows: Sequence[Row] = each.data.rows if each.data is not None else ()
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = [_column(name, rows) for name in names]
    known = {mark.key for mark in picture.marks}
    keys = [next((str(value) for value in row.values() if str(value) in known), "") for row in rows]
    texts = [[cell_text(name, row.get(name)) for name in names] for row in rows]
    return table(columns, texts), tuple(keys)


def _column(name: str, rows: Sequence[Row]) -> Column:
    texts = [value for row in rows if isinstance(value := row.get(name), str)]
    if not texts:
        return number(heading(name))
    return words(heading(name)) if max(map(len, texts)) > 40 else Column(heading(name))


def report_html(found: Regenerated, pictures: Sequence[Picture | None], seconds: float) -> str:
    """The whole page as one text; the same for equal inputs. Every name in it is escaped."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    from analysis.figures.interactive import script

    environment = Environment(
        loader=FileSystemLoader([TEMPLATES, CSS.parent]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    code = script()
    return environment.get_template("regenerated.html").render(
        found=found,
        facts=facts(found),
        tests=list(test_parts(found)),
        figures=list(figure_parts(found, pictures)),
        not_drawn=[(each.asked.name, each.refused) for each in found.pictured if each.data is None],
        exclusions=_exclusions(found),
        inputs=table(("input", Column("SHA-256", "hash"), words("note")), _inputs(found)),
        software=table(("package", "version"), found.software.items()),
        declared=declared(found),
        seconds=seconds,
        css=Markup(CSS.read_text(encoding="utf-8") + (TEMPLATES / "regenerated.css").read_text(encoding="utf-8")),
        script=Markup(code),
        script_hash=_hash(code),
    )


def _hash(code: str) -> str:
    """The script's hash for the page's content policy: no other script on the page ever runs."""
    import base64
    import hashlib

    return base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()


def facts(found: Regenerated) -> list[tuple[str, str]]:
    """What stands at the head of the page."""
    material = found.material
    values = len(material.ratings.table) if material.ratings is not None else len(material.words)
    what = "ratings" if material.ratings is not None else "words"
    return [
        ("Participants", f"{len(material.participants):,}"),
        ("Trials", f"{len(material.trials):,}"),
        (what.capitalize(), f"{values:,}"),
        ("Left out", count(len(found.exclusions), "line")),
        ("Plan", found.plan.sha256[:12]),
    ]


def declared(found: Regenerated) -> list[str]:
    """What the plan fixes for all tests, in sentences."""
    plan = found.plan.declared
    told = {
        "refuse": "A test that needs a missing cell is refused.",
        "listwise": "A participant who lacks a cell is left out of the tests that need it (listwise).",
        "mixed_model": "Where cells are missing, a linear mixed model answers an analysis of variance.",
    }
    sessions = "Interrupted sessions count." if plan.sessions == "also_interrupted" else "Only complete sessions count."
    scale = "" if plan.normalise == "none" else f" Ratings are normalised: {plan.normalise.replace('_', ' ')}."
    drawn = f" What is resampled uses {plan.draws:,} draws from seed {plan.seed}."
    return [f"Significance level α = {plan.alpha:g}. {sessions} {told[plan.missing]}{scale}{drawn}"]


def _exclusions(found: Regenerated) -> Table:
    rows = [(each.what, each.who, each.why, f"{each.rows:,}") for each in found.exclusions]
    return table(("what", "whose", words("why"), number("rows")), rows)


def _inputs(found: Regenerated) -> list[tuple[str, str, str]]:
    return [(each.name, each.sha256, each.note) for each in found.inputs]
