"""The report of an evaluation: one HTML file that needs nothing else and lets no other script run."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from pathlib import Path

from modeling.doors.evaluating_whole import Evaluation
from modeling.doors.evaluation_drawn import Pictured
from modeling.doors.evaluation_forward import forward_section
from modeling.doors.evaluation_inverse import inverse_section
from modeling.doors.evaluation_parts import banners, facts, in_short, measured_section, provenance
from modeling.doors.evaluation_words import LEAD

HERE = Path(__file__).parent
MOST_COLUMNS = 40
TITLE = "Car doors: how well feelings are predicted, and profiles made"


def report_html(found: Evaluation, pictured: Sequence[Pictured] = ()) -> str:
    """The whole page as one text. Every name in it is escaped."""
    from markupsafe import Markup

    from analysis.figures.interactive import script
    from analysis.reporting import templates

    code = script()
    sections = (
        in_short(found), forward_section(found, pictured), inverse_section(found, pictured),
        measured_section(found, pictured), provenance(found),
    )  # fmt: skip
    return (
        templates.environment(HERE)
        .get_template("evaluation.html")
        .render(
            title=TITLE,
            lead=LEAD,
            banners=banners(found),
            facts=facts(found),
            sections=[section for section in sections if section is not None],
            css=Markup(_css(Path(templates.__file__).parent)),
            script=Markup(code),
            script_hash=base64.b64encode(hashlib.sha256(code.encode()).digest()).decode(),
        )
    )


def _css(reporting: Path) -> str:
    """The look of every report, this page's own, and on which side each column of a table stands."""
    sides = ",".join(f".n{place} td:nth-child({place})" for place in range(1, MOST_COLUMNS + 1))
    shared = (reporting / "templates" / "report.css").read_text(encoding="utf-8")
    return shared + (HERE / "evaluation.css").read_text(encoding="utf-8") + sides + " { text-align: right; }\n"
