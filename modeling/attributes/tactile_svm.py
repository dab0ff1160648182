"""Support vector regression on segments of touch: thesis 3.6.6 after Shao et al. 2023, who classify by an SVM."""

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
"""Of each texture, evenly spread: segments of one texture are alike, and the time grows with their square."""
COSTS = (0.3, 3.0, 30.0)
WIDTHS = (0.1, 0.3, 1.0)
"""Gamma of exp(-gamma d^2), as multiples of 1 / columns (scikit-learn calls the 1 "scale")."""
TUBE = 0.1
"""Errors below this share of the ratings' SD cost nothing; scikit-learn's default."""


@dataclass(frozen=True)
class SupportVectors:
    """y = sum_i dual_i exp(-gamma |z - vector_i|^2) + intercept, for each attribute; z is a standardised segment."""

    kinds: tuple[str, ...]
    standard: Standard
    vectors: Array
    dual: Array
    intercept: Array
    gamma: Array

    def predict(self, texture: Texture) -> Array:
        """(segments, attributes) on 0..100. Raises MaterialError for other features."""
        rows = rows_of(texture, "touch", self.kinds, self.vectors.shape[1])
        apart = _apart(self.standard(rows.astype(np.float64)), self.vectors)
        answers = [np.exp(-gamma * apart) @ dual for gamma, dual in zip(self.gamma, self.dual, strict=True)]
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
    """Cost and gamma are those of least squared error of a texture's mean over inner folds, for each attribute."""
    with one_thread():
        textures, ratings = textures_of(learning)
        rows, place = _segments(textures, learning.touch)
        standard = standard_of(rows)
        z = standard(rows)
        apart = _apart(z, z)
        scale = standard_of(ratings)
        y = scale(ratings)
        choices = [_Choice(cost, width / z.shape[1]) for cost, width in product(COSTS, WIDTHS)]
        errors = sum(_fold_errors(apart, place, y, choices, fold) for fold in inner_folds(textures))
        best = [choices[int(index)] for index in np.argmin(errors, axis=0)]
        for pair, one in zip(learning.attributes, best, strict=True):
            learning.report(f"tactile_svm: {pair.name}: cost {one.cost:g}, gamma {one.gamma:.3g}")
        made = [_fitted(np.exp(-one.gamma * apart), y[place, a], one.cost) for a, one in enumerate(best)]
        # only segments that an attribute leans on, and the answers back on 0..100
        centre, spread = ratings.mean(axis=0), ratings.std(axis=0)
        dual = np.stack([one for one, _ in made]) * spread[:, None]
        used = np.any(dual != 0, axis=0)
        intercept = np.array([one for _, one in made]) * spread + centre
        gamma = np.array([choice.gamma for choice in best])
        return SupportVectors(tuple(learning.touch), standard, z[used], dual[:, used], intercept, gamma)


def _segments(textures: Sequence[Texture], kinds: Sequence[str]) -> tuple[Array, Indices]:
    """Return some rows of each texture, and for each the place of its texture."""
    width = rows_of(textures[0], "touch", kinds).shape[1]
    by_texture = [rows_of(texture, "touch", kinds, width) for texture in textures]
    some = [rows[np.unique(np.linspace(0, len(rows) - 1, SEGMENTS).round().astype(int))] for rows in by_texture]
    place = np.repeat(np.arange(len(textures)), [len(rows) for rows in some])
    return np.concatenate(some).astype(np.float64), place


def _fold_errors(
    apart: Array, place: Indices, y: Array, choices: Sequence[_Choice], fold: tuple[Indices, Indices]
) -> Array:
    """(choices, attributes) sums of squared errors of the texture's mean prediction."""
    learn, test = (np.isin(place, side) for side in fold)
    result = np.zeros((len(choices), y.shape[1]))
    for row, one in enumerate(choices):
        near = np.exp(-one.gamma * apart[:, learn])
        for attribute in range(y.shape[1]):
            dual, intercept = _fitted(near[learn], y[place[learn], attribute], one.cost)
            answers = near[test] @ dual + intercept
            means = [answers[place[test] == texture].mean() for texture in fold[1]]
            result[row, attribute] = np.sum((np.array(means) - y[fold[1], attribute]) ** 2)
    return result


def _fitted(near: Array, y: Array, cost: float) -> tuple[Array, float]:
    """Return the dual weight of each row and the intercept, for the kernel (n, n) between the rows."""
    from sklearn.svm import SVR

    made = SVR(kernel="precomputed", C=cost, epsilon=TUBE).fit(near, y)
    dual = np.zeros(len(y))
    dual[made.support_] = made.dual_coef_[0]
    return dual, float(made.intercept_[0])


def _apart(one: Array, other: Array) -> Array:
    """(n, m): squared distances between rows."""
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
