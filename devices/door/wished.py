"""A stand-in for the trained perception-to-force model (thesis 5.6) until one exists: seven wishes make a door.

Each wish turns six dials of the mechanical door at once. How far was found by a search that let the simulated raters of
studies/door_ratings feel as wished, one attribute at a time; studies/door_matching/README.md says how well they do.
Nothing here is fitted to a person.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.door.grid import POINTS, POINTS_PER_DEG, DoorDataError
from devices.door.mechanics import CheckFeature, Door, simulate

Array = NDArray[np.float64]

LOWEST, NEUTRAL, HIGHEST = 0.0, 50.0, 100.0
LIMIT_N = 60.0
"""No wish makes a force beyond this; the study's own profiles reach 44.5 N."""
STEEPEST_N_DEG = 60.0
"""Nor a steeper change: 6 N from one point to the next, where the study's own doors break away with up to 8.7 N."""


@dataclass(frozen=True)
class Dials:
    """What a wish can turn."""

    drag_Nm: float
    crest_J: float
    pull_Nm: float
    last_J: float
    width_deg: float
    step_J: float


SLACK = Dials(drag_Nm=2.5, crest_J=0.2, pull_Nm=4.0, last_J=-4.5, width_deg=3.8, step_J=0.0)
FULL = Dials(drag_Nm=24.0, crest_J=3.2, pull_Nm=46.0, last_J=4.5, width_deg=1.1, step_J=0.5)
MIDDLE = (-0.23, 0.11, 0.13, 0.15, 0.47, -0.99)
"""Where the dials stand with every wish at 50: hyperbolic tangents of these, from -1 (slack) to 1 (full)."""
TURNS: Mapping[str, tuple[float, ...]] = {
    "Easy-to-pull": (0.67, 0.08, -0.39, -0.45, 0.52, -0.48),
    "Damped": (-0.48, 1.79, 0.25, 0.31, -0.31, 0.74),
    "Consistent": (-0.1, 0.74, 0.88, -0.61, 1.3, -0.42),
    "Pleasant": (-0.6, 0.76, 0.49, 1.76, -0.04, -0.6),
    "New": (0.44, -0.7, 1.53, -0.27, 1.0, 0.62),
    "Comfort": (0.38, -0.52, -1.18, 1.26, -0.31, 1.07),
    "Luxurious": (-0.27, -0.3, 0.52, 1.44, 0.18, 0.69),
}
"""How far each wish, at 100, moves the dials; the low word names the attribute (Table 5.2)."""


def wished_profile(wish: Mapping[str, float]) -> Array:
    """The 621 forces, in newtons, of a door that should feel as wished.

    `wish` holds the seven attributes of Table 5.2 by their low word, each from 0 (that word) to 100 (its antonym).

    Raises:
        DoorDataError: an attribute that is missing or unknown, or a value outside 0 to 100.
    """
    return bounded(simulate(wished_door(wish), "the wished door"))


def wished_door(wish: Mapping[str, float]) -> Door:
    """The mechanical door that the wish stands for. Raises as `wished_profile`."""
    return _door(_dials(_checked(wish)))


def hardest() -> tuple[float, ...]:
    """A profile at the bounds of what a wish may come to: up and down between them as steeply as is allowed."""
    step, length = STEEPEST_N_DEG / POINTS_PER_DEG, round(2 * LIMIT_N * POINTS_PER_DEG / STEEPEST_N_DEG)
    return tuple(LIMIT_N - step * abs(place % (2 * length) - length) for place in range(POINTS))


def bounded(force_N: Array) -> Array:
    """The profile within LIMIT_N, and no steeper than STEEPEST_N_DEG: where it is, it follows as fast as it may."""
    step = STEEPEST_N_DEG / POINTS_PER_DEG
    made = np.clip(force_N, -LIMIT_N, LIMIT_N)
    for place in np.flatnonzero(np.abs(np.diff(made)) > step) + 1:
        for index in range(place, len(made)):
            reached = min(max(made[index], made[index - 1] - step), made[index - 1] + step)
            if reached == made[index]:
                break
            made[index] = reached
    return made


def _checked(wish: Mapping[str, float]) -> list[float]:
    if set(wish) != set(TURNS):
        raise DoorDataError(f"wishes for {', '.join(TURNS)} are expected, found {', '.join(sorted(wish)) or 'none'}.")
    for name, value in wish.items():
        if not LOWEST <= value <= HIGHEST:
            raise DoorDataError(f"the wish for {name} is {value!r}: from {LOWEST:g} to {HIGHEST:g} is expected.")
    return [(wish[name] - NEUTRAL) / (HIGHEST - NEUTRAL) for name in TURNS]


def _dials(shares: list[float]) -> Dials:
    """Every dial within its range, whatever is wished: the wishes add up and saturate."""
    turned = [
        middle + math.fsum(share * turn[dial] for share, turn in zip(shares, TURNS.values(), strict=True))
        for dial, middle in enumerate(MIDDLE)
    ]
    ends = zip(turned, vars(SLACK).values(), vars(FULL).values(), strict=True)
    return Dials(*(slack + (full - slack) * (math.tanh(turn) + 1) / 2 for turn, slack, full in ends))


def _door(dials: Dials) -> Door:
    """A mid-size door with these dials: a crest, two detents, a last crest or detent, and up to two small steps."""
    width, deep_J = dials.width_deg, dials.pull_Nm * math.radians(dials.width_deg)
    check = (
        CheckFeature(18.0, dials.crest_J, 4.0, 3.8),
        CheckFeature(29.0, -0.6 * deep_J, width, 1.05 * width),
        CheckFeature(46.0, -deep_J, 1.05 * width, 1.15 * width),
        CheckFeature(63.5, dials.last_J, 2.8, 3.2),
        CheckFeature(54.0, 0.3 * dials.step_J, 1.2, 1.2),
        CheckFeature(37.5, 0.5 * max(0.0, dials.step_J - 0.25), 1.2, 1.2),
    )
    return Door(
        mass_kg=32, centre_of_mass_m=0.55, gyration_radius_m=0.66, handle_radius_m=1.0, hinge_tilt_deg=1.2,
        lowest_at_deg=-3, coulomb_Nm=dials.drag_Nm, breakaway_Nm=1.4 * dials.drag_Nm, stribeck_speed_deg_s=6,
        viscous_Nm_s_rad=4, ripple_Nm=0.1, ripple_period_deg=2.6, seal_Nm=10, seal_range_deg=2.5, stop_at_deg=66,
        stop_stiffness_Nm_rad=400, stop_onset_deg=1.0, pull_limit_N=100, take_up_deg=0.4, speed_deg_s=14, start_deg=11,
        opens_to_deg=68, check=check,
    )  # fmt: skip
