"""Parts of regressions on columns: standardisation, ridge for all penalties by one decomposition, trees as arrays.

Scikit-learn fits the trees, NumPy evaluates them, and a file of them cannot execute code.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.signals.arrays import Array, Indices

CONSTANT = 1e-9
"""A column with an SD below this share of its greatest value differs by rounding only."""
PENALTIES: Array = np.logspace(5, -3, 33)
"""The penalties that are tried, the greatest first: of equally good ones, the greatest is chosen."""


@dataclass(frozen=True)
class Standard:
    """A standardisation z = gain * x + offset to mean 0 and SD 1 of the training rows; constant columns become 0."""

    gain: Array
    offset: Array

    def __call__(self, x: Array) -> Array:
        """Return standardised rows of (n, columns)."""
        return x * self.gain + self.offset


def standard_of(x: Array) -> Standard:
    """Return the standardisation of these columns (n, columns)."""
    mean, sd = x.mean(axis=0), x.std(axis=0)
    varies = sd > CONSTANT * np.max(np.abs(x), axis=0)
    gain = np.divide(1.0, sd, out=np.zeros_like(sd), where=varies)
    return Standard(gain, -mean * gain)


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
        """Return the weights (in, out) with the penalty on the sum of their squares."""
        shrunk = self.singular / (self.singular**2 + penalty)
        return self.right.T @ (shrunk[:, None] * self.along)

    def answers(self, x: Array, weights: Array) -> Array:
        """Return the predictions (n, out) of these weights."""
        return self.y_mean + (x - self.x_mean) @ weights


def path_of(x: Array, y: Array) -> Path:
    """Return the decomposition of x and y, after which each penalty costs only a product."""
    x_mean, y_mean = x.mean(axis=0), y.mean(axis=0)
    left, singular, right = np.linalg.svd(x - x_mean, full_matrices=False)
    return Path(x_mean, y_mean, singular, right, left.T @ (y - y_mean))


def inner_errors(x: Array, y: Array, folds: Iterable[tuple[Indices, Indices]]) -> Array:
    """Return the sum of squared errors of each penalty over the test rows of all folds, (penalties, out)."""
    total = np.zeros((len(PENALTIES), y.shape[1]))
    for train, test in folds:
        path = path_of(x[train], y[train])
        total += [
            np.sum((path.answers(x[test], path.weights(penalty)) - y[test]) ** 2, axis=0) for penalty in PENALTIES
        ]
    return total


@dataclass(frozen=True)
class Trees:
    """All trees' nodes in one table: node i goes left where x[feature_i] <= threshold_i; a leaf has feature -1."""

    roots: Indices
    feature: Indices
    threshold: Array
    left: Indices
    right: Indices
    value: Array

    def leaves(self, x: Array) -> Indices:
        """Return the leaf of each row in each tree, (n, trees)."""
        at = np.tile(self.roots, (len(x), 1))
        rows = np.arange(len(x))[:, None]
        while np.any(inner := self.feature[at] >= 0):
            goes_left = x[rows, self.feature[at]] <= self.threshold[at]
            at = np.where(inner, np.where(goes_left, self.left[at], self.right[at]), at)
        return at


def trees_of(grown: Sequence[Any]) -> Trees:
    """Return scikit-learn's trees (`tree_`) in one table. A leaf's children are itself, so that no index is invalid."""
    roots = np.cumsum([0, *(tree.node_count for tree in grown)])
    parts = [_nodes(tree, int(root)) for tree, root in zip(grown, roots, strict=False)]
    columns: list[NDArray[Any]] = [np.concatenate(column) for column in zip(*parts, strict=True)]
    return Trees(roots[:-1].astype(np.int64), *columns)


def _nodes(tree: Any, root: int) -> tuple[NDArray[Any], ...]:
    leaf = tree.children_left < 0
    own = np.arange(tree.node_count)
    return (
        np.where(leaf, -1, tree.feature).astype(np.int64),
        np.where(leaf, 0.0, tree.threshold).astype(np.float64),
        (root + np.where(leaf, own, tree.children_left)).astype(np.int64),
        (root + np.where(leaf, own, tree.children_right)).astype(np.int64),
        tree.value.reshape(tree.node_count, -1).astype(np.float64),
    )
