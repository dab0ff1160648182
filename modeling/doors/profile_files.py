"""Reading a door profile's file, as strictly as the door itself does, without reaching a device."""

from __future__ import annotations

import csv
import hashlib
import io
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from palpate.modeling.doors.data import POINTS, POINTS_PER_DEG, Array, ModelDataError
from palpate.protocols.wording import some

HEADER = ("angle_deg", "force_N")


def read_profile(path: Path, sha256: str | None = None) -> Array:
    """The 621 forces, in newtons over 0 to 62 degrees, of a file with the columns angle_deg and force_N.

    Raises ModelDataError, naming file and line, on a file that is missing or no text, on another header, angle or
    number of points, on a value that is no finite number, and where the file is not the one with this `sha256`.
    """
    try:
        content = path.read_bytes()
        text = content.decode("utf-8-sig")
    except OSError as error:
        raise ModelDataError(f"{path}: no door profile can be read ({error.strerror})") from None
    except UnicodeDecodeError as error:
        raise ModelDataError(f"{path}: not a UTF-8 text file ({error.reason})") from None
    if sha256 is not None and hashlib.sha256(content).hexdigest() != sha256:
        raise ModelDataError(f"{path}: not the file that people felt (its SHA-256 differs); put the right one there")
    return _forces(path, text)


def _forces(path: Path, text: str) -> Array:
    rows = csv.reader(io.StringIO(text, newline=""))
    try:
        if tuple(found := next(rows, [])) != HEADER:
            raise ModelDataError(f"{path}, line 1: found {some(found, 8, ',')!r}, expected {','.join(HEADER)!r}")
        forces = list(_checked(path, rows))
    except csv.Error as error:
        raise ModelDataError(f"{path}, line {rows.line_num}: {error}") from None
    if len(forces) != POINTS:
        raise ModelDataError(
            f"{path}: {len(forces)} points found, {POINTS} expected (0 to 62 degrees); a raw recording becomes a"
            " profile with `palpate doors normalise`"
        )
    return np.array(forces, dtype=np.float64)


def _checked(path: Path, rows: Iterator[Sequence[str]]) -> Iterator[float]:
    for index, row in enumerate(rows):
        line = index + 2
        if len(row) != len(HEADER):
            raise ModelDataError(f"{path}, line {line}: {len(row)} values found, 2 expected")
        angle, force = (_number(path, line, *cell) for cell in zip(HEADER, row, strict=True))
        if index >= POINTS or abs(angle - index / POINTS_PER_DEG) > 1e-6:
            expected = f"{index / POINTS_PER_DEG:.1f}" if index < POINTS else "the end of the file"
            raise ModelDataError(f"{path}, line {line}: angle {angle:g} found, {expected} expected")
        yield force


def _number(path: Path, line: int, column: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ModelDataError(f"{path}, line {line}: {column} is {text!r}, a finite number is expected")
    return value
