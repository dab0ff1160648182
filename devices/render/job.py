"""The job of a rendering process, and requests to it: plain data that is passed between processes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from palpate.devices.render.hands import Scripted
from palpate.devices.tablet.pipeline import Shape
from palpate.devices.tablet.reports import Report
from palpate.signals.textures.sounds import Sounds


@dataclass(frozen=True)
class Job:
    """A rendering job. `hand`: a script, the shape of a stylus whose reports are pushed, or None for the rig's tablet.

    `rig` is a rig file that provides texture_renderer; None: the twin of a voice coil. `ahead` in ms. `epoch_s` is the
    time.monotonic() from which pushed reports count.
    """

    sounds: Sounds | None
    hand: Scripted | Shape | None
    rig: Path | None = None
    ahead: int = 10
    real_time: bool = False
    seconds: float | None = None
    epoch_s: float = 0.0


@dataclass(frozen=True)
class Switch:
    """A request to change to another texture, or to silence."""

    sounds: Sounds | None


@dataclass(frozen=True)
class Volume:
    """A request for a volume from 0 to 1, where 1 is as recorded."""

    gain: float


@dataclass(frozen=True)
class Reports:
    """Reports of a stylus or a mouse, timed in seconds since `epoch_s`."""

    reports: tuple[Report, ...]


@dataclass(frozen=True)
class Ask:
    """A request for the record so far."""


@dataclass(frozen=True)
class End:
    """A request to stop."""
