"""What the experimenter is told of streams while they are recorded."""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot

from palpate.devices.streams.stream import Stream


def told(streams: Mapping[str, Stream]) -> dict[str, str]:
    """A line for each stream: its level over the last chunk (RMS about the mean), how many samples, how many lost."""
    return {name: _line(stream) for name, stream in streams.items()}


def untold(streams: Mapping[str, Stream]) -> dict[str, None]:
    """Takes those lines away."""
    return dict.fromkeys(streams)


def _line(stream: Stream) -> str:
    lost = f"{stream.lost:,} LOST" if stream.lost else "0 lost"
    parts = [f"{stream.samples:,} samples", lost]
    if stream.bad:
        parts.append(f"{stream.bad:,} not a number")
    return ", ".join([*_levels(stream), *parts])


def _levels(stream: Stream) -> list[str]:
    """The level per unit: channels that share one (the axes of a vector) are taken together."""
    if stream.level is None:
        return []
    by_unit: dict[str, list[float]] = {}
    for unit, rms in zip(stream.signal.units, stream.level.rms, strict=True):
        by_unit.setdefault(unit, []).append(rms)
    return [f"RMS {hypot(*values):.3g} {unit}" for unit, values in by_unit.items()]
