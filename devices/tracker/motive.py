"""The CSV export of Motive (format versions 1.2x): a line of facts, rows that name the columns, then frames.

Layout: docs.optitrack.com, "Data Export: CSV". Blank cells stand for a marker that was not seen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from palpate.devices.signals import DeviceError
from palpate.devices.tracker.source import Row
from palpate.protocols.tables import Table
from palpate.protocols.wording import some

UNITS = {"meters": "m", "centimeters": "cm", "millimeters": "mm"}
KINDS = ("Marker", "Rigid Body", "Rigid Body Marker")
"""What has a position, the measured one first: a rigid body's marker is where the solver put it."""
AXES = ("X", "Y", "Z")


@dataclass(frozen=True)
class Export:
    """One marker's samples, in `unit`."""

    times_s: list[float]
    rows: list[Row]
    unit: str
    facts: Mapping[str, str]


def is_motive(opened: Table) -> bool:
    """Whether the file begins as Motive's exports do."""
    return opened.header[:1] == ["Format Version"]


def read_motive(opened: Table, marker: str | None) -> Export:
    """The track of the named marker, or of the only one. Raises DeviceError."""
    path, table = opened.path, [opened.header, *opened.records()]
    head = next((place for place, row in enumerate(table) if row[0] == "Frame"), None)
    if head is None or len(table[head]) < 5:
        raise DeviceError(f"{path}: no row that begins with Frame; export from Motive with header and markers.")
    facts = dict(zip(table[0][::2], table[0][1::2], strict=False))
    unit = UNITS.get(facts.get("Length Units", "").lower())
    if unit is None:
        raise DeviceError(f"{path}: Length Units is {facts.get('Length Units')!r}; expected one of {', '.join(UNITS)}.")
    places = _chosen(path, _columns(table[1 : head + 1]), marker)
    times_s, rows = _frames(path, table[head + 1 :], places)
    return Export(times_s, rows, unit, _told(facts))


def _columns(head: Sequence[Sequence[str]]) -> dict[tuple[str, str], list[int]]:
    """Per kind and name the columns of X, Y and Z of its position."""
    labelled = {label: row for row in head for label in row[:2] if label in {"Type", "Name"}}
    kinds, names, what, axes = labelled.get("Type", []), labelled.get("Name", []), head[-2], head[-1]
    found: dict[tuple[str, str], list[int]] = {}
    for place in range(2, min(map(len, (kinds, names, what, axes)))):
        if what[place] == "Position" and axes[place] in AXES:
            found.setdefault((kinds[place], names[place]), []).append(place)
    return {key: places for key, places in found.items() if len(places) == 3}


def _chosen(path: Path, columns: Mapping[tuple[str, str], list[int]], marker: str | None) -> list[int]:
    names = sorted({name for kind, name in columns if kind in KINDS})
    wanted = marker if marker is not None else (names[0] if len(names) == 1 else None)
    found = [columns[kind, wanted] for kind in KINDS if wanted is not None and (kind, wanted) in columns]
    if not found:
        asked = "several markers" if marker is None and names else f"no marker {marker!r}"
        raise DeviceError(f"{path}: {asked}; name one as `marker`: {some(names) or 'there is none'}.")
    return found[0]


def _frames(path: Path, table: Sequence[Sequence[str]], places: Sequence[int]) -> tuple[list[float], list[Row]]:
    times_s, rows = [], []
    for frame in table:
        try:
            times_s.append(float(frame[1]))
            x, y, z = (
                float(frame[place]) if frame[place : place + 1] not in ([], [""]) else math.nan for place in places
            )
        except (ValueError, IndexError):
            raise DeviceError(
                f"{path}: frame {frame[0]}: numbers are expected, found {some(frame, 8, ',')!r}."
            ) from None
        rows.append((x, y, z, True))
    return times_s, rows


def _told(facts: Mapping[str, str]) -> dict[str, str]:
    wanted = {"Take Name": "take", "Export Frame Rate": "exported at", "Length Units": "length units"}
    return {name: facts[key] for key, name in wanted.items() if facts.get(key)}
