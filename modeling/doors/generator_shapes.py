"""Plausible doors from measured ones, and the short code that a made profile is written in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from palpate.modeling.doors.data import ModelDataError
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG
from palpate.signals.doors.limits import bounded_profiles

MIXED = 3
"""At most so many measured profiles are mixed."""
KNOTS = 6
"""Angles at which a mixture's features are moved, the two ends of the motion among them."""
MOVED_DEG = 3.5
"""How far they are moved at most."""
SCALES = 5
"""Angles at which a mixture's force is scaled."""
SCALED = 0.4
"""By how much at most, as a share."""


@dataclass(frozen=True)
class Code:
    """force = mean + code @ basis: mean (621,), basis (components, 621), both in newtons; a code has SD 1."""

    mean: Array
    basis: Array

    def decoded(self, code: Array) -> Array:
        """(n, components) to (n, 621) newtons, not bounded yet."""
        force: Array = self.mean + code @ self.basis
        return force

    def encoded(self, force_N: Array) -> Array:
        """(n, 621) newtons to the nearest code (n, components); the rows of the basis are orthogonal."""
        code: Array = (force_N - self.mean) @ self.basis.T / np.sum(self.basis**2, axis=1)
        return code


def opened(force_N: Array) -> Array:
    """Profiles (n, 621) as doors that open all the way, within the limits: the last force goes on to the end.

    Zeros behind the end of a motion are padding; mixed with other doors they would become a step in the force.
    """
    return bounded_profiles(np.array([_filled(profile) for profile in force_N]))


def plausible(doors: Array, count: int, chance: Generator) -> Array:
    """`count` profiles (count, 621) beside the measured (n, 621): mixed, their features moved, their force scaled."""
    return np.array([_varied(_mixture(doors, chance), chance) for _ in range(count)])


def code_of(profiles: Array, components: int) -> Code:
    """The principal components of profiles (n, 621), scaled so that their codes have SD 1.

    Raises ModelDataError where all profiles are equal.
    """
    mean = profiles.mean(axis=0)
    _, singular, right = np.linalg.svd(profiles - mean, full_matrices=False)
    kept = min(components, int(np.sum(singular > 1e-9 * max(singular[0], 1e-9))))
    if kept == 0:
        raise ModelDataError("all profiles to learn from are equal: no other can be made from them.")
    right = right[:kept] * np.sign(right[np.arange(kept), np.argmax(np.abs(right[:kept]), axis=1)])[:, None]
    return Code(mean, right * (singular[:kept, None] / np.sqrt(len(profiles))))


def _filled(profile: Array) -> Array:
    moving = np.flatnonzero(profile)
    if not moving.size:
        return profile
    end = int(moving[-1])
    return np.concatenate([profile[: end + 1], np.full(POINTS - end - 1, profile[end])])


def _mixture(doors: Array, chance: Generator) -> Array:
    count = chance.integers(1, MIXED + 1)
    mixed: Array = chance.dirichlet(np.ones(count)) @ doors[chance.integers(0, len(doors), count)]
    return mixed


def _varied(profile: Array, chance: Generator) -> Array:
    """Features moved along the angle, piecewise linear, and the force scaled by a share that varies along it."""
    grid, end = np.arange(POINTS, dtype=np.float64), POINTS - 1
    knots = np.linspace(0, end, KNOTS)
    moved = knots + np.r_[0, chance.uniform(-MOVED_DEG, MOVED_DEG, KNOTS - 2) * POINTS_PER_DEG, 0]
    shifted = np.interp(np.interp(grid, moved, knots), grid, profile)
    strength = chance.uniform(0, SCALED)
    shares = 1 + strength * chance.uniform(-1, 1, SCALES)
    return np.asarray(shifted * np.interp(grid, np.linspace(0, end, SCALES), shares))
