"""Errors of predictions against people's ratings, by attribute and class, and differences between methods."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.evaluate.intervals import JND
from palpate.signals.arrays import Array

CONFIDENCE = 0.95
LEAST_PAIRS = 3


@dataclass(frozen=True)
class Errors:
    """Errors of one method over textures, by attribute and overall, on 0..100 (thesis 3.6.2).

    `mean_mae` and `mean_rmse` are means over the attributes; `within` is the share of predictions at most a JND from
    the mean ratings. `texture_mae`, (textures,), is each texture's mean over the attributes.
    """

    mae: tuple[float, ...]
    rmse: tuple[float, ...]
    within: tuple[float, ...]
    mean_mae: float
    mean_rmse: float
    all_within: float
    texture_mae: Array


@dataclass(frozen=True)
class Difference:
    """The mean over textures of the paired differences of two methods' MAE; negative where the first has less error.

    `low` and `high` are the ends of its confidence interval, with a standard error over `groups` of textures that share
    nothing; both are None where there are too few groups.
    """

    mean: float
    low: float | None
    high: float | None
    groups: int

    @property
    def chance(self) -> bool:
        """Whether the interval holds 0, or is unknown."""
        return self.low is None or self.high is None or self.low <= 0.0 <= self.high


def errors(predicted: Array, rated: Array, jnd: float = JND) -> Errors:
    """Return the errors of predictions against mean ratings, (textures, attributes) each on 0..100 (eq. 3.1, 3.2).

    Raises MaterialError for arrays that do not match, are empty or are not finite.
    """
    if np.shape(predicted) != np.shape(rated) or np.ndim(rated) != 2 or not np.size(rated):
        raise MaterialError(f"predictions {np.shape(predicted)} and ratings {np.shape(rated)}: the same rows expected.")
    error = np.asarray(predicted, dtype=np.float64) - np.asarray(rated, dtype=np.float64)
    if not np.isfinite(error).all():
        raise MaterialError(f"prediction {int(np.argwhere(~np.isfinite(error))[0][0]) + 1} is not finite.")
    size = np.abs(error)
    mae, rmse, within = size.mean(axis=0), np.sqrt((error**2).mean(axis=0)), (size <= jnd).mean(axis=0)
    return Errors(
        tuple(mae.tolist()), tuple(rmse.tolist()), tuple(within.tolist()),
        float(mae.mean()), float(rmse.mean()), float(within.mean()), size.mean(axis=1),
    )  # fmt: skip


def by_class(
    predicted: Array, rated: Array, classes: Sequence[str], jnd: float = JND
) -> Mapping[str, tuple[int, Errors]]:
    """Return the number of textures and the errors of each class, in the order of the classes' first appearance."""
    rows_by_name: dict[str, list[int]] = {}
    for row, name in enumerate(classes):
        rows_by_name.setdefault(name, []).append(row)
    return {name: (len(rows), errors(predicted[rows], rated[rows], jnd)) for name, rows in rows_by_name.items()}


def difference(
    one: Array, other: Array, groups: Sequence[int], compared: int = 1, confidence: float = CONFIDENCE
) -> Difference:
    """Return the mean of `one - other`, (textures,) each, with a confidence interval that respects groups of textures.

    Errors in a group may be correlated, so the standard error is that of the sums over groups (cluster-robust, with
    G / (G - 1) for G groups, and G - 1 degrees of freedom: Cameron and Miller 2015, J. Hum. Resour. 50); where each
    texture is a group, the interval is Student's. For `compared` comparisons the confidence of each is
    1 - (1 - confidence) / compared (Bonferroni). Raises MaterialError for lengths that differ.
    """
    if not len(one) == len(other) == len(groups) or not len(one):
        raise MaterialError(f"{len(one)}, {len(other)} and {len(groups)} textures: pairs of the same ones expected.")
    differences, group = np.asarray(one, dtype=np.float64) - np.asarray(other, dtype=np.float64), np.asarray(groups)
    mean = float(differences.mean())
    sums = np.array([(differences[group == name] - mean).sum() for name in np.unique(group)])
    n = len(sums)
    if n < LEAST_PAIRS:
        return Difference(mean, None, None, n)
    from palpate.analysis.statistics.f_and_t import t_critical

    error = math.sqrt(n / (n - 1) * float((sums**2).sum())) / len(differences)
    reach = t_critical(n - 1, 1 - (1 - confidence) / max(1, compared)) * error
    return Difference(mean, mean - reach, mean + reach, n)
