"""The page as one HTML text: it needs nothing else, every name in it is escaped, and no other script runs."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.analysis.figures.interactive import key_text, script
from palpate.analysis.reports.blocks import Section

if TYPE_CHECKING:
    from jinja2 import Environment

TEMPLATES = Path(__file__).resolve().parent / "templates"
SIMULATED = (
    "Simulated participants: no person gave these answers. They show that the study and its analysis work, "
    "nothing about how anything feels."
)
MOST_COLUMNS = 40
"""Columns of numbers beyond this one stand on the left."""


@dataclass(frozen=True)
class Page:
    """What stands on it: the title and the text below, what has to be known first, facts, sections."""

    title: str
    lead: str
    banners: Sequence[str]
    facts: Sequence[tuple[str, str]]
    sections: Sequence[Section]


@dataclass(frozen=True)
class Look:
    """How a kind of page is set: its style sheets, whether its marks answer to the pointer, what its tab says."""

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
    """Return style sheets of the kit and a page's own as one text, which is markup."""
    from markupsafe import Markup

    paths = (*(TEMPLATES / name for name in sheets), *own)
    return Markup("".join(path.read_text(encoding="utf-8") for path in paths))


def environment(
    *folders: Path, helpers: Mapping[str, Any] | None = None, filters: Mapping[str, Callable[..., str]] | None = None
) -> Environment:
    """Return Jinja over the folders, the first one first: all that is filled in is escaped, nothing may be missing."""
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
