"""Random draws of participants, units and orders: seeds, numbers of draws, intervals and p values.

Each purpose has its own random numbers, so that a further draw for one purpose changes no other. Source of the
percentile interval: Efron & Tibshirani 1993, ch. 13.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator

import numpy as np
from numpy.random import PCG64, Generator, SeedSequence

from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadOption, refuse_idle, shown

LEAST_DRAWS = 19  # the smallest p of fewer random draws lies above .05


def generator(seed: int, purpose: str) -> Generator:
    """Return random numbers that depend only on the seed and their purpose, for reliability and words.

    Raises BadOption for a seed that is not a whole number from 0.
    """
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise BadOption(f"seed={shown(seed)}: a whole number from 0 is expected")
    return Generator(PCG64([seed, zlib.crc32(purpose.encode())]))


def stream(seed: int, purpose: str) -> Generator:
    """Return the random generator of a purpose, for spaces and choices.

    It is seeded by the whole text of the purpose, while `generator` uses its checksum, so that recorded results do not
    change.

    Raises BadOption for a seed that is not a whole number from 0.
    """
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise BadOption(f"seed={shown(seed)}: expected a whole number from 0")
    return Generator(PCG64(SeedSequence([seed, *purpose.encode()])))


def demand_draws(draws: object) -> None:
    """Raise BadOption for a number of draws too small for the tails of an interval; 0 means no interval."""
    if isinstance(draws, bool) or not isinstance(draws, int) or (draws != 0 and draws < 100):
        raise BadOption(f"draws={shown(draws)}: at least 100 are expected, or 0 for no interval")


def check_draws(draws: int) -> None:
    """Raise BadOption for a number of draws too small for a p value or an interval."""
    if isinstance(draws, bool) or not isinstance(draws, int) or draws < LEAST_DRAWS:
        raise BadOption(f"draws={shown(draws)}: expected a whole number from {LEAST_DRAWS}")


def check_share(value: float, name: str) -> None:
    """Raise BadOption for a confidence or quantile outside (0, 1)."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < 1:
        raise BadOption(f"{name}={shown(value)}: expected a share between 0 and 1, such as 0.95")


def refuse_without_draws(draws: int, **options: tuple[object, object]) -> None:
    """Raise BadOption for options of an interval that differ from their defaults if there are no draws."""
    for name, (value, default) in options.items() if not draws else ():
        refuse_idle(name, value, default, "with draws=0: there is no interval")


def weights(rng: Generator, units: int, draws: int, at_once: int = 500) -> Iterator[Floats]:
    """Yield how often each of the units is drawn, in blocks of shape (up to `at_once`, units)."""
    for start in range(0, draws, at_once):
        yield rng.multinomial(units, [1 / units] * units, size=min(at_once, draws - start)).astype(np.float64)


def percentile(drawn: Floats, confidence: float) -> tuple[float, float]:
    """Return the interval between two quantiles of the draws; NaN draws are left out, NaN if fewer than half remain."""
    defined = drawn[~np.isnan(drawn)]
    if not len(drawn) or 2 * len(defined) < len(drawn):
        return math.nan, math.nan
    tail = (1 - confidence) / 2
    low, high = np.quantile(defined, [tail, 1 - tail])
    return float(low), float(high)


def p_of_draws(as_extreme: int, draws: int) -> float:
    """Return the p of a permutation test: the observed value counts as one of the draws, so it is never 0."""
    return (1 + as_extreme) / (1 + draws)
