"""What light does to a height field: slopes, shadows, hollows. All of it repeats at the borders, as the field does."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import gaussian_filter

from palpate.devices.surfaces.fields import SIZE_MM, Field

REACH_MM = 6.0
"""Longest shadow that is looked for."""
HOLLOWS_MM = (0.25, 0.8, 2.5)
"""Sizes of the surroundings in which a point lies deep or high."""


def slopes(height_um: Field) -> tuple[Field, Field]:
    """Rise per length to the right and upward, by central differences."""
    step_um = np.float32(2000 * SIZE_MM / height_um.shape[0])
    right = (np.roll(height_um, -1, 1) - np.roll(height_um, 1, 1)) / step_um
    up = (np.roll(height_um, 1, 0) - np.roll(height_um, -1, 0)) / step_um
    return right, up


def shadow(height_um: Field, azimuth_deg: float, elevation_deg: float, penumbra_deg: float) -> Field:
    """Share of the lamp that each point sees: 1 in full light, 0 in full shadow.

    The steepest rise towards the lamp, on steps that grow by a quarter, against the lamp's height. Between steps
    nothing is looked at: an object thinner than a step may cast no shadow beyond five times its breadth.
    """
    step_mm = SIZE_MM / height_um.shape[0]
    steepest = np.full_like(height_um, -np.inf)
    for reach in _steps(step_mm):
        rows = -round(reach * math.sin(math.radians(azimuth_deg)))
        columns = round(reach * math.cos(math.radians(azimuth_deg)))
        away_um = 1000 * step_mm * max(math.hypot(rows, columns), 1e-9)
        ahead = np.roll(height_um, (-rows, -columns), (0, 1))
        np.maximum(steepest, (ahead - height_um) / np.float32(away_um), out=steepest)
    low, high = (math.radians(elevation_deg + side * penumbra_deg) for side in (-1, 1))
    hidden = (np.arctan(steepest) - np.float32(low)) / np.float32(high - low)
    return np.asarray(1 - np.clip(hidden, 0, 1), dtype=np.float32)


def _steps(step_mm: float) -> list[float]:
    """Distances in points: 1, 2, 3, ... then growing by a quarter."""
    reaches, reach = [], 1.0
    while reach * step_mm <= REACH_MM:
        reaches.append(reach)
        reach = max(reach + 1, reach * 1.25)
    return reaches


def hollowness(height_um: Field) -> Field:
    """How far each point lies in a hollow, 0 (open) to 1: depth below its surroundings of three sizes."""
    deep = np.zeros_like(height_um)
    for size_mm in HOLLOWS_MM:
        around = gaussian_filter(height_um, size_mm * height_um.shape[0] / SIZE_MM / 2, mode="wrap", truncate=3)
        deep += np.maximum(around - height_um, 0) / np.float32(1000 * size_mm / 2)
    return np.asarray(1 - 1 / (1 + deep), dtype=np.float32)
