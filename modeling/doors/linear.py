"""Linear models of either direction: the training mean, ridge regression on features or on principal components."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from palpate.modeling.doors.methods import Learning, Method
from palpate.modeling.doors.preparing import (
    PLAYABLE,
    Featured,
    TrainingRows,
    checked_forces,
    checked_wishes,
    featured,
    inner_folds,
    on_one_thread,
    rows_of,
)
from palpate.modeling.files.model_files import Exported
from palpate.modeling.regression import PENALTIES, inner_errors, path_of, standard_of
from palpate.signals.arrays import Array, Indices
from palpate.signals.doors.grid import POINTS
from palpate.signals.doors.limits import bounded_profiles
from palpate.signals.models.card import Dense

NEGLIGIBLE = 1e-9
"""A component whose singular value is below this share of the greatest force is rounding."""
FORWARD_COMPONENTS = (1, 2, 3, 5, 7, 10, 15, 20, 30, 40)
INVERSE_COMPONENTS = (1, 2, 3, 4, 5, 6, 7, 10, 15, 20)


@dataclass(frozen=True)
class Components:
    """Principal components: `directions` (k, points), orthonormal, in order of variance, around `mean` (points,)."""

    mean: Array
    directions: Array

    def codes(self, x: Array) -> Array:
        """Return codes (n, k) of rows (n, points)."""
        return (x - self.mean) @ self.directions.T


def components_of(x: Array, most: int) -> Components:
    """Return the first components of rows (n, points): at most `most`, fewer if there are fewer, none for equal rows.

    Source: Jolliffe 2002, by singular value decomposition.
    """
    mean = x.mean(axis=0)
    _, singular, right = np.linalg.svd(x - mean, full_matrices=False)
    real = int(np.sum(singular > NEGLIGIBLE * float(np.abs(x).max())))
    return Components(mean, right[: min(most, real)])


@dataclass(frozen=True)
class Linear:
    """A linear model y = weight x + bias; `check` refuses invalid inputs."""

    weight: Array
    bias: Array
    check: Callable[[Array], Array]

    def predict(self, given: Array) -> Array:
        """Return the outputs (n, out) of inputs (n, in); see `palpate.modeling.doors.methods.Fitted`."""
        return self.check(given) @ self.weight.T + self.bias

    def exported(self) -> Exported:
        """Return one dense step."""
        return Exported((Dense(weight="weight", bias="bias"),), {"weight": self.weight, "bias": self.bias})


def best_penalty(x: Array, y: Array, group: Indices) -> float:
    """Return the penalty with the least squared error over all outputs and inner folds, which keep groups together."""
    total = inner_errors(x, y, inner_folds(group)).sum(axis=1)
    return float(PENALTIES[np.argmin(total)])


def fit_mean(learning: Learning) -> Linear:
    """Return the mean rating of each attribute over the measured stimuli of the training side."""
    mean = rows_of(learning).rating.mean(axis=0)
    return Linear(np.zeros((len(mean), POINTS)), mean, checked_forces)


MEAN = Method("mean", "Mean of the training set", fit_mean, source="the reference of R2, thesis equation 5.7")


@dataclass(frozen=True)
class Ridge:
    """A ridge regression y = weight z + bias on standardised features z; `penalty` is the chosen one."""

    front: Featured
    weight: Array
    bias: Array
    penalty: float

    def predict(self, given: Array) -> Array:
        """Return ratings (n, attributes) on 0..100, not clipped, of profiles (n, 621) in newtons."""
        return self.front(given) @ self.weight.T + self.bias

    def exported(self) -> Exported:
        """Return the steps: features, standardising, one dense step."""
        steps = (*self.front.steps, Dense(weight="weight", bias="bias"))
        return Exported(steps, {**self.front.tensors, "weight": self.weight, "bias": self.bias})


@on_one_thread
def fit_ridge(learning: Learning) -> Ridge:
    """Fit a ridge regression with the penalty of least squared error over inner folds grouped by source."""
    rows = rows_of(learning, least=2)
    front, z = featured(rows)
    penalty = best_penalty(z, rows.rating, rows.group)
    path = path_of(z, rows.rating)
    weights = path.weights(penalty)
    learning.report(f"ridge: penalty {penalty:.3g}")
    return Ridge(front, weights.T, path.y_mean - path.x_mean @ weights, penalty)


RIDGE = Method(
    "ridge", "Ridge on engineered features", fit_ridge, source="Hoerl and Kennard 1970; features of thesis 5.3.4.1"
)


@on_one_thread
def fit_pca_ridge(learning: Learning) -> Linear:
    """Fit a ridge regression on principal components; number and penalty have the least error over inner folds."""
    rows = rows_of(learning, "train", least=2)
    total = np.sum([_rating_errors(rows, train, test) for train, test in inner_folds(rows.group)], axis=0)
    least = np.unravel_index(int(np.argmin(total)), total.shape)
    count, penalty = FORWARD_COMPONENTS[least[0]], float(PENALTIES[least[1]])
    learning.report(f"pca_ridge: {count} components, penalty {penalty:.3g}")
    components = components_of(rows.force_N, count)
    codes = components.codes(rows.force_N)
    path = path_of(codes / _size(codes), rows.rating)
    weight = path.weights(penalty).T @ components.directions / _size(codes)
    return Linear(weight, path.y_mean - weight @ components.mean, checked_forces)


def _rating_errors(rows: TrainingRows, train: Indices, test: Indices) -> Array:
    """Return the sums of squared errors of one inner fold, (components, penalties).

    The codes of different components do not correlate, so a component's weight does not depend on the others, and the
    predictions of k components are a running sum.
    """
    components = components_of(rows.force_N[train], max(FORWARD_COMPONENTS))
    codes, tested = components.codes(rows.force_N[train]), components.codes(rows.force_N[test])
    path = path_of(codes / _size(codes), rows.rating[train])
    errors = np.empty((len(FORWARD_COMPONENTS), len(PENALTIES)))
    for place, penalty in enumerate(PENALTIES):
        terms = (tested / _size(codes))[:, :, None] * path.weights(penalty)
        answers = np.concatenate([np.zeros_like(terms[:, :1]), np.cumsum(terms, axis=1)], axis=1)
        there = [min(count, terms.shape[1]) for count in FORWARD_COMPONENTS]
        errors[:, place] = np.sum((path.y_mean + answers[:, there] - rows.rating[test][:, None]) ** 2, axis=(0, 2))
    return errors


def _size(codes: Array) -> float:
    """Return the SD of the first component: penalties are multiples of it, whatever the unit of force."""
    return float(codes[:, 0].std()) if codes.shape[1] else 1.0


PCA_RIDGE = Method(
    "pca_ridge", "Ridge on principal components of the profile", fit_pca_ridge, source="Hastie et al. 2009, 3.5"
)


@dataclass(frozen=True)
class Regressed:
    """A linear model from ratings to newtons, within the limits."""

    linear: Linear

    def predict(self, given: Array) -> Array:
        """Return profiles (n, 621) in newtons, within the limits, of ratings (n, attributes) on 0..100."""
        return bounded_profiles(self.linear.predict(given))

    def exported(self) -> Exported:
        """Return one dense step, then the limits."""
        dense = self.linear.exported()
        return Exported((*dense.steps, PLAYABLE), dense.tensors)


@on_one_thread
def fit_pca_regression(learning: Learning) -> Regressed:
    """Fit components of profiles to ratings; number and penalty have the least waveform error over inner folds."""
    rows = rows_of(learning, least=2)
    standard = standard_of(rows.rating)
    z = standard(rows.rating)
    total = np.sum([_waveform_errors(z, rows.force_N, train, test) for train, test in inner_folds(rows.group)], axis=0)
    least = np.unravel_index(int(np.argmin(total)), total.shape)
    count, penalty = INVERSE_COMPONENTS[least[0]], float(PENALTIES[least[1]])
    learning.report(f"pca_regression: {count} components, penalty {penalty:.3g}")
    components = components_of(rows.force_N, count)
    weight = (path_of(z, components.codes(rows.force_N)).weights(penalty) @ components.directions).T
    check = partial(checked_wishes, attributes=rows.rating.shape[1])
    linear = Linear(weight * standard.gain, components.mean + weight @ standard.offset, check)
    return Regressed(linear)


def _waveform_errors(z: Array, force_N: Array, train: Indices, test: Indices) -> Array:
    """Return the sums of squared waveform errors of one inner fold, (components, penalties), up to a constant.

    Directions are orthonormal, so the error of k components is that of the mean minus the reduction by each of the k.
    """
    components = components_of(force_N[train], max(INVERSE_COMPONENTS))
    path = path_of(z[train], components.codes(force_N[train]))
    truth = components.codes(force_N[test])
    answers = np.array([path.answers(z[test], path.weights(penalty)) for penalty in PENALTIES])
    gained = np.sum(truth**2 - (answers - truth) ** 2, axis=1)
    return np.array([-gained[:, :count].sum(axis=1) for count in INVERSE_COMPONENTS])


PCA_REGRESSION = Method(
    "pca_regression",
    "Ridge from ratings to principal components of the profile",
    fit_pca_regression,
    source="Jolliffe 2002, chapter 8",
)
