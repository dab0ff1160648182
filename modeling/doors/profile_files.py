"""Reading a door profile's file, as strictly as the door itself does, without reaching a device."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palpate.modeling.doors.data import ModelDataError
from palpate.signals.arrays import Array
from palpate.signals.doors import profile_file

PROFILE = profile_file.ProfileFormat(
    error=ModelDataError,
    counted=lambda _cells: True,
    unreadable=lambda wrong: f"{wrong.path}: no door profile can be read ({wrong.reason})",
    encoding=lambda wrong: f"{wrong.path}: not a UTF-8 text file ({wrong.reason})",
    width=lambda wrong: f"{wrong.where}: {wrong.cells} values found, 2 expected",
    end="",
    advice="; a raw recording becomes a profile with `palpate doors normalise`",
)


def read_profile(path: Path, sha256: str | None = None) -> Array:
    """The 621 forces, in newtons over 0 to 62 degrees, of a file with the columns angle_deg and force_N.

    Raises ModelDataError, naming file and line, on a file that is missing or no text, on another header, angle or
    number of points, on a value that is no finite number, and where the file is not the one with this `sha256`.
    """
    return np.array(profile_file.read_profile(path, PROFILE, sha256), dtype=np.float64)
