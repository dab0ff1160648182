"""Read the file of a door profile: 621 forces over the common grid. Pure Python: a rating session needs no NumPy."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from palpate.protocols.tables import TableFormat, parse_table
from palpate.protocols.wording import some
from palpate.signals.doors.grid import MAX_ANGLE_DEG, POINTS, DoorDataError, grid_angle_deg

HEADER = ("angle_deg", "force_N")


@dataclass(frozen=True)
class ProfileFormat(TableFormat):
    """The format of a profile's file; `end` ends its messages, `advice` the message on another number of points."""

    end: str = "."
    advice: str = ". A raw recording becomes a profile with `palpate doors normalise`."


PROFILE = ProfileFormat(
    error=DoorDataError,
    counted=lambda _cells: True,
    unreadable=None,
    encoding=lambda wrong: f"{wrong.path}: not a UTF-8 text file ({wrong.reason}).",
    quoting=None,
    width=lambda wrong: f"{wrong.where}: {wrong.cells} values found, 2 expected.",
    number=lambda wrong: f"{wrong.where}: {wrong.column} is {wrong.text!r}, a finite number is needed.",
)


def read_profile(path: Path | str, layout: ProfileFormat = PROFILE, sha256: str | None = None) -> tuple[float, ...]:
    """Read the 621 forces, in newtons, of a profile file with the columns angle_deg, force_N.

    Raises:
        DoorDataError: wrong columns, angles, number of points or numbers, with file and line; or a file whose
            SHA-256 is not `sha256`. With another `layout`, its error is raised instead.
    """
    path = Path(path)
    content = layout.content(path)
    table = parse_table(content, path, (), layout)
    if sha256 is not None and hashlib.sha256(content).hexdigest() != sha256:
        raise layout.error(
            f"{path}: not the file that people felt (its SHA-256 differs); put the right one there{layout.end}"
        )
    if tuple(table.header) != HEADER:
        raise layout.error(
            f"{path}, line 1: found {some(table.header, 8, ',')!r}, expected {','.join(HEADER)!r}{layout.end}"
        )
    forces = []
    for index, row in enumerate(table.rows()):
        angle, force = row.number("angle_deg"), row.number("force_N")
        if index >= POINTS or abs(angle - grid_angle_deg(index)) > 1e-6:
            expected = f"{grid_angle_deg(index):.1f}" if index < POINTS else "the end of the file"
            raise layout.error(f"{row.where}: angle {angle:g} found, {expected} expected{layout.end}")
        forces.append(force)
    if len(forces) != POINTS:
        raise layout.error(
            f"{path}: {len(forces)} points found, {POINTS} expected (0 to {MAX_ANGLE_DEG} degrees){layout.advice}"
        )
    return tuple(forces)
