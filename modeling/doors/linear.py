"""A linear model of either direction, as fitted by several methods; and ridge regression by one decomposition."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from modeling.doors.data import Array, Indices
from modeling.doors.preparing import inner_folds
from modeling.files.exported import Exported
from protocols.model_card import Dense

PENALTIES: Array = np.logspace(5, -3, 33)
"""What is tried, the greatest first: of equals, the greatest is taken."""


@dataclass(frozen=True)
class Linear:
    """y = weight x + bias; `check` refuses what the model does not answer to."""

    weight: Array
    bias: Array
    check: Callable[[Array], Array]

    def predict(self, given: Array) -> Array:
        """(n, in) to (n, out); see `modeling.doors.methods.Fitted`."""
        return self.check(given) @ self.weight.T + self.bias

    def exported(self) -> Exported:
        """One dense step."""
        return Exported((Dense(weight="weight", bias="bias"),), {"weight": self.weight, "bias": self.bias})


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


def best_penalty(x: Array, y: Array, group: Indices) -> float:
    """The penalty of least squared error, all outputs together, over inner folds that keep groups together."""
    total = np.zeros(len(PENALTIES))
    for train, test in inner_folds(group):
        path = path_of(x[train], y[train])
        total += [np.sum((path.answers(x[test], path.weights(one)) - y[test]) ** 2) for one in PENALTIES]
    return float(PENALTIES[np.argmin(total)])
