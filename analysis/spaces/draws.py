"""Randomness that depends on a seed and on what it is for, never on the order of rows."""

from __future__ import annotations

from numpy.random import PCG64, Generator, SeedSequence

from palpate.analysis.statistics.refusals import BadOption, shown

LEAST_DRAWS = 19  # the smallest p of fewer random draws lies above .05


def stream(seed: int, purpose: str) -> Generator:
    """A generator of its own for each purpose, so that one more draw for one changes no other.

    Raises BadOption for a seed that is not a whole number from 0.
    """
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise BadOption(f"seed={shown(seed)}: expected a whole number from 0")
    return Generator(PCG64(SeedSequence([seed, *purpose.encode()])))


def check_draws(draws: int) -> None:
    """Refuse a number of draws that no p or interval can rest on."""
    if isinstance(draws, bool) or not isinstance(draws, int) or draws < LEAST_DRAWS:
        raise BadOption(f"draws={shown(draws)}: expected a whole number from {LEAST_DRAWS}")


def check_share(value: float, name: str) -> None:
    """Refuse a confidence or quantile outside (0, 1)."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < 1:
        raise BadOption(f"{name}={shown(value)}: expected a share between 0 and 1, such as 0.95")


def p_of_draws(as_extreme: int, draws: int) -> float:
    """The p of a permutation test: the observed value counts as one of the draws, so it is never 0."""
    return (1 + as_extreme) / (1 + draws)
