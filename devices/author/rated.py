"""Where the doors lie that people have rated: the range of the ninety profiles of door_ratings, at every angle."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palpate.devices.author.making import Array
from palpate.protocols.tables import read_table
from palpate.signals.doors.grid import POINTS, DoorDataError

FILE = Path(__file__).resolve().with_name("rated_range.csv")
COLUMNS = ("angle_deg", "least_N", "most_N")


def rated_range() -> tuple[Array, Array]:
    """Least and greatest force at each of the 621 angles, in newtons."""
    _angles, least, most = map(np.asarray, read_table(FILE, COLUMNS).numbers(COLUMNS).values())
    if len(least) != POINTS:
        raise DoorDataError(f"{FILE}: {len(least)} rows found, {POINTS} expected")
    return least, most


def range_text(profiles: Array) -> str:
    """The file's content for profiles (n, 621)."""
    rows = zip(profiles.min(axis=0), profiles.max(axis=0), strict=True)
    lines = (f"{number / 10:.1f},{low:.2f},{high:.2f}" for number, (low, high) in enumerate(rows))
    return "\n".join((",".join(COLUMNS), *lines)) + "\n"
