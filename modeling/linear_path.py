"""Ridge regression for every penalty by one decomposition, and how wrong each is over inner folds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from palpate.signals.arrays import Array, Indices

PENALTIES: Array = np.logspace(5, -3, 33)
"""What is tried, the greatest first: of equals, the greatest is taken."""


@dataclass(frozen=True)
class Path:
    """Ridge regression of y on x for any penalty, from one singular value decomposition (Hoerl and Kennard 1970).

    x (n, in) and y (n, out) are centred on their means here, so the intercept is not penalised.
    """

    x_mean: Array
    y_mean: Array
    singular: Array
    right: Array
    along: Array

    def weights(self, penalty: float) -> Array:
        """(in, out) weights, the penalty on the sum of their squares."""
        shrunk = self.singular / (self.singular**2 + penalty)
        return self.right.T @ (shrunk[:, None] * self.along)

    def answers(self, x: Array, weights: Array) -> Array:
        """(n, out) for these weights."""
        return self.y_mean + (x - self.x_mean) @ weights


def path_of(x: Array, y: Array) -> Path:
    """Decompose once; then each penalty costs a product."""
    x_mean, y_mean = x.mean(axis=0), y.mean(axis=0)
    left, singular, right = np.linalg.svd(x - x_mean, full_matrices=False)
    return Path(x_mean, y_mean, singular, right, left.T @ (y - y_mean))


def inner_errors(x: Array, y: Array, folds: Iterable[tuple[Indices, Indices]]) -> Array:
    """(penalties, out): the sum of squared errors of each penalty over the test rows of all folds."""
    total = np.zeros((len(PENALTIES), y.shape[1]))
    for train, test in folds:
        path = path_of(x[train], y[train])
        total += [np.sum((path.answers(x[test], path.weights(one)) - y[test]) ** 2, axis=0) for one in PENALTIES]
    return total
