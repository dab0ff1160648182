"""The page as one HTML text: it needs nothing else and lets no other script run."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from palpate.analysis.reports.blocks import Section

TEMPLATES = Path(__file__).resolve().parent / "templates"
MOST_COLUMNS = 40


@dataclass(frozen=True)
class Page:
    """What stands on it: the title and what it says below, what has to be known first, facts, sections."""

    title: str
    lead: str
    banners: Sequence[str]
    facts: Sequence[tuple[str, str]]
    sections: Sequence[Section]


def page_html(page: Page) -> str:
    """The whole page. Every name in it is escaped."""
    from markupsafe import Markup

    from palpate.analysis.figures.interactive import script
    from palpate.analysis.reports import templates

    code = script()
    return (
        templates.environment(TEMPLATES)
        .get_template("evaluation.html")
        .render(
            title=page.title,
            lead=page.lead,
            banners=page.banners,
            facts=page.facts,
            sections=page.sections,
            css=Markup(_css()),
            script=Markup(code),
            script_hash=base64.b64encode(hashlib.sha256(code.encode()).digest()).decode(),
        )
    )


def _css() -> str:
    """The look of every report, this page's own, and on which side each column of a table stands."""
    sides = ",".join(f".n{place} td:nth-child({place})" for place in range(1, MOST_COLUMNS + 1))
    shared = (TEMPLATES / "report.css").read_text(encoding="utf-8")
    return shared + (TEMPLATES / "evaluation.css").read_text(encoding="utf-8") + sides + " { text-align: right; }\n"
