"""Minimisation of stress-1: majorisation, then a quasi-Newton descent of stress itself.

Disparities are the numbers in the order of the dissimilarities that are nearest to the map's distances. The descent is
limited-memory BFGS in vector operations only: SciPy's L-BFGS-B passes its small matrices to threads of the linear
algebra library, and on a machine whose cores are busy a map of 14 objects then took 30 times as long (11 s for 0.34 s),
and differently long each time.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import isotonic_regression

from palpate.analysis.spaces.classical import torgerson
from palpate.analysis.spaces.matrices import unit_size
from palpate.analysis.statistics.doubles import Floats

MAJORISED, POLISHED = 40, 300
Ties: TypeAlias = Literal["primary", "secondary"]
TIED = 1e-12
"""Dissimilarities that differ by less than this share of the largest are tied, such as 0.1 + 0.2 and 0.3."""
Objective: TypeAlias = Callable[[Floats], tuple[float, Floats]]
MEMORY = 8
ENOUGH, SHORTEST = 1e-4, 1e-10
STILL = 1e-15  # relative fall of the value, several times in a row
PATIENCE = 5
SETTLED = 1e-15  # length of a slope, for a value and places of order 1


def classical_start(between: Floats, dimensions: int) -> Floats:
    """Return Torgerson's map; dimensions that the dissimilarities lack are filled with small alternating steps."""
    points, _, _ = torgerson(between)
    flat = points[:, :dimensions]
    missing = dimensions - flat.shape[1]
    places = np.arange(len(between))[:, None] + np.arange(missing)
    return np.hstack([flat, 1e-3 * (-1.0) ** places * (1 + places)])


def minimise_stress(
    start: Floats, order: Order, majorised: int = MAJORISED, polished: int = POLISHED
) -> tuple[Floats, float]:
    """Minimise stress-1 from a start; return the map and its stress."""
    points = unit_size(start - start.mean(axis=0))
    for _ in range(majorised):
        # One step of majorisation: points whose distances come nearer to the disparities.
        apart, distances = _between(points, order)
        fitted = disparities(distances, order)
        size = float(fitted @ fitted)
        if size > 0:
            fitted = fitted * np.sqrt(float(distances @ distances) / size)
        ratio = np.divide(fitted, distances, out=np.zeros_like(fitted), where=distances > 0)
        moved = _gathered(ratio, apart, order, len(points))
        points = unit_size(moved) if moved.any() else points
    shape = points.shape
    ended, squared = minimise(lambda flat: _squared_stress(flat, order, shape), points.ravel(), polished)
    return ended.reshape(shape), float(np.sqrt(squared))


def refine_map(points: Floats, order: Order, steps: int) -> Floats:
    """Move a map at a minimum of stress-1 to where the gradient vanishes, so that all digits of its points are
    determined.
    """
    shape = points.shape
    return settle(lambda flat: _squared_stress(flat, order, shape), points.ravel(), steps).reshape(shape)


def _between(points: Floats, order: Order) -> tuple[Floats, Floats]:
    """Return the difference (dimensions, pairs) and the distance of the objects of each pair."""
    across = np.ascontiguousarray(points.T)
    apart: Floats = across.take(order.first, axis=1) - across.take(order.second, axis=1)
    return apart, np.sqrt((apart * apart).sum(axis=0))


def _gathered(pulls: Floats, apart: Floats, order: Order, objects: int) -> Floats:
    """Return the sum at each object of the forces along each pair's difference."""
    return np.column_stack(
        [
            np.bincount(order.first, force, objects) - np.bincount(order.second, force, objects)
            for force in pulls * apart
        ]
    )


