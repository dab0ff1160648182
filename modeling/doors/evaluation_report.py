"""The report of an evaluation of doors: one HTML file."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.analysis.reports.figures import DrawnFigure
from palpate.analysis.reports.page import EVALUATION, Page, page_html
from palpate.modeling.doors.evaluation import DoorEvaluation
from palpate.modeling.doors.evaluation_forward import forward_section
from palpate.modeling.doors.evaluation_inverse import inverse_section
from palpate.modeling.doors.evaluation_parts import banners, facts, in_short, measured_section, provenance
from palpate.modeling.doors.evaluation_words import LEAD

TITLE = "Car doors: how well feelings are predicted, and profiles made"


def report_html(evaluation: DoorEvaluation, pictured: Sequence[DrawnFigure] = ()) -> str:
    """The whole page as one text. Every name in it is escaped."""
    sections = (
        in_short(evaluation), forward_section(evaluation, pictured), inverse_section(evaluation, pictured),
        measured_section(evaluation, pictured), provenance(evaluation),
    )  # fmt: skip
    whole = [section for section in sections if section is not None]
    return page_html(Page(TITLE, LEAD, banners(evaluation), facts(evaluation), whole), EVALUATION)
