"""Plausibility of made profiles: work of opening, distance to measured ones, limits, and extreme wishes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from palpate.modeling.doors.data import TOP
from palpate.modeling.doors.methods import Fitted
from palpate.modeling.evaluate.rows import ModelDataError, as_rows
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG
from palpate.signals.doors.limits import LIMIT_N, STEEPEST_N_DEG, refusal

ROUNDING = 1e-9
"""How far beyond a limit a profile may lie by rounding, as a share of the limit."""
MIDDLE = TOP / 2
TOLERANCE = 10.0
"""A wish is attained where every attribute comes within this of it: the JND (thesis 5.5.4.1)."""
LOW, HIGH = 10.0, 90.0
"""Where thesis 5.7.1 sets one slider, the others in the middle."""


@dataclass(frozen=True)
class Plausibility:
    """The plausibility of one made profile.

    `greatest_N` is its greatest force and `steepest_N_deg` its greatest change over angle, either way; `work_J_m` the
    work of opening in joules per metre of handle radius (the integral of the force over the angle in radians).
    `distance_N` is the mean absolute difference to the nearest measured profile; `beyond` the share of the measured
    ones that have a nearer neighbour among themselves (1: it lies farther out than every measured one). `why` is the
    reason why it cannot be played, None where it can.
    """

    greatest_N: float
    steepest_N_deg: float
    work_J_m: float
    distance_N: float
    beyond: float
    why: str | None

    @property
    def playable(self) -> bool:
        """Whether it is within the limits of a made profile, and not refused by the door."""
        return self.why is None


def assess_profiles(force_N: Array, measured_N: Array) -> tuple[Plausibility, ...]:
    """Assess made profiles (n, 621) in newtons against measured ones (m, 621), at least two of them distinct.

    Raises ModelDataError for rows that are no profiles.
    """
    made = as_rows(force_N, POINTS, "made profiles")
    measured = np.unique(as_rows(measured_N, POINTS, "measured profiles"), axis=0)
    if len(measured) < 2:
        raise ModelDataError(f"{len(measured)} distinct measured profile: distances among them need at least two.")
    among = np.array([np.delete(distances_N(profile, measured), at).min() for at, profile in enumerate(measured)])
    assessed = []
    for profile in made:
        distance = float(distances_N(profile, measured).min())
        assessed.append(
            Plausibility(
                greatest_N=_greatest(profile),
                steepest_N_deg=_steepest(profile),
                work_J_m=work_J_m(profile),
                distance_N=distance,
                beyond=float(np.mean(among < distance)),
                why=reason_unplayable(profile),
            )
        )
    return tuple(assessed)


def distances_N(profile: Array, others: Array) -> Array:
    """Return mean absolute differences (n,) in newtons of a profile (621,) to others (n, 621)."""
    distances: Array = np.abs(others - profile).mean(axis=1)
    return distances


def work_J_m(profile: Array) -> float:
    """Return the work of opening, in joules per metre of handle radius: trapezia over the angle in radians."""
    return float(np.trapezoid(profile, dx=np.radians(1 / POINTS_PER_DEG)))


def reason_unplayable(profile: Array) -> str | None:
    """Return why a profile (621,) cannot be played: the limit that it breaks, or the door's refusal; else None."""
    force, slope = _greatest(profile), _steepest(profile)
    if force > LIMIT_N * (1 + ROUNDING):
        return f"a force of {force:.1f} N; at most {LIMIT_N:g} N may be made"
    if slope > STEEPEST_N_DEG * (1 + ROUNDING):
        return f"a change of {slope:.1f} N/deg; at most {STEEPEST_N_DEG:g} N/deg may be made"
    return refusal(profile)


def _greatest(profile: Array) -> float:
    return float(np.abs(profile).max())


def _steepest(profile: Array) -> float:
    return float(np.abs(np.diff(profile)).max()) * POINTS_PER_DEG


@dataclass(frozen=True)
class Extreme:
    """An extreme wish (attributes,), the forward model's ratings of its profile, and the profile's plausibility.

    `nearest` are these ratings, clipped to 0..100: the nearest to the wish that the inverse reached.
    """

    wish: Array
    nearest: Array
    plausibility: Plausibility

    @property
    def is_attained(self) -> bool:
        """Whether every attribute comes within TOLERANCE of the wish."""
        return bool(np.all(np.abs(self.nearest - self.wish) <= TOLERANCE))


def corners(attributes: int) -> Array:
    """Return all 2^attributes wishes of 0 and 100, (2^attributes, attributes)."""
    return np.array(list(product((0.0, TOP), repeat=attributes)))


def singles(attributes: int, low: float = 0.0, high: float = TOP) -> Array:
    """Return wishes (2 attributes, attributes) with one slider at `low` or `high` and the others in the middle."""
    wishes = np.full((2 * attributes, attributes), MIDDLE)
    for slider in range(attributes):
        wishes[2 * slider : 2 * slider + 2, slider] = low, high
    return wishes


def extremes(inverse: Fitted, wishes: Array, forward: Fitted, measured_N: Array) -> tuple[Extreme, ...]:
    """Make profiles for extreme wishes (n, attributes), and assess them against measured ones (m, 621)."""
    made = inverse.predict(wishes)
    ratings = np.clip(forward.predict(made), 0.0, TOP)
    assessed = assess_profiles(made, measured_N)
    return tuple(Extreme(*parts) for parts in zip(wishes, ratings, assessed, strict=True))


def unplayable(extremes: Sequence[Extreme]) -> int:
    """Return the number of profiles among these that the door cannot play."""
    return sum(not extreme.plausibility.playable for extreme in extremes)
