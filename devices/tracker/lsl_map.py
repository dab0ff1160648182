"""Which channels of a stream are the position, and in what unit: by what the stream says of itself, or by settings."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from palpate.devices.signals import DeviceError
from palpate.devices.tracker.source import Row

MM_PER = {
    "m": 1000.0, "meter": 1000.0, "meters": 1000.0, "metre": 1000.0, "metres": 1000.0,
    "cm": 10.0, "centimeters": 10.0, "centimetres": 10.0,
    "mm": 1.0, "millimeter": 1.0, "millimeters": 1.0, "millimetre": 1.0, "millimetres": 1.0,
}  # fmt: skip
SEEN = ("seen", "tracked", "tracking", "visible", "valid", "quality", "confidence")
"""Labels of a channel that says whether, or how well, the marker is seen."""
AXIS = {axis: re.compile(f"(^|[^A-Za-z]){axis}$|{axis.upper()}$") for axis in "xyz"}
"""A label that means an axis: x, X, PositionX, marker_x, and not quality."""
Labels = Sequence[str]


@dataclass(frozen=True)
class Map:
    """Where x, y, z (and how well they are seen) lie in a sample, and millimetres per unit of the stream."""

    places: tuple[int, int, int]
    scale: float
    seen: int | None = None
    seen_above: float = 0.0

    def row(self, sample: Sequence[float]) -> Row:
        """The sample in mm; a quality that is no number counts as not seen."""
        x, y, z = (self.scale * float(sample[place]) for place in self.places)
        quality = math.inf if self.seen is None else float(sample[self.seen])
        return x, y, z, quality > self.seen_above


def mapped(
    stream: str, labels: Labels, units: Labels, wanted: Sequence[str | int] | None, seen: str | int | None,
    unit: str | None, seen_above: float,
) -> Map:  # fmt: skip
    """The map of a stream whose channels have these labels and units ("" where it says nothing).

    `wanted` are labels or places (from 0) of x, y, z; without them they are the only labels that end in x, y and z
    (X, PositionX, marker_x), or the three channels of a stream that has no more.

    Raises:
        DeviceError: naming the channels that there are.
    """
    there = ", ".join(f"{place} {label or '(no label)'}" for place, label in enumerate(labels))
    told = f"the stream {stream} has the channels {there}"
    found = [_place(told, labels, one) for one in wanted] if wanted is not None else _guessed(told, labels)
    if len(set(found)) != 3:
        raise DeviceError(f"{told}; three different ones are expected for x, y and z: set `channels` in the rig file.")
    scale = _scale(told, unit, {units[place] for place in found})
    quality = _place(told, labels, seen) if seen is not None else _quality(labels)
    return Map((found[0], found[1], found[2]), scale, quality, seen_above)


def _place(told: str, labels: Labels, one: str | int) -> int:
    if isinstance(one, int) and 0 <= one < len(labels):
        return one
    if isinstance(one, str) and list(labels).count(one) == 1:
        return list(labels).index(one)
    raise DeviceError(f"{told}; {one!r} in the rig file is not one of them.")


def _guessed(told: str, labels: Labels) -> list[int]:
    ending = [[place for place, label in enumerate(labels) if AXIS[axis].search(label)] for axis in "xyz"]
    if all(len(places) == 1 for places in ending):
        return [places[0] for places in ending]
    if len(labels) == 3 and not any(ending):
        return [0, 1, 2]
    raise DeviceError(f"{told}; which are x, y and z? Set `channels` in the rig file.")


def _scale(told: str, unit: str | None, said: set[str]) -> float:
    if unit is not None:
        return MM_PER[unit]
    units = {each.strip().lower() for each in said}
    if len(units) == 1 and (scale := MM_PER.get(next(iter(units)))) is not None:
        return scale
    raise DeviceError(
        f"{told} in the unit {' / '.join(sorted(said)) or '(none)'!r}; set `unit: mm` or `m` in the rig file."
    )


def _quality(labels: Labels) -> int | None:
    return next((place for place, label in enumerate(labels) if label.lower() in SEEN), None)
