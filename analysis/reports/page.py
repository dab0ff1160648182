"""A page of a report: its blocks (words, tables, figures, folded parts) in sections, and the page as one HTML text.

Blocks are data without HTML. The HTML is self-contained, every name in it is escaped, no other script runs.
"""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from palpate.analysis.figures.interactive import key_text, script
from palpate.analysis.reports.tables import Emphasis, Head, Table, written

if TYPE_CHECKING:
    from jinja2 import Environment

TEMPLATES = Path(__file__).resolve().parent / "templates"
SIMULATED = (
    "Simulated participants: no person gave these answers. They show that the study and its analysis work, "
    "nothing about how anything feels."
)
MOST_COLUMNS = 40
"""The number of columns above which numbers are aligned left."""
Row = Mapping[str, Any]
LONG_TABLE = 12
"""The number of rows above which a table is folded."""
LONG_ON_PAPER = 60
"""The number of rows above which a folded table is not printed if a file has it."""
SHORT_CAPTION = 260
"""The most letters of a caption that is shown as a whole."""
_SENTENCE = re.compile(r"(?<=\.)\s+(?=[A-Z])")


@dataclass(frozen=True)
class Words:
    """A paragraph; `look` is a class of the style sheet."""

    kind: ClassVar[str] = "words"
    text: str
    look: str = ""


@dataclass(frozen=True)
class Heading:
    """A heading within a section: `about` is beside it in grey, `link` is the anchor that it refers to."""

    kind: ClassVar[str] = "heading"
    text: str
    anchor: str = ""
    about: str = ""
    link: str = ""


@dataclass(frozen=True)
class Points:
    """Statements, each with its label and one text or several parts; in two columns if they are `brief`."""

    kind: ClassVar[str] = "points"
    points: tuple[tuple[str, str | tuple[str, ...]], ...]
    brief: bool = False


@dataclass(frozen=True)
class Sentences:
    """A list of sentences."""

    kind: ClassVar[str] = "sentences"
    lines: tuple[str, ...]


@dataclass(frozen=True)
class Preformatted:
    """A text with preserved line breaks."""

    kind: ClassVar[str] = "preformatted"
    text: str


@dataclass(frozen=True)
class TableBlock:
    """A table; with a title it is set apart with its `note` below, or opened by the title if it is folded."""

    kind: ClassVar[str] = "table"
    table: Table
    title: str | None = None
    note: str = ""
    folded: bool = False


@dataclass(frozen=True)
class Legend:
    """The meanings of a table's columns."""

    kind: ClassVar[str] = "legend"
    table: Table


@dataclass(frozen=True)
class Folded:
    """Blocks that open by a click on their summary; `look` is a class of the style sheet."""

    kind: ClassVar[str] = "folded"
    summary: str
    blocks: tuple[Block, ...]
    look: str = ""


@dataclass(frozen=True)
class Caption:
    """The visible text below a figure, and the text that opens by a click ("" for none)."""

    first: str
    rest: str = ""


@dataclass(frozen=True)
class FigureBlock:
    """A figure's drawing with its title and caption; `blocks` are below, `file` is named beside the caption."""

    kind: ClassVar[str] = "figure"
    anchor: str
    title: str
    caption: Caption
    markup: Any
    file: str = ""
    blocks: tuple[Block, ...] = ()


Block = Words | Heading | Points | Sentences | Preformatted | TableBlock | Legend | Folded | FigureBlock


@dataclass(frozen=True)
class Section:
    """A part of the page with its place in the navigation."""

    anchor: str
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Column:
    """A column of values: its name in the rows, its heading, its format, its meaning."""

    name: str
    heading: str
    form: str = "text"
    meaning: str = ""
    better: str = ""
    """"low" or "high": which of the column's numbers is set in bold."""


