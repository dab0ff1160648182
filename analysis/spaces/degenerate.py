"""What tells a map that says nothing about its objects: collapsed points, a step function, too few pairs."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np
from scipy.spatial.distance import pdist

from palpate.analysis.spaces.isotone import Order
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import listed

COLLAPSED = 1e-3  # of the root mean square distance from the centroid
STEP = 1e-3  # of the largest disparity: smaller ones belong to the same step
ZERO = 1e-3
FEW_STEPS = 3
POINTS_PER_DIMENSION = 4


def too_few_points(points: int, dimensions: int) -> list[str]:
    """Kruskal and Wish's rule (1978, p. 34): more than four objects for each dimension."""
    if points > POINTS_PER_DIMENSION * dimensions:
        return []
    return [
        f"{points} objects in {dimensions} dimensions: stress is low for any data; "
        f"expected more than {POINTS_PER_DIMENSION * dimensions} objects (Kruskal & Wish 1978)"
    ]


def degeneracies(
    points: Floats, fitted: Floats, order: Order, stress: float, labels: tuple[Hashable, ...]
) -> list[str]:
    """What is degenerate about a map of unit size, in words; empty where nothing is."""
    found = []
    together = _together(points, order)
    if together:
        pairs = listed((f"{labels[i]!r} and {labels[j]!r}" for i, j in together), len(together))
        found.append(f"degenerate: different objects share a place ({pairs}): the map shows clusters only")
    steps = 1 + int((np.diff(np.sort(fitted)) > STEP * fitted.max()).sum())
    if steps <= FEW_STEPS < len(order.sizes):
        found.append(f"degenerate: {len(order.sizes)} ranks of dissimilarity became {steps} steps of distance")
    if stress < ZERO and too_few_points(*points.shape):
        found.append("degenerate: stress is nearly 0, so the order of the pairs does not determine the places")
    return found


def _together(points: Floats, order: Order) -> list[tuple[int, int]]:
    """Pairs of coinciding points whose dissimilarity is not the smallest one."""
    near = (pdist(points) < COLLAPSED) & (order.rank > 0)
    first, second = np.triu_indices(len(points), 1)
    return list(zip(first[near].tolist(), second[near].tolist(), strict=True))