def _squared_stress(flat: Floats, order: Order, shape: tuple[int, ...]) -> tuple[float, Floats]:
    """Return stress-1 squared and its gradient; disparities are a projection, so they do not contribute to the
    gradient.
    """
    apart, distances = _between(flat.reshape(shape), order)
    fitted = disparities(distances, order)
    total = float(distances @ distances)
    stress = stress_1(distances, fitted) ** 2
    pull = distances - fitted - stress * distances
    pull = np.divide(pull, distances, out=np.zeros_like(pull), where=distances > 0)
    return stress, (_gathered(pull, apart, order, shape[0]) * (2 / total)).ravel()


@dataclass(frozen=True)
class Order:
    """The rank of each dissimilarity, equal for ties; `ties` is their treatment.

    Under "primary" tied pairs may get different disparities, under "secondary" they get the same. `sorting` puts the
    pairs in order, `sizes` counts each rank's pairs, `first` and `second` are the objects of each pair.
    """

    rank: NDArray[np.intp]
    sorting: NDArray[np.intp]
    sizes: Floats
    ties: Ties
    first: NDArray[np.intp]
    second: NDArray[np.intp]


def order_of(dissimilarities: Floats, ties: Ties) -> Order:
    """Return the order of the dissimilarities, which a map's distances should follow."""
    sorting = np.argsort(dissimilarities, kind="stable")
    values = dissimilarities[sorting]
    steps = np.concatenate(([0], np.cumsum(np.diff(values) > TIED * values[-1])))
    rank = np.empty(len(values), dtype=np.intp)
    rank[sorting] = steps
    first, second = np.triu_indices(round((1 + np.sqrt(1 + 8 * len(rank))) / 2), 1)
    return Order(rank, sorting, np.bincount(rank).astype(np.float64), ties, first, second)


def disparities(distances: Floats, order: Order) -> Floats:
    """Return the least squares monotone regression of the distances on the order. Source: Kruskal 1964b."""
    if order.ties == "secondary":
        means = np.bincount(order.rank, weights=distances) / order.sizes
        fitted: Floats = isotonic_regression(means, weights=order.sizes).x
        return fitted[order.rank]
    tied = len(order.sizes) < len(distances)
    sorting = np.lexsort((distances, order.rank)) if tied else order.sorting
    result = np.empty_like(distances)
    result[sorting] = isotonic_regression(distances[sorting]).x
    return result


def stress_1(distances: Floats, fitted: Floats) -> float:
    """Return Kruskal's stress formula 1."""
    residual = distances - fitted
    total = float(distances @ distances)
    return float(np.sqrt(residual @ residual / total)) if total > 0 else float("inf")


def minimise(objective: Objective, start: Floats, steps: int) -> tuple[Floats, float]:
    """Return a point at which the objective (value and gradient) no longer decreases, and its value.

    Source: Nocedal & Wright 2006, algorithms 7.4 and 3.1 (Armijo's rule with quadratic interpolation).
    """
    place, (value, slope) = start, objective(start)
    past: deque[tuple[Floats, Floats]] = deque(maxlen=MEMORY)
    still = 0
    for _ in range(steps):
        direction = -_turned(slope, past) if past else -slope / (float(np.sqrt(slope @ slope)) or 1.0)
        lower_point = _along(objective, place, value, slope, direction)
        if lower_point is None:
            if not past:
                break
            past.clear()  # a stale memory: try the steepest descent once
            continue
        moved, lower, tilt = lower_point
        step, change = moved - place, tilt - slope
        if step @ change > 1e-12 * float(change @ change):
            past.append((step, change))
        still = still + 1 if value - lower <= STILL * max(abs(value), 1e-12) else 0
        place, value, slope = moved, lower, tilt
        if still >= PATIENCE:
            break
    return place, value


def settle(objective: Objective, start: Floats, steps: int) -> Floats:
    """Move a point near a minimum until its gradient is only rounding.

    Values determine a minimum's place only to half of the digits, and the rest depends on the processor; the gradient
    determines all. A step is kept if the gradient shrinks; a rejected step still updates the memory.
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
    """Return the first point along a direction that is sufficiently lower; None if there is none."""
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
    """Return the gradient times the approximate inverse Hessian of the past steps (two loops)."""
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
