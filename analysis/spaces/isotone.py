"""Disparities: the numbers in the order of the dissimilarities that are nearest to the map's distances."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import isotonic_regression

from palpate.analysis.statistics.doubles import Floats

Ties: TypeAlias = Literal["primary", "secondary"]
TIED = 1e-12
"""Dissimilarities closer than this share of the largest are tied: 0.1 + 0.2 and 0.3 are."""


@dataclass(frozen=True)
class Order:
    """The rank of each dissimilarity, tied ones alike; `ties` says what they oblige to.

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
    """The order that a map's distances should follow."""
    sorting = np.argsort(dissimilarities, kind="stable")
    values = dissimilarities[sorting]
    steps = np.concatenate(([0], np.cumsum(np.diff(values) > TIED * values[-1])))
    rank = np.empty(len(values), dtype=np.intp)
    rank[sorting] = steps
    first, second = np.triu_indices(round((1 + np.sqrt(1 + 8 * len(rank))) / 2), 1)
    return Order(rank, sorting, np.bincount(rank).astype(np.float64), ties, first, second)


def disparities(distances: Floats, order: Order) -> Floats:
    """Least squares monotone regression of the distances on the order. Source: Kruskal 1964b."""
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
    """Kruskal's stress formula 1."""
    residual = distances - fitted
    total = float(distances @ distances)
    return float(np.sqrt(residual @ residual / total)) if total > 0 else float("inf")
