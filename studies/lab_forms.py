"""What a lab puts before every participant of a study that opens with it. Imports no database."""

from __future__ import annotations

from pathlib import Path

from protocols.forms import LabForms
from protocols.study import Study
from studies.participants.consent import consent_text, demand_filled
from studies.participants.questions import questions


def lab_forms(study: Study, lab: Path, live: bool, language: str = "en") -> LabForms | None:
    """The lab's consent text and questions, where the study opens with them; a real session's must be filled in.

    Of the lab's questions the study asks those that it names, all where it names none.
    """
    if not study.opening:
        return None
    if live and "consent" in study.opening:
        demand_filled(lab, language)
    wanted = study.questions
    asked = tuple(one for one in questions(lab, language) if wanted is None or one.name in wanted)
    return LabForms(consent_text(lab, language), asked)
