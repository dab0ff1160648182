"""Gradient-boosted trees on whole textures, kept as arrays: scikit-learn grows them, NumPy asks them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.attributes.learnable import textures_of
from palpate.modeling.attributes.material import Texture
from palpate.modeling.attributes.methods import Learning, Method
from palpate.modeling.attributes.whole import Whole, whole_of
from palpate.modeling.trees import Trees, trees_of
from palpate.signals.arrays import Array

TREES, DEPTH, RATE = 200, 2, 0.05
COLUMNS = 0.1
"""The share of the columns that a split may choose from: ten times as fast, and no worse for so many alike."""


@dataclass(frozen=True)
class Boosted:
    """y = bias + rate times the sum of an attribute's trees; `first` is where each attribute's trees begin."""

    front: Whole
    trees: Trees
    first: NDArray[np.int64]
    bias: Array

    def predict(self, texture: Texture) -> Array:
        """(1, attributes) on 0..100: the texture as a whole. Raises MaterialError for other features."""
        return self.answers(self.front(texture))

    def answers(self, z: Array) -> Array:
        """(n, columns) of whole textures to (n, attributes), summed in the order that scikit-learn sums in."""
        single = z.astype(np.float32).astype(np.float64)  # it compares in single precision
        steps = RATE * self.trees.value[self.trees.leaves(single), 0]
        parts = [steps[:, start:end] for start, end in pairwise(self.first)]
        begun = [np.column_stack([np.full(len(z), bias), part]) for bias, part in zip(self.bias, parts, strict=True)]
        return np.stack([np.add.accumulate(each, axis=1)[:, -1] for each in begun], axis=1)

    def saved(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Arrays and what is told of them, for `restored`."""
        nodes = {f"trees.{name}": getattr(self.trees, name) for name in Trees.__dataclass_fields__}
        own = {"first": self.first, "bias": self.bias}
        return {**nodes, **own, **self.front.arrays()}, {"method": BOOSTING.name, **self.front.told()}


def restored(tensors: Mapping[str, NDArray[Any]], told: Mapping[str, Any]) -> Boosted:
    """What `saved` gave, fitted again."""
    trees = Trees(*(tensors[f"trees.{name}"] for name in Trees.__dataclass_fields__))
    return Boosted(Whole.of(tensors, told), trees, tensors["first"], tensors["bias"])


def fit(learning: Learning) -> Boosted:
    """Friedman's gradient boosting of squared error, for each attribute by itself."""
    textures, ratings = textures_of(learning)
    front, z = whole_of(textures, learning.touch, learning.sight)
    grown = [_grown(z, ratings[:, place], learning.seed) for place in range(ratings.shape[1])]
    learning.report(f"boosting: {TREES} trees for each attribute")
    return boosted(front, grown, ratings.mean(axis=0))


def boosted(front: Whole, grown: Sequence[Any], bias: Array) -> Boosted:
    """scikit-learn's regressors, one for each attribute, as arrays."""
    trees = [[tree.tree_ for tree in each.estimators_[:, 0]] for each in grown]
    first = np.cumsum([0, *map(len, trees)]).astype(np.int64)
    return Boosted(front, trees_of([tree for own in trees for tree in own]), first, bias)


def _grown(z: Array, rating: Array, seed: int) -> Any:
    from sklearn.ensemble import GradientBoostingRegressor

    made = GradientBoostingRegressor(
        n_estimators=TREES, max_depth=DEPTH, learning_rate=RATE, max_features=COLUMNS, random_state=seed % 2**32
    )
    return made.fit(z.astype(np.float32), rating)


BOOSTING = Method(
    "boosting", "Boosted trees on whole textures", fit, source="Friedman 2001, by scikit-learn", restore=restored
)
