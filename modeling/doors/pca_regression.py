"""From ratings to the principal components of a profile by ridge regression."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from palpate.modeling.columns import standard_of
from palpate.modeling.doors.components import components_of
from palpate.modeling.doors.linear import PENALTIES, Linear, path_of
from palpate.modeling.doors.methods import Learning, Method
from palpate.modeling.doors.preparing import PLAYABLE, Rows, checked_wishes, inner_folds, on_one_thread, rows_of
from palpate.modeling.files.exported import Exported
from palpate.signals.arrays import Array, Indices
from palpate.signals.doors.limits import bounded_profiles

COMPONENTS = (1, 2, 3, 4, 5, 6, 7, 10, 15, 20)


@dataclass(frozen=True)
class Regressed:
    """A linear model from ratings to newtons, within the limits of what may be played."""

    linear: Linear

    def predict(self, given: Array) -> Array:
        """(n, attributes) on 0..100 to (n, 621) newtons within the limits."""
        return bounded_profiles(self.linear.predict(given))

    def exported(self) -> Exported:
        """One dense step, then the limits."""
        dense = self.linear.exported()
        return Exported((*dense.steps, PLAYABLE), dense.tensors)


@on_one_thread
def fit(learning: Learning) -> Regressed:
    """The number of components and the penalty are those of least squared waveform error over inner grouped folds."""
    rows = rows_of(learning, least=2)
    standard = standard_of(rows.rating)
    z = standard(rows.rating)
    count, penalty = _chosen(z, rows)
    learning.report(f"pca_regression: {count} components, penalty {penalty:.3g}")
    found = components_of(rows.force_N, count)
    weight = (path_of(z, found.codes(rows.force_N)).weights(penalty) @ found.directions).T
    check = partial(checked_wishes, attributes=rows.rating.shape[1])
    linear = Linear(weight * standard.gain, found.mean + weight @ standard.offset, check)
    return Regressed(linear)


def _chosen(z: Array, rows: Rows) -> tuple[int, float]:
    total = np.sum([_errors(z, rows.force_N, train, test) for train, test in inner_folds(rows.group)], axis=0)
    place, penalty = np.unravel_index(int(np.argmin(total)), total.shape)
    return COMPONENTS[place], float(PENALTIES[penalty])


def _errors(z: Array, force_N: Array, train: Indices, test: Indices) -> Array:
    """(components, penalties) sums of squared errors of the waveform in one inner fold, less one constant.

    Directions are orthonormal, so the error of k components is that of the mean less what each of the k gains.
    """
    found = components_of(force_N[train], max(COMPONENTS))
    path = path_of(z[train], found.codes(force_N[train]))
    truth = found.codes(force_N[test])
    answers = np.array([path.answers(z[test], path.weights(one)) for one in PENALTIES])
    gained = np.sum(truth**2 - (answers - truth) ** 2, axis=1)
    return np.array([-gained[:, :count].sum(axis=1) for count in COMPONENTS])


PCA_REGRESSION = Method(
    "pca_regression",
    "Ridge from ratings to principal components of the profile",
    fit,
    source="Jolliffe 2002, chapter 8",
)
