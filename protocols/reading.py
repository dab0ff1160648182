"""From the text of study.yaml to a Study, or to complaints that name file, line, path and nearest valid name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from protocols.consistency import inconsistencies
from protocols.did_you_mean import nearest
from protocols.problems import Problem
from protocols.study import Study
from protocols.yaml_text import Document, Path

MOST_SHOWN = 8


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
    except ValidationError as error:
        raise StudyError(_listed(_translated(error), document, name)) from None
    if problems := list(inconsistencies(study)):
        raise StudyError(_listed(problems, document, name))
    return study


def _table(document: Document, stimuli: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The stimulus table in the place of its name; a file that names none lacks the key."""
    return {"stimuli": list(stimuli)} if "stimuli" in document.data else {}


def _texts_as_keys(value: Any) -> Any:
    """YAML lets a key be a number (groups: {1: ...}); a study's keys are texts."""
    if isinstance(value, dict):
        return {str(key): _texts_as_keys(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_texts_as_keys(inner) for inner in value]
    return value


def _listed(problems: Sequence[Problem], document: Document, name: str) -> str:
    lines = [f"{name}:{_line(p.path, document)} {_dotted(p.path)}: {p.message}" for p in problems[:MOST_SHOWN]]
    if len(problems) > MOST_SHOWN:
        lines.append(f"... and {len(problems) - MOST_SHOWN} more")
    return "\n".join(lines)


def _line(path: Path, document: Document) -> str:
    while path and path not in document.lines:
        path = path[:-1]
    return f" line {document.lines[path]}:" if path else ""


def _dotted(path: Path) -> str:
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.lstrip(".") or "the file"


def _translated(error: ValidationError) -> list[Problem]:
    found: dict[Path, Problem] = {}
    for each in error.errors(include_url=False):
        path = _file_path(tuple(each["loc"]))
        found.setdefault(path, Problem(path, _message(dict(each), path)))
    return list(found.values())


def _file_path(loc: Path) -> Path:
    """pydantic's location without the names of union members, which the file does not hold."""
    members = {"constrained-int", "constrained-float", "int", "float", "float-constraint"}
    return tuple(part for part in loc if part not in members and "[" not in str(part))


def _message(each: dict[str, Any], path: Path) -> str:
    found = "" if isinstance(each["input"], dict | list) else f"found {each['input']!r:.60}, "
    match each["type"]:
        case "extra_forbidden":
            return f"unknown key; {nearest(str(path[-1]), _keys_at(path[:-1]))}"
        case "missing":
            return "this key is required"
        case "literal_error":
            return f"{found}expected {each['ctx']['expected']}; {_closest_literal(each)}"
        case "value_error":
            return str(each["ctx"]["error"])
        case _:
            return f"{found}{each['msg'][0].lower()}{each['msg'][1:]}"


def _closest_literal(each: dict[str, Any]) -> str:
    options = each["ctx"]["expected"].replace(" or ", ", ").split(", ")
    return nearest(str(each["input"]), [option.strip("'") for option in options])


def _keys_at(path: Path) -> list[str]:
    """The keys that the schema knows at a path."""
    model: type[BaseModel] = Study
    for part in path:
        field = model.model_fields.get(str(part))
        inner = _model_in(field.annotation) if field is not None else None
        model = inner or model
    return [alias for name, field in model.model_fields.items() for alias in _spellings(name, field)]


def _spellings(name: str, field: Any) -> list[str]:
    alias = field.validation_alias
    return [alias.choices[0]] if alias is not None else [name]


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in get_args(annotation):
        if (found := _model_in(argument)) is not None:
            return found
    return None
