"""The tool on a height field: the path of the middle of its hemispherical tip, and the contact patch.

Its body responds with bending modes that the contact's force excites, and by how it leans.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates, spline_filter

from palpate.devices.surfaces.fields import SIZE_MM, Field
from palpate.signals.arrays import Array

RADIUS_MM = 1.0
"""The tool's steel tip has a diameter of 2.0 mm (thesis 3.4.1)."""
NOMINAL_N = 1.0
"""The force at which the width of the contact is computed."""
STEEPEST = 1.0
"""Greatest slope that pushes the tip sideways: 45 degrees."""
LEAN = (0.26, -0.17, math.sqrt(1 - 0.26**2 - 0.17**2))
"""The upward direction in the tool's axes, as the hand holds it: about 18 degrees off upright."""
SWAYS = 0.03
"""Approximate rotation of the tool by the hand while it strokes, in radians (RMS of each of two axes)."""
SENSOR_ABOVE_TIP_M = 0.045
"""From the tip to the force sensor's origin, along the tool."""


def traced(height_um: Field, radius_mm: float = RADIUS_MM) -> Field:
    """Return the height of a sphere's lowest point as it rolls over the field without load: grey dilation by it.

    It is done along rows and then along columns, with the sphere's drop r(x, y) approximated by r(x, 0) + r(0, y):
    heights are too high by at most 4 % of the drop where the sphere touches within half its radius (5 um of 134), more
    beyond.
    """
    for axis in (0, 1):
        step_mm = SIZE_MM / height_um.shape[axis]
        span_mm = 0.001 * float(height_um.max() - height_um.min())
        # Where the sphere has dropped by more than the field's whole range, nothing can touch it.
        reach_mm = radius_mm if span_mm >= radius_mm else math.sqrt(span_mm * (2 * radius_mm - span_mm))
        top = height_um.copy()
        for away in range(1, min(int(reach_mm / step_mm) + 1, int(radius_mm / step_mm)) + 1):
            drop_um = np.float32(1000 * (radius_mm - math.sqrt(max(radius_mm**2 - (away * step_mm) ** 2, 0))))
            lower = height_um - drop_um
            for way in (away, -away):
                np.maximum(top, np.roll(lower, way, axis), out=top)
        height_um = top
    return height_um


def patch_mm(stiffness_N_mm: float, radius_mm: float = RADIUS_MM) -> float:
    """Return the contact's radius at the nominal force: a sphere pressed in by its depth (a^2 = R d, as in Hertz)."""
    return math.sqrt(radius_mm * min(NOMINAL_N / stiffness_N_mm, radius_mm))


@dataclass(frozen=True)
class Ground:
    """The ground under the tip: a smooth surface through the points, repeated endlessly. Heights in metres."""

    splined: Field

    def at(self, x_mm: Array, y_mm: Array) -> tuple[Array, Array, Array]:
        """Return the height in metres, and its slopes along x and y, at places counted from the sample's middle."""
        here = self._height(x_mm, y_mm)
        little = 0.02
        right, up = self._height(x_mm + little, y_mm), self._height(x_mm, y_mm + little)
        to_x, to_y = (np.clip((beside - here) * (1000 / little), -STEEPEST, STEEPEST) for beside in (right, up))
        return here, to_x, to_y

    def _height(self, x_mm: Array, y_mm: Array) -> Array:
        count = self.splined.shape[0]
        columns = (x_mm / SIZE_MM + 0.5) * count - 0.5
        rows = (0.5 - y_mm / SIZE_MM) * count - 0.5
        height = map_coordinates(self.splined, (rows, columns), np.float64, order=3, mode="grid-wrap", prefilter=False)
        return np.asarray(height, dtype=np.float64)


def ground(height_um: Field, stiffness_N_mm: float) -> Ground:
    """Return the field as the tip follows it: traced by the sphere, then averaged over the contact patch."""
    traced_um = traced(height_um)
    sigma = 0.5 * patch_mm(stiffness_N_mm) * height_um.shape[0] / SIZE_MM
    if sigma > 0.3:
        traced_um = gaussian_filter(traced_um, sigma, mode="wrap", truncate=3)
    return Ground(spline_filter(traced_um * np.float32(1e-6), 3, output=np.float32, mode="grid-wrap"))


@dataclass(frozen=True)
class Mode:
    """A bending mode: frequency, damping ratio, modal mass, and the direction (x, y, z; unit) in which it moves."""

    hertz: float
    ratio: float
    mass_kg: float
    way: tuple[float, float, float]


MODES = (
    Mode(215.0, 0.07, 0.16, (0.8, 0.0, 0.6)),
    Mode(340.0, 0.06, 0.22, (0.0, 0.96, 0.28)),
    Mode(760.0, 0.05, 0.35, (0.6, 0.0, 0.8)),
)
"""An engineering judgement for a light printed stylus with two sensors on it; not measured."""


def mode_filter(mode: Mode, rate_hz: float) -> tuple[Array, Array]:
    """Return the filter from force to a mode's acceleration.

    It is s^2 / (s^2 + 2 zeta w s + w^2) / m, bilinear and warped to be true at w.
    """
    warped = 1 / math.tan(math.pi * mode.hertz / rate_hz)
    square, cross = warped * warped, 2 * mode.ratio * warped
    first = square + cross + 1
    numerator = np.array([square, -2 * square, square]) / first / mode.mass_kg
    return numerator, np.array([1.0, 2 * (1 - square) / first, (square - cross + 1) / first])


def to_tool() -> Array:
    """Return the rotation from the sample's axes into the tool's: the shortest that takes upward to LEAN."""
    x, y, z = LEAN
    cross = np.array([[0, 0, x], [0, 0, y], [-x, -y, 0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1 + z), dtype=np.float64)


def torque(force: Array) -> Array:
    """Return the torque in N m about the force sensor's origin of forces (n, 3) at the tip, in the sample's axes."""
    tip = -SENSOR_ABOVE_TIP_M * (to_tool().T @ np.array([0.0, 0.0, 1.0]))
    return np.asarray(np.cross(tip, force), dtype=np.float64)
