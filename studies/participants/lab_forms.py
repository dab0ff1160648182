"""What a lab puts before every participant of a study that opens with it. Imports no database."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from palpate.protocols.did_you_mean import nearest
from palpate.protocols.forms import LabForms
from palpate.protocols.study import Study
from palpate.studies.participants.consent import consent_text, demand_filled
from palpate.studies.participants.questions import questions


def lab_forms(study: Study, lab: Path, live: bool, language: str = "en") -> LabForms | None:
    """Return the lab's consent text and questions, where the study opens with them; a real session's must be filled in.

    Of the lab's questions the study asks those that it names, all where it names none.
    """
    if not study.opening:
        return None
    if live and "consent" in study.opening:
        demand_filled(lab, language)
    wanted = study.questions
    asked = tuple(one for one in questions(lab, language) if wanted is None or one.name in wanted)
    return LabForms(consent_text(lab, language), asked)


def unasked_questions(study: Study, lab: Path) -> Iterator[str]:
    """Yield a sentence for each question that the study names and the lab does not have."""
    if study.questions is None:
        return
    known = [question.name for question in questions(lab)]
    for name in study.questions:
        if name not in known:
            yield f"the lab has no question {name!r}, so it is not asked; {nearest(name, known)}"
