"""Simulated touches: noise on three axes, and a hand that strokes."""

import numpy as np

from palpate.analysis.features.touch import Stretch, Touch


def noise(n, axes=3, seed=0, level=1.0):
    return level * np.random.Generator(np.random.PCG64(seed)).standard_normal((n, axes))


def stretch(n, axes=3, seed=0, level=1.0):
    t = np.arange(n) / 1000
    return Stretch(noise(n, axes, seed, level), 80 + 40 * np.sin(2 * t), 1.2 + 0.5 * np.cos(3 * t))


def touch(*lengths, axes=3, level=1.0):
    return Touch("made", tuple(stretch(n, axes, seed, level) for seed, n in enumerate(lengths)))
