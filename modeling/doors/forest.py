"""A random forest on the engineered features, kept as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modeling.doors.data import Array, Indices
from modeling.doors.featured import Featured, featured
from modeling.doors.methods import Learning, Method
from modeling.doors.preparing import rows_of
from modeling.files.exported import Exported
from protocols import model_card

TREES = 100
"""300 are no better here (docs/reference/door-models.md)."""
LEAST_IN_LEAF = 3
"""No worse than 1, and a third of the nodes."""


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


@dataclass(frozen=True)
class Forest:
    """The mean of the trees."""

    front: Featured
    trees: Trees

    def predict(self, given: Array) -> Array:
        """(n, 621) newtons to (n, attributes) on 0..100."""
        answers: Array = self.trees.value[self.trees.leaves(self.front(given))].mean(axis=1)
        return answers

    def deviation(self, given: Array) -> Array:
        """(n, attributes): the SD between the trees' answers: it ranks by doubt and is no interval by itself."""
        spread: Array = self.trees.value[self.trees.leaves(self.front(given))].std(axis=1)
        return spread

    def exported(self) -> Exported:
        """Features, standardising, one forest step."""
        tensors = {name: getattr(self.trees, name) for name in Trees.__dataclass_fields__}
        step = model_card.Forest(**{name: name for name in tensors})
        return Exported((*self.front.steps, step), {**self.front.tensors, **tensors})


def fit(learning: Learning) -> Forest:
    """Breiman's random forest for all attributes together: every split is the best for the sum of their errors."""
    from sklearn.ensemble import RandomForestRegressor

    rows = rows_of(learning, "train", least=2)
    front, z = featured(learning, rows)
    grown = RandomForestRegressor(
        TREES, min_samples_leaf=LEAST_IN_LEAF, max_features=1 / 3, random_state=learning.seed % 2**32, n_jobs=1
    ).fit(z, rows.rating)
    learning.report(f"forest: {TREES} trees")
    return Forest(front, _table([tree.tree_ for tree in grown.estimators_]))


def _table(trees: Sequence[Any]) -> Trees:
    """One table of all nodes. A leaf's children are itself, so that no index ever points outside."""
    roots = np.cumsum([0, *(tree.node_count for tree in trees)])
    parts = [_nodes(tree, int(root)) for tree, root in zip(trees, roots, strict=False)]
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


FOREST = Method("forest", "Random forest on engineered features", fit, source="Breiman 2001")
