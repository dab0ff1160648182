"""A hand that strokes freely over a sample: strokes and turns, pauses, a varying pressure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from palpate.protocols.keyed import Key, uniform
from palpate.signals.arrays import Array

REACH_MM = 42.0
"""Greatest distance from the middle along either axis: the samples measure 100 mm (thesis 3.3.1)."""
STROKES_HZ = (0.2, 0.8)
"""Strokes back and forth per second. Together with the reach they keep the speed below 300 mm/s (4.5.3)."""
FORCE_N = (0.2, 3.6)
"""Least and greatest force while the tip is down (4.5.3)."""
EFFORT_HZ = (0.1, 0.6)
TERMS = 3
WINDOW_S, PAUSE_S = 7.0, (0.3, 0.8)
"""The hand pauses about once in this time, for this long."""
RAMP_S = 0.25
"""Time in which it stops, and starts again."""
LANDS_S = 0.3
"""Time in which it lands, and lifts off."""


@dataclass(frozen=True)
class Motion:
    """Place, velocity and acceleration along the surface (x, y; mm, mm/s, mm/s^2), and force into it (N)."""

    place: Array
    velocity: Array
    turn: Array
    force: Array


class Hand(Protocol):
    """The motion of the tool."""

    def at(self, t_s: Array) -> Motion:
        """Return the motion at these times; arrays of shape (2, n), force (n,)."""


@dataclass(frozen=True)
class SteadyHand:
    """A stroke at constant speed and force, for measurements, without end over the repeated sample."""

    speed_mm_s: float
    force_N: float
    degrees: float = 31.0

    def at(self, t_s: Array) -> Motion:
        """Return the motion at these times."""
        way = np.array([math.cos(math.radians(self.degrees)), math.sin(math.radians(self.degrees))])[:, np.newaxis]
        velocity = np.broadcast_to(self.speed_mm_s * way, (2, len(t_s)))
        return Motion(velocity * t_s, velocity, np.zeros((2, len(t_s))), np.full(len(t_s), self.force_N))


@dataclass(frozen=True)
class Wave:
    """A sum of slow sines: sizes, rad/s and phases, each of shape (TERMS,)."""

    sizes: Array
    omegas: Array
    phases: Array

    def at(self, t_s: Array) -> Array:
        """Return value, first and second derivative over time, of shape (3, n)."""
        angle = np.outer(self.omegas, t_s) + self.phases[:, np.newaxis]
        sine, cosine = np.sin(angle), np.cos(angle)
        return np.stack([self.sizes @ sine, (self.sizes * self.omegas) @ cosine, -(self.sizes * self.omegas**2) @ sine])


@dataclass(frozen=True)
class Pauses:
    """The pauses of the hand: from `begins` to `ends`, in order, with smooth flanks of RAMP_S around both."""

    begins: Array
    ends: Array

    def run(self, t_s: Array) -> Array:
        """Return the time that the strokes have run for, its rate (1 at full pace, 0 at rest) and the rate's slope: (3,
        n).
        """
        # Only the pause before and the one after a time can be under way; older ones took all of their time.
        before = np.concatenate([[0.0], np.cumsum(self.ends - self.begins)])
        index = np.searchsorted(self.begins - RAMP_S / 2, t_s, side="right") - 1
        at = np.clip(index, 0, None)
        down, up = _flank(t_s - self.begins[at]), _flank(t_s - self.ends[at])
        inside = np.where(index >= 0, 1.0, 0.0)
        lost = before[at] * inside + inside * (down[0] - up[0])
        return np.stack([t_s - lost, 1 - inside * (down[1] - up[1]), -inside * (down[2] - up[2])])


@dataclass(frozen=True)
class FreeHand:
    """A free exploration of `seconds`; at rest and off the surface after it."""

    seconds: float
    x_mm: Wave
    y_mm: Wave
    effort: Wave
    pauses: Pauses

    def at(self, t_s: Array) -> Motion:
        """Return the motion at these times."""
        run, rate, bend = self.pauses.run(t_s)
        ways = np.stack([self.x_mm.at(run), self.y_mm.at(run)])
        share = np.clip(np.minimum(t_s, self.seconds - t_s) / LANDS_S, 0, 1)
        down = share * share * (3 - 2 * share)
        low, high = FORCE_N
        force = low * (high / low) ** (0.5 + 0.5 * self.effort.at(t_s)[0]) * down
        return Motion(ways[:, 0], ways[:, 1] * rate, ways[:, 2] * rate**2 + ways[:, 1] * bend, force)


def free_hand(seconds: float, *key: Key) -> FreeHand:
    """Return an exploration of `seconds`, seeded by the key."""
    return FreeHand(
        seconds,
        slow_wave(REACH_MM, STROKES_HZ, *key, "x"),
        slow_wave(REACH_MM, STROKES_HZ, *key, "y"),
        slow_wave(1.0, EFFORT_HZ, *key, "effort"),
        _pauses(seconds, *key, "pauses"),
    )


def slow_wave(largest: float, band_hz: tuple[float, float], *key: Key) -> Wave:
    """Return a sum of sines of different frequencies in the band, which never exceeds `largest`."""
    low, high = band_hz
    shares = np.array([0.5 + uniform(*key, "size", n) for n in range(TERMS)])
    hertz = [low + (high - low) * (n + uniform(*key, "frequency", n)) / TERMS for n in range(TERMS)]
    phases = [2 * math.pi * uniform(*key, "phase", n) for n in range(TERMS)]
    return Wave(largest * shares / shares.sum(), 2 * math.pi * np.array(hertz), np.array(phases))


def _pauses(seconds: float, *key: Key) -> Pauses:
    """Return a pause in each window within the act, and rest before and after the act."""
    begins, ends = [-1.0], [min(LANDS_S, seconds / 4)]
    for window in range(1, int(seconds / WINDOW_S)):
        length = PAUSE_S[0] + (PAUSE_S[1] - PAUSE_S[0]) * uniform(*key, "length", window)
        begin = WINDOW_S * window + (WINDOW_S - PAUSE_S[1] - 2 * RAMP_S) * uniform(*key, "begin", window)
        begins.append(begin)
        ends.append(begin + length)
    begins.append(max(seconds - LANDS_S, ends[-1] + RAMP_S))
    ends.append(math.inf)
    return Pauses(np.array(begins), np.array(ends))


def _flank(t_s: Array) -> Array:
    """Return a smooth step at 0, RAMP_S wide: its integral, itself, its slope."""
    share = np.clip(t_s / RAMP_S + 0.5, 0, 1)
    integral = RAMP_S * (share**3 - share**4 / 2) + np.maximum(t_s - RAMP_S / 2, 0)
    return np.stack([integral, share * share * (3 - 2 * share), 6 * share * (1 - share) / RAMP_S])
