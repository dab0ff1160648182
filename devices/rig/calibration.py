"""The result of calibrating a device: the settings for its entry in the rig file, and their quality.

They are inserted into the entry so that every other character of the file stays as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from palpate.devices.rig.file import RigFileError, read_rig
from palpate.protocols.files import write_bytes
from palpate.protocols.yaml_text import load

if TYPE_CHECKING:
    from palpate.devices.rig.file import RigFile

Ask = Callable[[str], None]
"""Asks the experimenter to do something, and returns once it is done."""
Say = Callable[[str], None]
Span = tuple[int, int, str]
"""A range of characters from one place to another, and its replacement."""


class UnfitMeasurement(Exception):
    """A measurement that gives no calibration; the message says what is missing and what to do."""


@dataclass(frozen=True)
class CalibrationResult:
    """The result of a calibration: `settings` for the device's entry, and their quality in `lines` and as `figures`."""

    settings: Mapping[str, Any]
    lines: tuple[str, ...]
    figures: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class CalibrationJob:
    """A device of a rig to be calibrated, and how to communicate with the experimenter."""

    file: RigFile
    name: str
    date: str
    ask: Ask
    say: Say


def yaml_value(value: Any) -> str:
    """Return a setting's value as it is written in a rig file, on one line."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {yaml_value(inner)}' for key, inner in value.items())}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(yaml_value, value))}]"
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def write_settings(path: Path, device: str, settings: Mapping[str, Any]) -> None:
    """Write the settings into the file, or leave it as it was and raise RigFileError with the lines to paste.

    Before the file is replaced, the new one is read: it must hold what the old one held, and these settings.
    """
    before = path.read_bytes()
    try:
        old = load(before, str(path)).data
        after = edit_entry(before.decode("utf-8"), device, settings).encode("utf-8")
        new = load(settings_text(settings).encode("utf-8"), "settings").data
        devices = {**old["devices"], device: {**old["devices"][device], **new}}
        if load(after, str(path)).data != {**old, "devices": devices}:
            raise ValueError("the new text does not hold what it should")
        write_bytes(path, after, check=read_rig)
    except ValueError as error:
        refusal = f"{path} was not changed: its entry {device!r} cannot be edited safely ({error})"
        raise RigFileError(f"{refusal}. Put this into it by hand:\n{settings_text(settings)}") from None


def settings_text(settings: Mapping[str, Any], braces: bool = False) -> str:
    """Return the settings as lines of a rig file, with commas where the entry is written in braces."""
    return (",\n" if braces else "\n").join(f"  {key}: {yaml_value(value)}" for key, value in settings.items())


def is_in_braces(path: Path, device: str) -> bool:
    """Return whether a device's entry is written as {key: value, ...}."""
    return bool(_entry(path.read_text(encoding="utf-8-sig"), device).flow_style)


def edit_entry(text: str, device: str, settings: Mapping[str, Any]) -> str:
    """Return the text with these settings in the device's entry. Raises ValueError if the layout is not supported."""
    entry = _entry(text, device)
    there = {key.value: value for key, value in entry.value}
    spans: list[Span] = []
    for key, value in settings.items():
        if key in there:
            if _is_in_block(there[key]):
                raise ValueError(f"line {there[key].start_mark.line + 1}: a value over lines of its own")
            begin, end = there[key].start_mark.index, there[key].end_mark.index
            spans.append((begin, end, ("" if text[begin - 1 : begin].isspace() else " ") + yaml_value(value)))
    new = {key: yaml_value(value) for key, value in settings.items() if key not in there}
    if new:
        spans.append(_insert_values(text, entry, new))
    for begin, end, instead in sorted(spans, reverse=True):
        text = text[:begin] + instead + text[end:]
    return text


def _entry(text: str, device: str) -> yaml.MappingNode:
    node: yaml.Node | None = yaml.compose(text, Loader=yaml.SafeLoader)
    for name in ("devices", device):
        pairs = node.value if isinstance(node, yaml.MappingNode) else []
        node = next((value for key, value in pairs if key.value == name), None)
    if not isinstance(node, yaml.MappingNode):
        raise RigFileError("it is not there any more")
    return node


def _insert_values(text: str, entry: yaml.MappingNode, new: Mapping[str, str]) -> Span:
    """Return where and what to insert after the last value: in braces after a comma, else on new lines."""
    key, value = next((pair for pair in reversed(entry.value) if not _is_in_block(pair[1])), (None, None))
    if key is None or value is None:
        raise ValueError("it has no value on its own line")
    at = value.end_mark.index
    if entry.flow_style:
        return at, at, "".join(f", {name}: {value}" for name, value in new.items())
    newline = "\r\n" if "\r\n" in text else "\n"
    ends = text.find(newline, at)
    at, indent = len(text) if ends < 0 else ends, " " * key.start_mark.column
    return at, at, "".join(f"{newline}{indent}{name}: {value}" for name, value in new.items())


def _is_in_block(value: yaml.Node) -> bool:
    """Return whether a value spans lines of its own, so that its end is not the end of its text."""
    if isinstance(value, yaml.ScalarNode):
        return value.style in ("|", ">")
    return not getattr(value, "flow_style", False)
