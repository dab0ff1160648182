"""The stimulus folder of the door rating study: six doors, fifteen profiles each, and the table that lists them.

The doors' parameters are read from doors.yaml, or from a lab's own file of the same form.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from palpate.devices.door.recording import read_columns
from palpate.protocols.files import write_texts
from palpate.protocols.wording import some
from palpate.signals.arrays import Array
from palpate.signals.doors.augment import VARIANTS, augment
from palpate.signals.doors.features import describe
from palpate.signals.doors.grid import FORCE_DECIMALS, POINTS, STUDY_SEED, DoorDataError, grid_angle_deg
from palpate.signals.doors.mechanics import CheckFeature, Door, check_ranges, simulate
from palpate.signals.doors.profile_file import HEADER
from palpate.signals.doors.profiles import normalise

MEASURED_LABEL = "BC3"
"""The measured door's place in the thesis' design; the other five places are the catalogue's."""
STUDIES = Path(__file__).resolve().parents[2] / "studies"
"""The shipped studies."""
MEASURED_FILE = STUDIES / "door_ratings" / "measured" / "haptune_actual.csv"
IDENTITY = ("id", "car", "variant", "augmentation", "source", "file")
FEATURE_DECIMALS = {"peak_count": 0, "first_peak_deg": 1, "opening_deg": 1}
"""Decimals of some features; all others have those of a force."""
TABLE = "stimuli.csv"
FOLDER = "profiles"
DOORS_FILE = Path(__file__).resolve().with_name("doors.yaml")
CHECK_FIELDS = tuple(field.name for field in fields(CheckFeature))
DOOR_FIELDS = tuple(field.name for field in fields(Door))


def profile_text(force_N: Array) -> str:
    """Return a profile file's content: 621 rows of angle and force with fixed decimals, line feeds only."""
    if len(force_N) != POINTS:
        raise DoorDataError(f"A door profile has {POINTS} points, this one has {len(force_N)}.")
    rows = (f"{grid_angle_deg(index):.1f},{_fixed(force, FORCE_DECIMALS)}" for index, force in enumerate(force_N))
    return "\n".join((",".join(HEADER), *rows)) + "\n"


def originals(measured: Path = MEASURED_FILE) -> Iterator[tuple[str, str, Array]]:
    """Yield the six original doors: label, source (measured or simulated) and force, the measured one first."""
    columns = read_columns(measured, HEADER)
    yield MEASURED_LABEL, "measured", normalise(columns["angle_deg"], columns["force_N"]).force_N
    for label, entry in read_catalogue().items():
        yield label, "simulated", simulate(entry.door, label)


def stimulus_files(measured: Path = MEASURED_FILE, seed: int = STUDY_SEED) -> dict[str, str]:
    """Return all generated files by path inside the study's folder: 90 profiles and the table."""
    files: dict[str, str] = {}
    rows: list[str] = []
    for label, source, force_N in originals(measured):
        for variant in ("g0", *VARIANTS):
            made = augment(force_N, variant, door=label, seed=seed)
            name = f"{FOLDER}/{label}_{variant}.csv"
            files[name] = profile_text(made)
            augmentation = VARIANTS[variant].augmentation if variant in VARIANTS else "original"
            features = describe(made).items()
            numbers = (_fixed(value, FEATURE_DECIMALS.get(key, FORCE_DECIMALS)) for key, value in features)
            rows.append(",".join((f"{label}_{variant}", label, variant, augmentation, source, name, *numbers)))
    header = ",".join((*IDENTITY, *describe(np.zeros(POINTS))))
    files[TABLE] = "\n".join((header, *rows)) + "\n"
    return files


def make(folder: Path, measured: Path = MEASURED_FILE, seed: int = STUDY_SEED) -> list[Path]:
    """Write the stimulus folder; files of the same name are replaced, others stay."""
    return write_texts(folder, stimulus_files(measured, seed))


def differences(folder: Path, measured: Path = MEASURED_FILE, seed: int = STUDY_SEED) -> list[str]:
    """Return a line for each file of a folder that differs from what `make` writes; empty if all are equal."""
    expected = stimulus_files(measured, seed)
    lines = [_difference(folder / name, text.encode()) for name, text in expected.items()]
    unknown = sorted(path for path in (folder / FOLDER).glob("*.csv") if f"{FOLDER}/{path.name}" not in expected)
    return [line for line in lines if line] + [f"{path}: not a file of this study" for path in unknown]


def _difference(path: Path, expected: bytes) -> str:
    if not path.is_file():
        return f"{path}: missing"
    content = path.read_bytes()
    if content == expected:
        return ""
    lines = zip(content.splitlines(keepends=True), expected.splitlines(keepends=True), strict=False)
    first = next((number for number, (a, b) in enumerate(lines, start=1) if a != b), None)
    return f"{path}: differs from line {first}" if first else f"{path}: has another number of lines"


def _fixed(value: float, decimals: int) -> str:
    """Return a number with fixed decimals, never with a minus before a zero."""
    return f"{round(float(value), decimals) + 0.0:.{decimals}f}"


@dataclass(frozen=True)
class CatalogueEntry:
    """A simulated door: a description in words, and its parameters."""

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
    """Return the entry of a label. Raises DoorDataError that lists the labels for an unknown one."""
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
    rows = parameters.get("check")
    if not isinstance(rows, list) or any(not isinstance(row, list) or len(row) != len(CHECK_FIELDS) for row in rows):
        raise DoorDataError(f"{where}: 'check' is a list of rows [{', '.join(CHECK_FIELDS)}], found {rows!r}.")
    parameters["check"] = tuple(CheckFeature(*row) for row in rows)
    found = set(parameters)
    expected = set(DOOR_FIELDS)
    for names, word in ((found - expected, "unknown"), (expected - found, "missing")):
        if names:
            raise DoorDataError(f"{where}: {word} parameter {some(sorted(map(str, names)))}.")
    door = Door(**parameters)
    check_ranges(door, where)
    return CatalogueEntry(label, character, door)
