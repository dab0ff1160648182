"""A device's health, and a kind's settings, as lines of text."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic_core import PydanticUndefined

from devices.rig.settings import Date, Strict
from devices.signals import Health, Reading


def told(health: Health) -> Iterator[str]:
    """The readings, one line a signal and one a channel, the calibration's date, and further facts."""
    for reading in health.readings:
        yield _rate(reading)
        yield from _channels(reading)
    if health.readings or health.calibrated:
        yield f"calibrated {health.calibrated or 'never, as far as the rig file says'}"
    for name, value in health.facts.items():
        yield f"{name}: {value}"


def _rate(reading: Reading) -> str:
    lost = f", {reading.lost} lost" if reading.lost else ""
    return f"{reading.signal.name}: {reading.rate_hz:.1f} Hz measured, {reading.signal.rate_hz:g} Hz nominal{lost}"


def _channels(reading: Reading) -> Iterator[str]:
    signal = reading.signal
    width = max(map(len, signal.channels), default=0)
    for channel, unit, mean, noise in zip(signal.channels, signal.units, reading.mean, reading.noise, strict=True):
        yield f"  {channel:<{width}} {mean:>11.4g} {unit:<6} noise {noise:.3g} {unit}"


def settings_told(model: type[Strict]) -> Iterator[str]:
    """Every setting: its name, its default, and what it is."""
    for name, field in model.model_fields.items():
        default = (
            "required" if field.is_required() else f"default {_plain(field.get_default(call_default_factory=True))}"
        )
        about = f"  {field.description}" if field.description else ""
        yield f"{name:<22} {_type(field.annotation)}; {default}{about}"


def _plain(value: Any) -> str:
    if value is None or value is PydanticUndefined:
        return "none"
    if isinstance(value, Strict):
        return f"{{{', '.join(f'{key}: {_plain(inner)}' for key, inner in value)}}}"
    return str(value)


WORDS = {str: "text", float: "number", int: "whole number", bool: "true or false", Path: "file"}


def _type(annotation: Any) -> str:
    """A type in the words of who writes a rig file."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return f"one of {', '.join(map(str, arguments))}"
    if origin is Annotated:
        return "a date as 2026-11-21" if annotation == Date else _type(arguments[0])
    if origin in (Union, UnionType):
        return " or ".join(_type(each) for each in arguments if each is not type(None))
    if origin in (tuple, list):
        return f"list of {' and '.join(dict.fromkeys(_type(each) for each in arguments if each is not Ellipsis))}"
    if isinstance(annotation, type) and issubclass(annotation, Strict):
        return f"{{{', '.join(annotation.model_fields)}}}"
    return WORDS.get(annotation, str(getattr(annotation, "__name__", annotation)))
