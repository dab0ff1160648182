"""A made-up capture whose vibration is known at any time: what times and errors of features are measured on."""

from __future__ import annotations

import numpy as np

from palpate.modeling.textures.preparing import Touched
from palpate.modeling.textures.rates import evenly
from palpate.signals.arrays import Array

TONES_HZ = (31.0, 47.0, 83.0, 127.0, 173.0, 229.0, 311.0, 389.0)
"""Within the band; none is a multiple of mains."""
SENSORS_HZ = {"acceleration": 3000.0, "force": 8000.0, "position": 120.0}
GRAVITY_M_S2 = 9.81


def tones(seconds: float) -> Touched:
    """A capture whose vibration is known at any time (`felt_at`), with gravity and a hand that strokes slowly."""
    at = {what: np.arange(round(seconds * rate_hz)) / rate_hz for what, rate_hz in SENSORS_HZ.items()}
    t = at["position"]
    place = np.stack([40 * np.sin(3 * t), 40 * np.cos(3 * t), 0 * t], axis=1)
    force = 1.2 + 0.5 * np.cos(2 * at["force"])
    signals = {
        "acceleration": felt_at(at["acceleration"]) + np.array([0, 0, GRAVITY_M_S2]),
        "force": np.stack([0 * force, 0 * force, force], axis=1), "position": place,
    }  # fmt: skip
    sampled = {what: evenly(what, values, SENSORS_HZ[what], "made up") for what, values in signals.items()}
    return Touched("made up", sampled["acceleration"], sampled["force"], position=sampled["position"])


def felt_at(times_s: Array) -> Array:
    """Acceleration (n, 3) in m/s^2: tones that swell and fade, each with its own phase on each axis."""
    chance = np.random.Generator(np.random.PCG64(0))
    found = np.zeros((len(times_s), 3))
    for hertz in TONES_HZ:
        swells = 1 + 0.5 * np.sin(2 * np.pi * chance.uniform(0.5, 2) * times_s + chance.uniform(0, 6))
        for axis in range(3):
            found[:, axis] += swells * np.sin(2 * np.pi * hertz * times_s + chance.uniform(0, 6))
    return found
