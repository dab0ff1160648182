"""Figures of `doors normalise`: its rule against exact arithmetic, and a known door against other rules."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import partial
from itertools import pairwise

import numpy as np

from palpate.protocols.bench import Case
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import MAX_ANGLE_DEG, POINTS, POINTS_PER_DEG
from palpate.signals.doors.profiles import normalise

AREA = "profiles"
GRID_DEG = np.arange(POINTS) / POINTS_PER_DEG
RATE_HZ = 1000
NOISE_N = 0.1
WAVES = ((18.0, 7.0, 0.3), (9.0, 3.1, 1.0), (4.0, 1.3, 2.0), (0.8, 0.6, 0.5))
"""The waves of the known door's force: newtons, degrees per radian, phase."""
Rule = Callable[[Array, Array], Array]


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of one opening of six seconds (`quick`: two) at 1 kHz with uneven speed."""
    seconds = 2 if quick else 6
    angle = opening_deg(seconds)
    force = force_N(angle)
    input_name = f"{len(angle)} rows"
    yield Case(AREA, "doors normalise: the rule", "palpate", input_name, len(angle), "N at most; exact fractions",
               partial(palpate, angle, force), partial(worst, exact_N(angle, force)), 5)  # fmt: skip
    noisy = force + NOISE_N * np.random.Generator(np.random.PCG64(3)).standard_normal(len(force))
    rules: dict[str, Rule] = {
        "palpate": palpate,
        "ten evenly chosen rows a degree": ten_rows,
        "the line's value at each point": at_points,
    }
    for noise, values in (("no noise", force), (f"noise of {NOISE_N:g} N", noisy)):
        for name, rule in rules.items():
            yield Case(AREA, "doors normalise: a known door", name, f"{input_name}, {noise}", len(angle),
                       "N RMS; integral", partial(rule, angle, values), partial(rms, means_N()), 5)  # fmt: skip


def opening_deg(seconds: float) -> Array:
    """Return the angles of an opening from 0 to just past 62 degrees, whose speed varies by 40 %."""
    t = np.linspace(0.0, 1.0, round(seconds * RATE_HZ))
    return np.asarray((MAX_ANGLE_DEG + 0.5) * (t + 0.4 / (4 * np.pi) * np.sin(4 * np.pi * t)))


def force_N(angle_deg: Array) -> Array:
    """Return the known door's force at each angle."""
    return np.asarray(sum(size * np.sin(angle_deg / period + phase) for size, period, phase in WAVES))


def means_N() -> Array:
    """Return the known door's profile: its force at 0, then the exact mean over each point's tenth of a degree.

    The last tenth is as complete as the others, since the door opens further than 62 degrees.
    """
    half = 0.5 / POINTS_PER_DEG
    low, high = GRID_DEG - half, GRID_DEG + half
    integral = sum(
        size * period * (np.cos(low / period + phase) - np.cos(high / period + phase)) for size, period, phase in WAVES
    )
    return np.asarray(np.r_[force_N(GRID_DEG[:1]), (integral / (high - low))[1:]])


def palpate(angle: Array, force: Array) -> Array:
    """Normalise by the product's rule."""
    return normalise(angle, force).force_N


def ten_rows(angle: Array, force: Array) -> Array:
    """Normalise as thesis 5.3.1.2 says: ten evenly chosen rows of each degree, one after another."""
    chosen = [force[0]]
    for degree in range(MAX_ANGLE_DEG):
        rows = np.flatnonzero((angle > degree) & (angle <= degree + 1))
        chosen += list(force[rows[np.round(np.linspace(0, len(rows) - 1, POINTS_PER_DEG)).astype(int)]])
    return np.array(chosen)


def at_points(angle: Array, force: Array) -> Array:
    """Return the linear interpolation between rows at each point of the grid, without a mean."""
    return np.interp(GRID_DEG, angle, force)


def exact_N(angle: Array, force: Array) -> list[Fraction]:
    """Return the product's rule in exact arithmetic: the mean of the lines over the tenth around each point."""
    x, y = ([Fraction(float(value)) for value in values] for values in (angle, force))
    half = Fraction(1, 2 * POINTS_PER_DEG)
    middles = [Fraction(n, POINTS_PER_DEG) for n in range(POINTS)]
    edges = [middle - half for middle in middles[1:]] + [middles[-1] + half]
    areas, row, total = [], 0, Fraction(0)
    for edge in edges:
        while x[row + 1] <= edge:
            total += (y[row] + y[row + 1]) / 2 * (x[row + 1] - x[row])
            row += 1
        slope = (y[row + 1] - y[row]) / (x[row + 1] - x[row])
        areas.append(total + (edge - x[row]) * (y[row] + slope * (edge - x[row]) / 2))
    return [y[0], *((b - a) / (2 * half) for a, b in pairwise(areas))]


def worst(exact: list[Fraction], result: Array) -> float:
    """Return the largest difference from the exact fractions."""
    return float(max(abs(Fraction(float(value)) - true) for value, true in zip(result, exact, strict=True)))


def rms(true: Array, result: Array) -> float:
    """Return the root mean square of the differences."""
    return float(np.sqrt(np.mean((result - true) ** 2)))
