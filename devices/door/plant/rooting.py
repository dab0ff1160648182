"""Where a function first falls to zero: a bracketed secant search that always ends."""

from __future__ import annotations

from collections.abc import Callable

CLOSE = 1e-13
"""Width of the bracket at the end, as a share of the interval."""


def first_zero(value: Callable[[float], float], start: float, end: float, at_start: float, at_end: float) -> float:
    """The place between `start` and `end` where `value` passes from above zero to below; the side below is given.

    `at_end` is below zero. Where `at_start` is not above zero, the interval is halved towards `start` until a place
    above is found; without one the answer is `start`. Illinois' variant of the secant method (Dowell and Jarratt 1971).
    """
    low, high, above, below = start, end, at_start, at_end
    while above <= 0.0:
        middle = start + (high - start) / 8
        if middle - start <= CLOSE * (end - start):
            return start
        here = value(middle)
        if here > 0.0:
            low, above = middle, here
        else:
            high, below = middle, here
    kept = 0
    for _ in range(80):
        if high - low <= CLOSE * (end - start) or below == 0.0:
            break
        guess = high - below * (high - low) / (below - above)
        if not low < guess < high:
            guess = 0.5 * (low + high)
        here = value(guess)
        if here > 0.0:
            low, above, below, kept = guess, here, below * (0.5 if kept == 1 else 1.0), 1
        else:
            high, below, above, kept = guess, here, above * (0.5 if kept == -1 else 1.0), -1
    return high
