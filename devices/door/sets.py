"""The stimulus files of the door studies other than door_ratings, made from the same six doors and from wishes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from palpate.devices.door.making import NEUTRAL, Doors, maker_for
from palpate.devices.door.stimuli import FEATURE_DECIMALS, FOLDER, TABLE, originals, profile_text
from palpate.protocols.files import write_texts
from palpate.signals.arrays import Array
from palpate.signals.doors.features import describe
from palpate.signals.doors.grid import FORCE_DECIMALS, POINTS, DoorDataError

TARGETS = (10, 90)
"""Values of the wished attribute; the other six stay at 50 (thesis 5.7.1.1)."""


def matching_files() -> dict[str, str]:
    """Return the files of door_matching: fourteen profiles by the shipped models, and a table.

    In each profile one attribute is at 10 or 90, the others are at 50.
    """
    doors = Doors(maker_for(None))
    names = doors.maker.attributes
    wished = [(name, target) for name in names for target in TARGETS]
    neutral = dict.fromkeys(names, NEUTRAL)
    profiles = [np.array(doors.force_N({**neutral, name: target})) for name, target in wished]
    about = [(f"{name}_{target}", name, str(target)) for name, target in wished]
    return dict(_files(("id", "attribute", "target"), about, profiles))


def real_files() -> dict[str, str]:
    """Return the files of door_adjectives and door_capture: the six original doors of door_ratings, and their table."""
    doors = list(originals())
    about = [(label, label, source) for label, source, _ in doors]
    return dict(_files(("id", "car", "source"), about, [force for _, _, force in doors]))


SETS: Mapping[str, Callable[[], dict[str, str]]] = {
    "door_matching": matching_files,
    "door_adjectives": real_files,
    "door_capture": real_files,
}
"""Functions that return the files of a study, by path inside the folder and content."""


def make(study: str, folder: Path) -> list[Path]:
    """Write the stimulus files of a study of SETS into its folder. Raises DoorDataError for another study."""
    return write_texts(folder, _set_files(study))


def differences(study: str, folder: Path) -> list[str]:
    """Return a line for each file of a folder that differs from what `make` writes; empty if all are equal."""
    expected = _set_files(study)
    lines = []
    for name, text in expected.items():
        path = folder / name
        if not path.is_file():
            lines.append(f"{path}: missing")
        elif path.read_bytes() != text.encode():
            lines.append(f"{path}: differs")
    unknown = sorted(path for path in (folder / FOLDER).glob("*.csv") if f"{FOLDER}/{path.name}" not in expected)
    return lines + [f"{path}: not a file of this study" for path in unknown]


def _set_files(study: str) -> dict[str, str]:
    if study not in SETS:
        raise DoorDataError(f"{study!r} has no made stimuli; there are {', '.join(SETS)} and door_ratings.")
    return SETS[study]()


def _files(
    columns: tuple[str, ...], about: Sequence[tuple[str, ...]], profiles: Sequence[Array]
) -> Iterator[tuple[str, str]]:
    header = ",".join((*columns, "file", *describe(np.zeros(POINTS))))
    rows = []
    for cells, force_N in zip(about, profiles, strict=True):
        name = f"{FOLDER}/{cells[0]}.csv"
        yield name, profile_text(force_N)
        rows.append(",".join((*cells, name, *_features(force_N))))
    yield TABLE, "\n".join((header, *rows)) + "\n"


def _features(force_N: Array) -> Iterator[str]:
    """Yield the numeric columns of the profile in the file's format: fixed decimals, never a minus before a zero."""
    for name, value in describe(np.round(force_N, FORCE_DECIMALS)).items():
        decimals = FEATURE_DECIMALS.get(name, FORCE_DECIMALS)
        yield f"{round(value, decimals) + 0.0:.{decimals}f}"
