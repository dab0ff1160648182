"""Drawn force profiles with known landmarks."""

import numpy as np

from palpate.signals.doors.grid import POINTS


def line(*points: tuple[float, float]) -> np.ndarray:
    """Return the profile in N over 0 to 62 degrees that joins (degrees, N) points by straight lines."""
    angles, forces = zip(*points, strict=True)
    return np.interp(np.arange(POINTS) / 10, angles, forces)


SAW = line((0, 0), (10, 20), (20, -5), (30, 40), (34, 22), (38, 18), (42, -10), (50, 30), (62, 6))
