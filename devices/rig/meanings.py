"""Types and meanings of a kind's settings, in words for authors of rig files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from palpate.devices.kinds import Date, DeviceKind
from palpate.protocols.strict import Strict

EVERY = {
    "kind": "which kind of device it is",
    "driver": "what it is driven by; `twin` is simulated",
    "calibrated": "when it was last calibrated; shown by `palpate rig check` and recorded",
    "seed": "the twin's; the same seed gives the same samples",
}
"""Meanings of settings that several kinds have."""


@dataclass(frozen=True)
class Setting:
    """A setting of a kind; `name` is dotted if it is inside another setting."""

    name: str
    takes: str
    default: str
    meaning: str


def settings_of_kind(kind: DeviceKind) -> list[Setting]:
    """Return every setting of a kind, with nested settings after their parents."""
    return list(_settings_of(kind.settings, {**EVERY, **kind.meanings}, ""))


def _settings_of(model: type[Strict], meanings: Mapping[str, str], within: str) -> Iterator[Setting]:
    for name, field in model.model_fields.items():
        whole = f"{within}{name}"
        default = "required" if field.is_required() else _plain(field.get_default(call_default_factory=True))
        yield Setting(whole, _type(field.annotation, field.metadata), default, meanings.get(whole, ""))
        if (inner := _model_in(field.annotation)) is not None:
            yield from _settings_of(inner, meanings, f"{whole}.")


def _model_in(annotation: Any) -> type[Strict] | None:
    if isinstance(annotation, type) and issubclass(annotation, Strict):
        return annotation
    return next((model for part in get_args(annotation) if (model := _model_in(part)) is not None), None)


def _plain(value: Any) -> str:
    """Return a default as it would be written in the file."""
    if isinstance(value, Strict):
        return f"{{{', '.join(f'{key}: {_plain(inner)}' for key, inner in value)}}}"
    if isinstance(value, tuple):
        return f"[{', '.join(map(_plain, value))}]"
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.10g}" if isinstance(value, float) else str(value)


WORDS = {str: "text", float: "number", int: "whole number", bool: "yes or no", Path: "file"}


def _type(annotation: Any, metadata: Sequence[Any] = ()) -> str:
    """Return a description of the type of a setting, with its bounds."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return f"one of {', '.join(map(str, arguments))}" if len(arguments) > 1 else str(arguments[0])
    if origin is Annotated:
        return "a date as 2026-11-21" if annotation == Date else _type(arguments[0], arguments[1:])
    if origin in (Union, UnionType):
        return " or ".join(_type(argument) for argument in arguments if argument is not type(None))
    if origin in (tuple, list):
        many = "" if Ellipsis in arguments or len(arguments) < 2 else f" of {len(arguments)}"
        kinds = dict.fromkeys(_type(argument) for argument in arguments if argument is not Ellipsis)
        return f"list{many}, each {' and '.join(kinds)}"
    if isinstance(annotation, type) and issubclass(annotation, Strict):
        return "keys and values"
    return WORDS.get(annotation, str(getattr(annotation, "__name__", annotation))) + _bounds(metadata)


def _bounds(metadata: Sequence[Any]) -> str:
    """Return a description of the bounds of a number: from 0.2 to 2, above 0."""
    given = [inner for bound in metadata for inner in (getattr(bound, "metadata", None) or [bound])]
    bounds = {key: getattr(bound, key) for bound in given for key in ("ge", "gt", "le") if hasattr(bound, key)}
    low = f" from {bounds['ge']:.10g}" if "ge" in bounds else f" above {bounds['gt']:.10g}" if "gt" in bounds else ""
    return low + (f" to {bounds['le']:.10g}" if "le" in bounds else "")
