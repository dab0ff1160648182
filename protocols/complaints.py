"""Complaints about a file of settings: file, line, path and nearest valid name."""

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
    """What is wrong at a path of the study file."""

    path: Path
    message: str


MOST_SHOWN = 8
_UNION_MEMBERS = {"constrained-int", "constrained-float", "int", "float", "float-constraint"}


def listed(problems: Sequence[Problem], document: Document, name: str) -> str:
    """The problems, one line each: file, line, place and what is wrong; at most eight."""
    lines = [f"{name}:{_line(p.path, document)} {_dotted(p.path)}: {p.message}" for p in problems]
    return "\n".join(some_lines(lines, MOST_SHOWN))


def _line(path: Path, document: Document) -> str:
    while path and path not in document.lines:
        path = path[:-1]
    return f" line {document.lines[path]}:" if path else ""


def _dotted(path: Path) -> str:
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.lstrip(".") or "the file"


def translated(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """What a schema has found wrong with a file's data, in words of the file."""
    found: dict[Path, Problem] = {}
    for each in error.errors(include_url=False):
        # pydantic's location holds names of union members, which the file does not
        path = tuple(part for part in each["loc"] if part not in _UNION_MEMBERS and "[" not in str(part))
        found.setdefault(path, Problem(path, _message(dict(each), path, model)))
    return list(found.values())


def _message(each: dict[str, Any], path: Path, model: type[BaseModel]) -> str:
    found = "" if isinstance(each["input"], dict | list) else f"found {each['input']!r:.60}, "
    match each["type"]:
        case "extra_forbidden":
            return f"unknown key; {nearest(str(path[-1]), _keys_at(path[:-1], model))}"
        case "missing":
            return "this key is required"
        case "literal_error":
            return f"{found}expected {each['ctx']['expected']}; {_closest_literal(each)}"
        case "value_error":
            return str(each["ctx"]["error"])
        case _:
            return f"{found}{expectation(each)}"


def expectation(each: dict[str, Any]) -> str:
    """What pydantic expected, without its words for Python's kinds of data."""
    match each["type"]:
        case "tuple_type" | "list_type":
            return "a list is expected, as [ONE, OTHER]"
        case "dict_type" | "model_type" | "model_attributes_type" | "mapping_type":
            return "keys and values are expected, as {KEY: VALUE}"
        case "too_short":
            return f"at least {count(each['ctx']['min_length'], 'item')} expected, found {each['ctx']['actual_length']}"
        case "too_long":
            return f"at most {count(each['ctx']['max_length'], 'item')} expected"
        case _:
            return f"{each['msg'][0].lower()}{each['msg'][1:]}"


def _closest_literal(each: dict[str, Any]) -> str:
    options = each["ctx"]["expected"].replace(" or ", ", ").split(", ")
    return nearest(str(each["input"]), [option.strip("'") for option in options])


def _keys_at(path: Path, model: type[BaseModel]) -> list[str]:
    """The keys that the schema knows at a path."""
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
