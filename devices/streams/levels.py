"""What a look at the samples tells: how strong they are, and whether they are numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SHOWN = 2048
"""The level is of so many rows, the last ones: it is looked at, not kept."""


@dataclass(frozen=True)
class Level:
    """Per channel the root mean square about the mean; rows with a value that is no finite number, and at the end."""

    rms: tuple[float, ...]
    bad: int
    bad_at_end: int


def level(data: bytes, channels: int) -> Level:
    """The level of rows of little-endian float32; rows with a value that is not finite count as bad and for nothing."""
    rows = np.frombuffer(data, "<f4").reshape(-1, channels)
    finite = np.isfinite(rows)
    if finite.all():
        return Level(_spread(rows), 0, 0)
    bad = ~finite.all(axis=1)
    good = np.flatnonzero(~bad)
    at_end = len(bad) - 1 - int(good[-1]) if len(good) else len(bad)
    return Level(_spread(rows[good[-SHOWN:]]), int(bad.sum()), at_end)


def _spread(rows: NDArray[np.float32]) -> tuple[float, ...]:
    if not len(rows):
        return (0.0,) * int(rows.shape[1])
    return tuple(float(each) for each in rows[-SHOWN:].std(axis=0, dtype=np.float64))
