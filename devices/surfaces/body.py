"""How the tool's body answers: bending modes that the contact's force excites, and how it leans."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.signals.arrays import Array

LEAN = (0.26, -0.17, math.sqrt(1 - 0.26**2 - 0.17**2))
"""The upward direction in the tool's axes, as the hand holds it: about 18 degrees off upright."""
SWAYS = 0.03
"""How far the hand turns the tool while it strokes, in radians (RMS of each of two axes, about)."""
SENSOR_ABOVE_TIP_M = 0.045
"""From the tip to the force sensor's origin, along the tool."""


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
"""Engineering judgement for a light printed stylus with two sensors on it; no measured tool."""


def mode_filter(mode: Mode, rate_hz: float) -> tuple[Array, Array]:
    """Acceleration of a mode for a force: s^2 / (s^2 + 2 zeta w s + w^2) / m, bilinear and warped to be true at w."""
    warped = 1 / math.tan(math.pi * mode.hertz / rate_hz)
    square, cross = warped * warped, 2 * mode.ratio * warped
    first = square + cross + 1
    numerator = np.array([square, -2 * square, square]) / first / mode.mass_kg
    return numerator, np.array([1.0, 2 * (1 - square) / first, (square - cross + 1) / first])


def to_tool() -> Array:
    """The rotation from the sample's axes into the tool's: the shortest that takes upward to LEAN."""
    x, y, z = LEAN
    cross = np.array([[0, 0, x], [0, 0, y], [-x, -y, 0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1 + z), dtype=np.float64)


def torque(force: Array) -> Array:
    """Torque in N m about the force sensor's origin of forces (n, 3) at the tip, in the sample's axes."""
    tip = -SENSOR_ABOVE_TIP_M * (to_tool().T @ np.array([0.0, 0.0, 1.0]))
    return np.asarray(np.cross(tip, force), dtype=np.float64)
