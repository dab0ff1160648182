"""The questions that a lab puts to its participants, from its participants.json."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from palpate.protocols.forms import Question
from palpate.studies.participants.errors import ParticipantError
from palpate.studies.participants.sidecar import columns, level_label, sidecar_file


def questions(lab: Path | None, language: str = "en") -> tuple[Question, ...]:
    """Return a question for every column that has a `Question`, in the file's order, in a language.

    A column with `Levels` is a choice, one with `Units`, `Minimum` or `Maximum` a number, any other a text.
    Answers are voluntary unless the column says "Optional": false.
    Raises ParticipantError on a broken file or a missing translation, naming file and key.
    """
    file = sidecar_file(lab)
    asked = ((name, column) for name, column in columns(file).items() if "Question" in column)
    return tuple(question(f"{file}: {name}", name, column, language) for name, column in asked)


def question(where: str, name: str, column: dict[str, Any], language: str = "en") -> Question:
    """Return one column's question; `where` is its place for messages."""
    return Question(
        name=name,
        text=_in(where, column, "Question", language),
        kind=_kind(column),
        levels=_levels(where, column, language),
        unit=_in(where, column, "Units", language) if "Units" in column else None,
        low=column.get("Minimum"),
        high=column.get("Maximum"),
        optional=column.get("Optional", True),
    )


def _kind(column: dict[str, Any]) -> Literal["number", "choice", "text"]:
    if "Levels" in column:
        return "choice"
    return "number" if {"Units", "Minimum", "Maximum"} & set(column) else "text"


def _levels(where: str, column: dict[str, Any], language: str) -> tuple[tuple[str, str], ...]:
    if "Levels" not in column:
        return ()
    labels = _in(where, column, "Levels", language)
    if set(labels) != set(column["Levels"]):
        missing = ", ".join(sorted(set(column["Levels"]) ^ set(labels)))
        raise ParticipantError(f"{where}.Levels_{language}: the same levels as in Levels are expected ({missing})")
    return tuple((level, level_label(labels[level]) or level) for level in column["Levels"])


def _in(where: str, column: dict[str, Any], key: str, language: str) -> Any:
    """Return a key's value in the language; English stands under the plain key."""
    translated = key if language == "en" else f"{key}_{language}"
    if translated not in column:
        raise ParticipantError(f"{where}.{translated}: missing; a translation of {key} is expected")
    return column[translated]
