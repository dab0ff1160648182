"""The folder of a computer's own settings in a lab: its screen's calibration, its rig."""

from __future__ import annotations

import platform
from pathlib import Path


def station_folder(lab: Path, host: str | None = None) -> Path:
    """Return LAB/stations/HOST, where HOST is the computer's name up to its first dot, made valid for a folder."""
    name = (host or platform.node()).split(".")[0] or "station"
    return lab / "stations" / "".join(c if c.isalnum() or c in "-_" else "_" for c in name)
