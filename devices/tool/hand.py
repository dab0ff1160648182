"""A hand that strokes freely over a sample: where it is, how fast, how hard it presses."""

from __future__ import annotations

import math
from dataclasses import dataclass

from protocols.keyed import Key, uniform

REACH_MM = 42.0
"""Farthest from the middle along either axis: the samples measure 100 mm (thesis 3.3.1, 4.3.2)."""
STROKES_HZ = (0.25, 1.0)
"""Strokes back and forth a second."""
MEAN_FORCE_N = 1.1
FORCE_RANGE_N = (0.2, 3.6)
"""What the thesis' tablet renders at most (4.5.3), and light contact."""
TERMS = 3


@dataclass(frozen=True)
class Wave:
    """A sum of slow sines."""

    terms: tuple[tuple[float, float, float], ...]
    """(amplitude, rad/s, phase) of each."""

    def at(self, t_s: float) -> tuple[float, float, float]:
        """Value, first and second derivative over time."""
        value = rate = bend = 0.0
        for size, omega, phase in self.terms:
            angle = omega * t_s + phase
            sine, cosine = math.sin(angle), math.cos(angle)
            value += size * sine
            rate += size * omega * cosine
            bend -= size * omega * omega * sine
        return value, rate, bend


@dataclass(frozen=True)
class Hand:
    """One free exploration: two axes of motion on the surface, and a pressure that comes and goes."""

    x_mm: Wave
    y_mm: Wave
    effort: Wave

    def force_N(self, t_s: float) -> float:
        """Normal force: around 1.1 N, always in contact."""
        force = MEAN_FORCE_N * math.exp(self.effort.at(t_s)[0])
        return min(max(force, FORCE_RANGE_N[0]), FORCE_RANGE_N[1])


def free_hand(*key: Key) -> Hand:
    """The exploration that the key decides."""
    return Hand(
        _wave(REACH_MM, STROKES_HZ, *key, "x"),
        _wave(REACH_MM, STROKES_HZ, *key, "y"),
        _wave(1.2, (0.1, 0.5), *key, "effort"),
    )


def _wave(largest: float, band_hz: tuple[float, float], *key: Key) -> Wave:
    """Sines of different frequencies in the band; together they never exceed `largest`."""
    low, high = band_hz
    shares = [0.5 + uniform(*key, "size", n) for n in range(TERMS)]
    terms = []
    for n, share in enumerate(shares):
        hertz = low + (high - low) * (n + uniform(*key, "frequency", n)) / TERMS
        terms.append((largest * share / sum(shares), 2 * math.pi * hertz, 2 * math.pi * uniform(*key, "phase", n)))
    return Wave(tuple(terms))