def table(
    title: str, rows: Sequence[Row], columns: Sequence[Column], *, note: str = "", folded: bool = False,
    ours: str | None = None, theirs: Sequence[str] = (),
) -> TableBlock:  # fmt: skip
    """Return the rows as a table; `ours` is the highlighted method, `theirs` are others' columns.

    A `printed` row has somebody else's numbers: it is marked as such and does not count for the best number.
    """
    used = [column for column in columns if any(row.get(column.name) is not None for row in rows)]
    heads = tuple(
        Head(column.heading, column.form if column.form in ("text", "words") else "number", column.name, column.meaning)
        for column in used
    )
    cells = tuple(tuple(written(row.get(column.name), column.form) for column in used) for row in rows)
    best: set[tuple[int, int]] = set()  # the cells of a column that hold its best number, as written
    for place, column in enumerate(used):
        own = [(i, row.get(column.name)) for i, row in enumerate(rows) if column.better and not row.get("printed")]
        values = {i: value for i, value in own if value is not None}
        if len(values) > 1:  # else there is nothing to compare
            text = written((min if column.better == "low" else max)(values.values()), column.form)
            best |= {(i, place) for i, value in values.items() if written(value, column.form) == text}
    emphasis = Emphasis(
        frozenset(i for i, row in enumerate(rows) if ours is not None and row.get("method") == ours),
        frozenset(best),
        frozenset(j for j, column in enumerate(used) if column.name in theirs),
        frozenset(i for i, row in enumerate(rows) if row.get("printed")),
    )
    return TableBlock(Table(heads, cells, emphasis=emphasis), title, note, folded)


def long_table(content: Table, summary: str, file: str = "") -> tuple[Block, ...]:
    """Return a table, folded under the summary if it is long; on paper the `file` with its rows is named instead."""
    rows = len(content.rows)
    if rows <= LONG_TABLE:
        return (TableBlock(content),)
    left_to_file = rows > LONG_ON_PAPER and bool(file)
    folded = Folded(summary, (TableBlock(content),), "long" if left_to_file else "")
    return (folded, Words(f"The {rows:,} rows stand in {file}.", "on-paper note")) if left_to_file else (folded,)


def caption(text: str) -> Caption:
    """Return a short caption as a whole; of a long one the sentences that fit, at least one, and the rest."""
    if len(text) <= SHORT_CAPTION:
        return Caption(text)
    first, *rest = _SENTENCE.split(text)
    while rest and len(first) + 1 + len(rest[0]) <= SHORT_CAPTION:
        first = f"{first} {rest.pop(0)}"
    return Caption(first, " ".join(rest))


def fill_in(text: str, *parts: Any) -> Any:
    """Return the text with each {} replaced by a part: escaped, or marked up by `italic` and `bold`."""
    from markupsafe import Markup, escape

    return Markup(escape(text)).format(*parts)


def italic(text: str) -> Any:
    """Return a text in italics."""
    from markupsafe import Markup

    return Markup("<i>{}</i>").format(text)


def bold(text: str) -> Any:
    """Return a text in bold."""
    from markupsafe import Markup

    return Markup("<b>{}</b>").format(text)


@dataclass(frozen=True)
class Page:
    """The content of a page: the title and the text below, warnings, facts, sections."""

    title: str
    lead: str
    banners: Sequence[str]
    facts: Sequence[tuple[str, str]]
    sections: Sequence[Section]


@dataclass(frozen=True)
class Look:
    """The style of a kind of page: its style sheets, whether its marks are interactive, the text of its tab."""

    sheets: tuple[str, ...]
    interactive: bool = True
    tab: str = "{title}"


STILL = Look(("report.css",), interactive=False, tab="{title}: report")
REGENERATED = Look(("report.css", "interactive.css", "regenerated.css"), tab="{title}: report")
EVALUATION = Look(("report.css", "interactive.css", "evaluation.css"))


def page_html(page: Page, look: Look) -> str:
    """Return the whole page as one HTML text; equal pages give equal texts."""
    from markupsafe import Markup

    code = script() if look.interactive else ""
    css = style(look.sheets)
    if look.interactive:
        numbers = ",".join(f".n{place} td:nth-child({place})" for place in range(1, MOST_COLUMNS + 1))
        css += Markup(f"{numbers} {{ text-align: right; }}\n")
    template = environment(TEMPLATES, helpers={"key_text": key_text}).get_template("page.html")
    return template.render(
        page=page,
        tab=look.tab.format(title=page.title),
        css=css,
        script=Markup(code),
        script_hash=base64.b64encode(hashlib.sha256(code.encode()).digest()).decode(),
    )


def style(sheets: Iterable[str], *own: Path) -> Any:
    """Return style sheets of the kit and a page's own as one text of markup."""
    from markupsafe import Markup

    paths = (*(TEMPLATES / name for name in sheets), *own)
    return Markup("".join(path.read_text(encoding="utf-8") for path in paths))


def environment(
    *folders: Path, helpers: Mapping[str, Any] | None = None, filters: Mapping[str, Callable[..., str]] | None = None
) -> Environment:
    """Return Jinja over the folders in order of priority: all values are escaped, and none may be missing."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    jinja = Environment(
        loader=FileSystemLoader(folders),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    jinja.globals.update(helpers or {})
    jinja.filters.update(filters or {})
    return jinja
