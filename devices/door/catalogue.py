"""The simulated doors' parameters: read from doors.yaml, or from a lab's own file of the same form."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from palpate.protocols.wording import some
from palpate.signals.doors.grid import DoorDataError
from palpate.signals.doors.mechanics import CheckFeature, Door, check_ranges

DOORS_FILE = Path(__file__).resolve().with_name("doors.yaml")
CHECK_FIELDS = tuple(field.name for field in fields(CheckFeature))
DOOR_FIELDS = tuple(field.name for field in fields(Door))


@dataclass(frozen=True)
class CatalogueEntry:
    """One simulated door: what it is like, in words, and its parameters."""

    label: str
    character: str
    door: Door


def read_catalogue(path: Path | str = DOORS_FILE) -> dict[str, CatalogueEntry]:
    """Read the doors of a catalogue file, in the file's order.

    Raises:
        DoorDataError: naming file, door and parameter, for anything missing, unknown or outside its range.
    """
    import yaml

    path = Path(path)
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise DoorDataError(f"{path}: not a YAML text file: {error}") from error
    doors = content.get("doors") if isinstance(content, dict) else None
    if not isinstance(doors, dict) or not doors:
        raise DoorDataError(f"{path}: a mapping 'doors' of door labels to parameters is expected.")
    return {str(label): _entry(f"{path}: {label}", str(label), given) for label, given in doors.items()}


def find_door(catalogue: dict[str, CatalogueEntry], label: str) -> CatalogueEntry:
    """The entry of one label, or a refusal that lists the labels there are."""
    if label not in catalogue:
        raise DoorDataError(f"There is no simulated door {label!r}; there are: {', '.join(catalogue)}.")
    return catalogue[label]


def _entry(where: str, label: str, given: Any) -> CatalogueEntry:
    if not isinstance(given, dict):
        raise DoorDataError(f"{where}: a mapping of parameters is expected, found {given!r}.")
    parameters = dict(given)
    character = parameters.pop("character", None)
    if not isinstance(character, str):
        raise DoorDataError(f"{where}: 'character' is missing: one sentence that says what this door is like.")
    parameters["check"] = _check_features(where, parameters.get("check"))
    _refuse_other_names(where, set(parameters), set(DOOR_FIELDS))
    door = Door(**parameters)
    check_ranges(door, where)
    return CatalogueEntry(label, character, door)


def _check_features(where: str, rows: Any) -> tuple[CheckFeature, ...]:
    if not isinstance(rows, list) or any(not isinstance(row, list) or len(row) != len(CHECK_FIELDS) for row in rows):
        raise DoorDataError(f"{where}: 'check' is a list of rows [{', '.join(CHECK_FIELDS)}], found {rows!r}.")
    return tuple(CheckFeature(*row) for row in rows)


def _refuse_other_names(where: str, found: set[str], expected: set[str]) -> None:
    for names, word in ((found - expected, "unknown"), (expected - found, "missing")):
        if names:
            raise DoorDataError(f"{where}: {word} parameter {some(sorted(map(str, names)))}.")
