"""Ridge regression on the principal components of the force profiles: what is known without engineered features."""

from __future__ import annotations

import numpy as np

from palpate.modeling.doors.components import components_of
from palpate.modeling.doors.linear import PENALTIES, Linear, path_of
from palpate.modeling.doors.methods import Learning, Method
from palpate.modeling.doors.preparing import Rows, checked_forces, inner_folds, on_one_thread, rows_of
from palpate.signals.arrays import Array, Indices

COMPONENTS = (1, 2, 3, 5, 7, 10, 15, 20, 30, 40)


@on_one_thread
def fit(learning: Learning) -> Linear:
    """The number of components and the penalty are those of least squared error over inner folds grouped by source."""
    rows = rows_of(learning, "train", least=2)
    count, penalty = _chosen(rows)
    learning.report(f"pca_ridge: {count} components, penalty {penalty:.3g}")
    found = components_of(rows.force_N, count)
    codes = found.codes(rows.force_N)
    path = path_of(codes / _size(codes), rows.rating)
    weight = path.weights(penalty).T @ found.directions / _size(codes)
    return Linear(weight, path.y_mean - weight @ found.mean, checked_forces)


def _chosen(rows: Rows) -> tuple[int, float]:
    total = np.sum([_errors(rows, train, test) for train, test in inner_folds(rows.group)], axis=0)
    place, penalty = np.unravel_index(int(np.argmin(total)), total.shape)
    return COMPONENTS[place], float(PENALTIES[penalty])


def _errors(rows: Rows, train: Indices, test: Indices) -> Array:
    """(components, penalties) sums of squared errors in one inner fold.

    The codes of different components do not correlate, so a component's weight is the same whichever others are there:
    the answers of k components are a running sum.
    """
    found = components_of(rows.force_N[train], max(COMPONENTS))
    codes, asked = found.codes(rows.force_N[train]), found.codes(rows.force_N[test])
    path = path_of(codes / _size(codes), rows.rating[train])
    errors = np.empty((len(COMPONENTS), len(PENALTIES)))
    for place, penalty in enumerate(PENALTIES):
        terms = (asked / _size(codes))[:, :, None] * path.weights(penalty)
        answers = np.concatenate([np.zeros_like(terms[:, :1]), np.cumsum(terms, axis=1)], axis=1)
        there = [min(count, terms.shape[1]) for count in COMPONENTS]
        errors[:, place] = np.sum((path.y_mean + answers[:, there] - rows.rating[test][:, None]) ** 2, axis=(0, 2))
    return errors


def _size(codes: Array) -> float:
    """The SD of the first component: in its multiples a penalty means the same whatever forces are measured in."""
    return float(codes[:, 0].std()) if codes.shape[1] else 1.0


PCA_RIDGE = Method("pca_ridge", "Ridge on principal components of the profile", fit, source="Hastie et al. 2009, 3.5")
