"""Simulated recordings and tables for tests: vibration that grows with the hand's speed, and a hand that strokes."""

from __future__ import annotations

import numpy as np

from palpate.modeling.textures.recording import Recording


def hand(n, rate_hz=1000.0, seed=0):
    """Speed (mm/s) and force (N) of a hand that strokes."""
    t = np.arange(n) / rate_hz
    chance = np.random.default_rng(seed)
    slow = [np.sin(2 * np.pi * chance.uniform(0.1, 0.7) * t + chance.uniform(0, 6)) for _ in range(4)]
    return 80 + 40 * slow[0] + 30 * slow[1], 1.2 + 0.5 * slow[2] + 0.3 * slow[3]


def vibration(n, seed=0):
    """Noise with a resonance, of SD 1."""
    from scipy.signal import lfilter

    signal = lfilter([1.0], [1.0, -1.2, 0.8], np.random.default_rng(seed).standard_normal(n))
    return signal / signal.std()


def recording(n=20_000, seed=0, texture="made"):
    """A recording at 1 kHz."""
    speed, force = hand(n, seed=seed)
    return Recording(texture, texture, np.stack([vibration(n, seed) * speed / 80, speed, force]))


class FixedSimulator:
    """A simulator of captures: streams of the rates and channels of a session."""

    def __init__(self):
        self.requests = 0

    def captured(self, texture, seconds, seed):
        self.requests += 1
        seed += len(texture)
        chance = np.random.default_rng(seed)
        n = round(3000 * seconds)
        felt = np.stack([vibration(n, seed + axis) for axis in range(3)], axis=1) + np.array([0.0, 0.0, 9.80665])
        t = np.arange(round(120 * seconds)) / 120
        place = np.stack([40 * np.sin(3 * t), 40 * np.cos(2 * t), 0.02 * chance.standard_normal(len(t))], axis=1)
        wrench = chance.standard_normal((round(8000 * seconds), 6)) * 0.01 + [0, 0, 1.0, 0, 0, 0]
        return {
            "tool_acceleration": (3000.0, felt), "tool_force": (8000.0, wrench),
            "tool_position": (120.0, np.hstack([place, np.ones((len(t), 1))])),
        }  # fmt: skip
