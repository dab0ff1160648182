"""Limited-memory BFGS in vector operations alone.

SciPy's L-BFGS-B hands its small matrices to threads of the linear algebra library: on a machine whose cores are busy a
map of 14 objects then took 30 times as long (11 s for 0.34 s), and differently long each time.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from palpate.analysis.statistics.doubles import Floats

Objective: TypeAlias = Callable[[Floats], tuple[float, Floats]]
MEMORY = 8
ENOUGH, SHORTEST = 1e-4, 1e-10
STILL = 1e-15  # relative fall of the value, several times in a row
PATIENCE = 5
SETTLED = 1e-15  # length of a slope, for a value and places of order 1


def descended(objective: Objective, start: Floats, steps: int) -> tuple[Floats, float]:
    """A point where the objective (value and slope) no longer falls, and its value; at most `steps` steps.

    Source: Nocedal & Wright 2006, algorithms 7.4 and 3.1 (Armijo's rule with quadratic interpolation).
    """
    place, (value, slope) = start, objective(start)
    past: deque[tuple[Floats, Floats]] = deque(maxlen=MEMORY)
    still = 0
    for _ in range(steps):
        direction = -_turned(slope, past) if past else -slope / (float(np.sqrt(slope @ slope)) or 1.0)
        found = _along(objective, place, value, slope, direction)
        if found is None:
            if not past:
                break
            past.clear()  # a stale memory: try the steepest descent once
            continue
        moved, lower, tilt = found
        step, change = moved - place, tilt - slope
        if step @ change > 1e-12 * float(change @ change):
            past.append((step, change))
        still = still + 1 if value - lower <= STILL * max(abs(value), 1e-12) else 0
        place, value, slope = moved, lower, tilt
        if still >= PATIENCE:
            break
    return place, value


def settled(objective: Objective, start: Floats, steps: int) -> Floats:
    """A point near a minimum moved on until its slope is nothing but rounding.

    A value tells its minimum's place to half of the digits, and which half depends on the processor; the slope tells it
    to all. A step is kept while the slope shrinks; one that is not teaches the memory all the same.
    """
    place, slope = start, objective(start)[1]
    size, past, patience = float(np.sqrt(slope @ slope)), deque[tuple[Floats, Floats]](maxlen=3 * MEMORY), 4 * PATIENCE
    for _ in range(steps):
        if size <= SETTLED or not patience:
            break
        direction = -_turned(slope, past) if past else -slope
        moved = place + direction
        tilt = objective(moved)[1]
        step, change = moved - place, tilt - slope
        if step @ change > 1e-12 * float(change @ change):
            past.append((step, change))
        reached = float(np.sqrt(tilt @ tilt))
        if reached >= size:
            patience -= 1
            continue
        place, slope, size = moved, tilt, reached
    return place


def _along(
    objective: Objective, place: Floats, value: float, slope: Floats, direction: Floats
) -> tuple[Floats, float, Floats] | None:
    """The first point along a direction that is lower by enough; None where there is none."""
    fall = float(slope @ direction)
    length = 1.0
    while fall < 0 and length > SHORTEST:
        moved = place + length * direction
        reached, tilt = objective(moved)
        if reached <= value + ENOUGH * length * fall:
            return moved, reached, tilt
        lowest = -fall * length * length / (2 * (reached - value - fall * length))
        length = min(max(lowest, 0.1 * length), 0.5 * length)
    return None


def _turned(slope: Floats, past: deque[tuple[Floats, Floats]]) -> Floats:
    """The slope times the inverse curvature that the past steps tell (two loops)."""
    turned, weights = slope.copy(), []
    for step, change in reversed(past):
        weight = float(step @ turned) / float(step @ change)
        weights.append(weight)
        turned -= weight * change
    step, change = past[-1]
    turned *= float(step @ change) / float(change @ change)
    for (step, change), weight in zip(past, reversed(weights), strict=True):
        turned += (weight - float(change @ turned) / float(step @ change)) * step
    return turned
