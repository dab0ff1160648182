"""What a lab shows to every participant at the start of a study: its consent text and its questions.

Imports no database.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from palpate.protocols.did_you_mean import nearest
from palpate.protocols.forms import LabForms
from palpate.protocols.study import Study
from palpate.studies.lab import TEMPLATE, ParticipantError
from palpate.studies.participants.sidecar import questions

ON_PAPER = "<!-- on paper only -->"
_BLANK = re.compile(r"\[([^\[\]]{2,})\](?![(\[]|: *<?https?:)")
_MARKS = re.compile(r"^#+ +|\*\*|(?<!_)__(?!_)", re.MULTILINE)
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)


def lab_forms(study: Study, lab: Path, live: bool, language: str = "en") -> LabForms | None:
    """Return the lab's consent text and questions if the study opens with them; a real session's must be filled in.

    The study asks those of the lab's questions that it names, all if it names none.
    """
    if not study.opening:
        return None
    if live and "consent" in study.opening:
        demand_filled(lab, language)
    selected = study.questions
    known = questions(lab, language)
    return LabForms(
        consent_text(lab, language),
        tuple(question for question in known if selected is None or question.name in selected),
    )


def unasked_questions(study: Study, lab: Path) -> Iterator[str]:
    """Yield a sentence for each question that the study names and the lab does not have."""
    if study.questions is None:
        return
    known = [question.name for question in questions(lab)]
    for name in study.questions:
        if name not in known:
            yield f"the lab has no question {name!r}, so it is not asked; {nearest(name, known)}"


def consent_text(lab: Path | None, language: str = "en") -> str:
    """Return the consent text on the screen: the lab's consent.md (consent.ko.md for ko), else the template's.

    Paragraphs are one line each with a blank line between, without Markdown marks and without what follows the line
    <!-- on paper only -->. Raises ParticipantError where there is no text in that language.
    """
    return plain(_read(consent_file(lab, language)).partition(ON_PAPER)[0])


def consent_file(lab: Path | None, language: str = "en") -> Path:
    """Return the path of the consent text in a language.

    Raises ParticipantError where neither lab nor template has one.
    """
    name = "consent.md" if language == "en" else f"consent.{language}.md"
    places = [folder / name for folder in (lab, TEMPLATE) if folder is not None]
    for place in places:
        if place.is_file():
            return place
    raise ParticipantError(f"{places[0]}: there is no consent text in this language; write it into this file")


def demand_filled(lab: Path, language: str = "en") -> None:
    """Raise ParticipantError unless the lab has a consent text of its own without [blanks]."""
    file = consent_file(lab, language)
    if file.parent == TEMPLATE:
        raise ParticipantError(f"{lab / file.name}: no such consent text; copy {file} there and fill in its [blanks]")
    text = _read(file)
    if not plain(text.partition(ON_PAPER)[0]):
        raise ParticipantError(f"{file}: the consent text is empty")
    if blanks := unfilled(text):
        shown = ", ".join(f"[{blank}]" for blank in blanks[:4]) + (", ..." if len(blanks) > 4 else "")
        raise ParticipantError(
            f"{file}: not filled in: {shown} ({len(blanks)} in all); fill them in before the first real session"
        )


def unfilled(text: str) -> list[str]:
    """Return the [blanks] of a text in order, without brackets; links and check boxes do not count."""
    return [" ".join(found.split()) for found in _BLANK.findall(text)]


def plain(text: str) -> str:
    """Return Markdown as plain paragraphs: no marks of headings and emphasis, no comments, one line per paragraph."""
    bare = _MARKS.sub("", _COMMENT.sub("", text))
    paragraphs = (" ".join(part.split()) for part in re.split(r"\n\s*\n", bare))
    return "\n\n".join(paragraph for paragraph in paragraphs if paragraph)


def _read(file: Path) -> str:
    try:
        return file.read_text("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ParticipantError(f"{file}: byte {error.start} is not UTF-8; save the text as UTF-8") from None
