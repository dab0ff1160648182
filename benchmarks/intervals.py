"""Figures of conformal intervals: the share of new answers that they cover against the nominal one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.modeling.evaluate.intervals import COVERAGE, half_widths
from palpate.protocols.bench import Case
from palpate.signals.arrays import Array

if TYPE_CHECKING:
    from numpy.random import Generator

AREA = "intervals"
NORMAL_Z = 1.6448536269514722
"""SDs on either side of the mean that hold 90 % of a normal distribution."""
SIZES = (20, 90)
"""Numbers of calibration stimuli: few, and the 90 of door_ratings."""
Widths = Callable[[Array], Array]


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of many calibrations at once, one per column; the distribution gives the exact coverage."""
    times = 2_000 if quick else 20_000
    for name, draw, share_within in distributions():
        for n in SIZES:
            residual = draw(np.random.Generator(np.random.PCG64(n)), (n, times))
            widths: dict[str, Widths] = {"palpate, conformal": half_widths, "1.645 SD": normal_widths}
            for method, run in widths.items():
                yield Case(AREA, "intervals: new answers held", method, f"{name}, {n} stimuli",
                           n * times, f"share held, off {COVERAGE:g}", partial(run, residual),
                           partial(coverage_error, share_within), 3)  # fmt: skip


def distributions() -> Iterator[tuple[str, Callable[[Generator, tuple[int, int]], Array], Callable[[Array], Array]]]:
    """Yield residuals: a name, a function that draws them, and the share of new ones up to a width.

    Skewed ones are exponential, minus their mean of 1.
    """
    from scipy.stats import expon, norm, t

    frozen: tuple[tuple[str, Any], ...] = (
        ("normal", norm()), ("t(3)", t(3)), ("skewed", expon(-1))
    )  # fmt: skip
    for name, law in frozen:
        yield name, partial(_draw, law), partial(_share_within, law)


def _draw(law: Any, chance: Generator, shape: tuple[int, int]) -> Array:
    return np.asarray(law.rvs(size=shape, random_state=chance))


def _share_within(law: Any, width: Array) -> Array:
    return np.asarray(law.cdf(width) - law.cdf(-width))


def normal_widths(residual: Array) -> Array:
    """Return widths that hold 90 % of a normal distribution of this SD, a common but different choice."""
    return np.asarray(NORMAL_Z * residual.std(axis=0, ddof=1))


def coverage_error(share_within: Callable[[Array], Array], widths: Array) -> float:
    """Return how far the mean share of new answers within the widths lies from the nominal one."""
    return abs(float(np.mean(share_within(widths))) - COVERAGE)
