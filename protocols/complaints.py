"""Error messages about a settings file, with file, line, path and the nearest valid name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count, some_lines
from palpate.protocols.yaml_text import Document, Path


@dataclass(frozen=True)
class Problem:
    """A problem at a path of the study file."""

    path: Path
    message: str


MOST_SHOWN = 8
_UNION_MEMBERS = {"constrained-int", "constrained-float", "int", "float", "float-constraint"}


def listed(problems: Sequence[Problem], document: Document, name: str) -> str:
    """Return the problems, one line each, with file, line, place and message; at most eight."""
    lines = []
    for problem in problems:
        dotted = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in problem.path).lstrip(".")
        path = problem.path
        while path and path not in document.lines:
            path = path[:-1]
        line = f" line {document.lines[path]}:" if path else ""
        lines.append(f"{name}:{line} {dotted or 'the file'}: {problem.message}")
    return "\n".join(some_lines(lines, MOST_SHOWN))


def translated(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Return the problems that a schema finds in a file's data, in the file's own terms."""
    problems: dict[Path, Problem] = {}
    for detail in error.errors(include_url=False):
        # pydantic's location holds names of union members, which the file does not
        path = tuple(part for part in detail["loc"] if part not in _UNION_MEMBERS and "[" not in str(part))
        problems.setdefault(path, Problem(path, _message(dict(detail), path, model)))
    return list(problems.values())


def _message(detail: dict[str, Any], path: Path, model: type[BaseModel]) -> str:
    found = "" if isinstance(detail["input"], dict | list) else f"found {detail['input']!r:.60}, "
    match detail["type"]:
        case "extra_forbidden":
            return f"unknown key; {nearest(str(path[-1]), _keys_at(path[:-1], model))}"
        case "missing":
            return "this key is required"
        case "literal_error":
            expected = detail["ctx"]["expected"]
            options = [option.strip("'") for option in expected.replace(" or ", ", ").split(", ")]
            return f"{found}expected {expected}; {nearest(str(detail['input']), options)}"
        case "value_error":
            return str(detail["ctx"]["error"])
        case _:
            return f"{found}{expectation(detail)}"


def expectation(detail: dict[str, Any]) -> str:
    """Return what pydantic expected, without its names of Python types."""
    match detail["type"]:
        case "tuple_type" | "list_type":
            return "a list is expected, as [ONE, OTHER]"
        case "dict_type" | "model_type" | "model_attributes_type" | "mapping_type":
            return "keys and values are expected, as {KEY: VALUE}"
        case "too_short":
            least, actual = count(detail["ctx"]["min_length"], "item"), detail["ctx"]["actual_length"]
            return f"at least {least} expected, found {actual}"
        case "too_long":
            return f"at most {count(detail['ctx']['max_length'], 'item')} expected"
        case _:
            return f"{detail['msg'][0].lower()}{detail['msg'][1:]}"


def _keys_at(path: Path, model: type[BaseModel]) -> list[str]:
    """Return the keys that the schema knows at a path."""
    for part in path:
        field = model.model_fields.get(str(part))
        inner = _model_in(field.annotation) if field is not None else None
        model = inner or model
    aliases: dict[str, Any] = {name: field.validation_alias for name, field in model.model_fields.items()}
    return [name if alias is None else alias.choices[0] for name, alias in aliases.items()]


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in get_args(annotation):
        if (model := _model_in(argument)) is not None:
            return model
    return None
