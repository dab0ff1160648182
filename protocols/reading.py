"""From the text of study.yaml to a Study, or to complaints that name file, line, path and nearest valid name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from palpate.protocols.complaints import listed, translated
from palpate.protocols.consistency import inconsistencies
from palpate.protocols.study import Study
from palpate.protocols.yaml_text import Document


class StudyError(ValueError):
    """The study file cannot be used; the message lists what is wrong, one line each."""


def study_from(document: Document, stimuli: Sequence[Mapping[str, Any]], name: str) -> Study:
    """The study in `document`, its stimulus table being `stimuli` ({id, columns, sha256} each).

    Raises StudyError with every problem found (at most eight are shown).
    """
    if not isinstance(document.data, dict):
        raise StudyError(f"{name}: keys and values are expected at the top, e.g. study: NAME")
    try:
        study = Study.model_validate(_texts_as_keys(document.data) | _table(document, stimuli))
    except StudyError as error:
        raise StudyError(f"{name}: {error}") from None
    except ValidationError as error:
        raise StudyError(listed(translated(error, Study), document, name)) from None
    if problems := list(inconsistencies(study)):
        raise StudyError(listed(problems, document, name))
    return study


def _table(document: Document, stimuli: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The stimulus table in the place of its name; a file that names none lacks the key."""
    return {"stimuli": list(stimuli)} if "stimuli" in document.data else {}


def _texts_as_keys(value: Any) -> Any:
    """YAML lets a key be a number (groups: {1: ...}); a study's keys are texts."""
    if isinstance(value, dict):
        texts = {str(key): _texts_as_keys(inner) for key, inner in value.items()}
        if len(texts) < len(value):
            twice = next(key for key in value if not isinstance(key, str) and str(key) in value)
            raise StudyError(f"the keys {twice!r} and {str(twice)!r} mean the same; one of them is expected")
        return texts
    if isinstance(value, list):
        return [_texts_as_keys(inner) for inner in value]
    return value
