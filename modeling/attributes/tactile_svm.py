"""Support vector regression on segments of touch (thesis 3.6.6, after the SVM classifier of Shao et al. 2023)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.statistics.one_thread import one_thread
from palpate.modeling.attributes.learnable import inner_folds, rows_of, textures_of
from palpate.modeling.attributes.material import Texture
from palpate.modeling.attributes.methods import Learning, Method
from palpate.modeling.regression import Standard, standard_of
from palpate.signals.arrays import Array, Indices

SEGMENTS = 15
"""Evenly spaced segments of each texture: segments of one texture are similar, and time grows with their square."""
COSTS = (0.3, 3.0, 30.0)
WIDTHS = (0.1, 0.3, 1.0)
"""Gamma of exp(-gamma d^2), as multiples of 1 / columns (scikit-learn calls the 1 "scale")."""
TUBE = 0.1
"""The share of the ratings' SD below which errors have no cost (scikit-learn's default)."""


@dataclass(frozen=True)
class SupportVectors:
    """A fitted support vector regression.

    y = sum_i dual_i exp(-gamma |z - vector_i|^2) + intercept, for each attribute; z is a standardised segment.
    """

    kinds: tuple[str, ...]
    standard: Standard
    vectors: Array
    dual: Array
    intercept: Array
    gamma: Array

    def predict(self, texture: Texture) -> Array:
        """Return predictions (segments, attributes) on 0..100. Raises MaterialError for other features."""
        rows = rows_of(texture, "touch", self.kinds, self.vectors.shape[1])
        distances = _squared_distances(self.standard(rows.astype(np.float64)), self.vectors)
        answers = [np.exp(-gamma * distances) @ dual for gamma, dual in zip(self.gamma, self.dual, strict=True)]
        return np.stack(answers, axis=1) + self.intercept

    def saved(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Return arrays and plain values, for `restore`."""
        own = {name: getattr(self, name) for name in ("vectors", "dual", "intercept", "gamma")}
        arrays = {**own, "gain": self.standard.gain, "offset": self.standard.offset}
        return arrays, {"method": TACTILE_SVM.name, "kinds": list(self.kinds)}


def restore(arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any]) -> SupportVectors:
    """Return the fitted method from the arrays and plain values of `saved`."""
    standard = Standard(arrays["gain"], arrays["offset"])
    own = (arrays[name] for name in ("vectors", "dual", "intercept", "gamma"))
    return SupportVectors(tuple(metadata["kinds"]), standard, *own)


@dataclass(frozen=True)
class _Choice:
    cost: float
    gamma: float


def fit(learning: Learning) -> SupportVectors:
    """Fit a regression to each attribute, with the cost and gamma of least squared error over inner folds.

    The error is that of a texture's mean prediction. Raises MaterialError for textures that cannot be learned from.
    """
    with one_thread():
        textures, ratings = textures_of(learning)
        rows, place = _segments(textures, learning.touch)
        standard = standard_of(rows)
        z = standard(rows)
        distances = _squared_distances(z, z)
        scale = standard_of(ratings)
        y = scale(ratings)
        choices = [_Choice(cost, width / z.shape[1]) for cost, width in product(COSTS, WIDTHS)]
        errors = sum(_fold_errors(distances, place, y, choices, fold) for fold in inner_folds(textures))
        best = [choices[int(index)] for index in np.argmin(errors, axis=0)]
        for pair, choice in zip(learning.attributes, best, strict=True):
            learning.report(f"tactile_svm: {pair.name}: cost {choice.cost:g}, gamma {choice.gamma:.3g}")
        fitted = [_fitted(np.exp(-choice.gamma * distances), y[place, a], choice.cost) for a, choice in enumerate(best)]
        # the support vectors of any attribute alone, and predictions on 0..100
        centre, spread = ratings.mean(axis=0), ratings.std(axis=0)
        dual = np.stack([weights for weights, _ in fitted]) * spread[:, None]
        used = np.any(dual != 0, axis=0)
        intercept = np.array([offset for _, offset in fitted]) * spread + centre
        gamma = np.array([choice.gamma for choice in best])
        return SupportVectors(tuple(learning.touch), standard, z[used], dual[:, used], intercept, gamma)


def _segments(textures: Sequence[Texture], kinds: Sequence[str]) -> tuple[Array, Indices]:
    """Return `SEGMENTS` evenly spaced rows of each texture, (rows, features), and the texture's place of each."""
    width = rows_of(textures[0], "touch", kinds).shape[1]
    by_texture = [rows_of(texture, "touch", kinds, width) for texture in textures]
    spaced = [rows[np.unique(np.linspace(0, len(rows) - 1, SEGMENTS).round().astype(int))] for rows in by_texture]
    place = np.repeat(np.arange(len(textures)), [len(rows) for rows in spaced])
    return np.concatenate(spaced).astype(np.float64), place


def _fold_errors(
    distances: Array, place: Indices, y: Array, choices: Sequence[_Choice], fold: tuple[Indices, Indices]
) -> Array:
    """Return the sums of squared errors of textures' mean predictions, (choices, attributes)."""
    learn, test = (np.isin(place, side) for side in fold)
    result = np.zeros((len(choices), y.shape[1]))
    for row, choice in enumerate(choices):
        kernel = np.exp(-choice.gamma * distances[:, learn])
        for attribute in range(y.shape[1]):
            dual, intercept = _fitted(kernel[learn], y[place[learn], attribute], choice.cost)
            answers = kernel[test] @ dual + intercept
            means = [answers[place[test] == texture].mean() for texture in fold[1]]
            result[row, attribute] = np.sum((np.array(means) - y[fold[1], attribute]) ** 2)
    return result


def _fitted(kernel: Array, y: Array, cost: float) -> tuple[Array, float]:
    """Return the dual weight of each row, (n,), and the intercept, for the kernel (n, n) between the rows."""
    from sklearn.svm import SVR

    regression = SVR(kernel="precomputed", C=cost, epsilon=TUBE).fit(kernel, y)
    dual = np.zeros(len(y))
    dual[regression.support_] = regression.dual_coef_[0]
    return dual, float(regression.intercept_[0])


def _squared_distances(one: Array, other: Array) -> Array:
    """Return the squared distances (n, m) between rows (n, features) and (m, features)."""
    squares = np.sum(one**2, axis=1)[:, None] + np.sum(other**2, axis=1) - 2.0 * one @ other.T
    result: Array = np.maximum(squares, 0.0)
    return result


TACTILE_SVM = Method(
    name="tactile_svm",
    title="Tactile SVM",
    fit=fit,
    sees=frozenset({"touch"}),
    source="thesis 3.6.6; Shao et al. 2023, whose features are learned by sparse coding; here as a regression",
    restore=restore,
)
