"""The job of a rendering process, and requests to it meanwhile: plain data that crosses processes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from palpate.devices.render.hands import Scripted
from palpate.devices.tablet.pipeline import Shape
from palpate.devices.tablet.reports import Report
from palpate.signals.textures.sounds import Sounds


@dataclass(frozen=True)
class Job:
    """A job of rendering. `hand`: a script, the shape of a stylus whose reports are pushed, or the rig's tablet (None).

    `rig` is a rig file that provides texture_renderer; None: the twin of a voice coil. `ahead` in ms. `epoch_s` is the
    time.monotonic() that pushed reports count from.
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
    """Go over to another texture, or to silence."""

    sounds: Sounds | None


@dataclass(frozen=True)
class Volume:
    """A volume, from 0 to 1: 1 as it was recorded."""

    gain: float


@dataclass(frozen=True)
class Reports:
    """A stylus' or a mouse's reports, timed in seconds since `epoch_s`."""

    reports: tuple[Report, ...]


@dataclass(frozen=True)
class Ask:
    """Tell how it goes."""


@dataclass(frozen=True)
class End:
    """Stop."""
