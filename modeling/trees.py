"""Regression trees as arrays: scikit-learn grows them, NumPy asks them, and a file of them cannot execute code."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.signals.arrays import Array, Indices


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
        """(n, trees): the leaf that each tree sends each row to."""
        at = np.tile(self.roots, (len(x), 1))
        rows = np.arange(len(x))[:, None]
        while np.any(inner := self.feature[at] >= 0):
            goes_left = x[rows, self.feature[at]] <= self.threshold[at]
            at = np.where(inner, np.where(goes_left, self.left[at], self.right[at]), at)
        return at


def trees_of(grown: Sequence[Any]) -> Trees:
    """scikit-learn's trees (`tree_`) in one table. A leaf's children are itself: no index ever points outside."""
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
