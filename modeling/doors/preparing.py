"""The common beginning of every fit: checked rows in a fixed order, standardised features, groups for inner folds."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import wraps
from typing import TypeVar

import numpy as np

from palpate.analysis.statistics.one_thread import one_thread
from palpate.modeling.doors.data import DoorData, source_groups
from palpate.modeling.doors.methods import Learning
from palpate.modeling.evaluate.rows import ModelDataError, as_rows
from palpate.modeling.regression import Standard, standard_of
from palpate.signals.arrays import Array, Indices
from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG
from palpate.signals.doors.limits import LIMIT_N, STEEPEST_N_DEG
from palpate.signals.doors.model_features import FEATURES, features
from palpate.signals.models.card import Affine, DoorFeatures, Playable, Step

INNER_FOLDS = 5
FURTHEST_N = 10.0 * LIMIT_N
"""The greatest force of a profile, ten times the limit of made profiles: beyond it, the profile is refused."""
PLAYABLE = Playable(force_N=LIMIT_N, slope_N_deg=STEEPEST_N_DEG)
"""The last step of a model that makes profiles: the limits of made profiles."""
WISH = (-100.0, 200.0)
"""Ratings beyond these are refused: the scale is 0..100."""
STIMULI = ("measured", "train")
Model = TypeVar("Model")


def on_one_thread(fit: Callable[[Learning], Model]) -> Callable[[Learning], Model]:
    """Return the fit with linear algebra limited to one thread.

    Several threads change the order of sums, and so the result. They are also slower, since matrices here are small: on
    two threads `pca_ridge` takes up to thirty times the processor time.
    """

    @wraps(fit)
    def fitted(learning: Learning) -> Model:
        with one_thread():
            return fit(learning)

    return fitted


@dataclass(frozen=True)
class TrainingRows:
    """The data of a fit: forces (n, 621) in newtons, ratings (n, attributes) on 0..100, groups (n,) by source."""

    force_N: Array
    rating: Array
    group: Indices


def rows_of(learning: Learning, default: str = "measured", least: int = 1) -> TrainingRows:
    """Return the rows to learn from, in an order that does not depend on the order of the data.

    `default` selects the stimuli alone ("measured") or with their training variants ("train"); the setting `learn_from`
    overrides it. Raises ModelDataError for fewer than `least` rows, ratings or forces that are not finite, a force that
    no hand would open a door with, or another word in `learn_from`.
    """
    which = learning.settings.get("learn_from", default)
    if which not in STIMULI:
        raise ModelDataError(f"learn_from: {which!r} was given, expected one of {', '.join(STIMULI)}.")
    data: DoorData = getattr(learning, which)
    if len(data) < least:
        raise ModelDataError(f"the training side has {len(data)} stimuli; at least {least} are needed.")
    force = checked_forces(data.force_N)
    rating = learning.scaling.rating_up(as_rows(data.rating, len(data.attributes), "ratings"))
    keys = [(force[i].tobytes(), rating[i].tobytes(), data.source[i], data.ids[i]) for i in range(len(data))]
    order = np.array(sorted(range(len(data)), key=keys.__getitem__), dtype=np.int64)
    return TrainingRows(force[order], rating[order], source_groups(data.rows(order)))


def checked_forces(force_N: Array) -> Array:
    """Return forces (n, 621) as float64.

    Raises ModelDataError naming a row that is not finite or exceeds FURTHEST_N.
    """
    force = as_rows(force_N, POINTS, "force profiles")
    if (bad := np.argwhere(np.abs(force) > FURTHEST_N)).size:
        row, place = bad[0]
        raise ModelDataError(
            f"force profiles: row {row + 1} holds {force[row, place]:g} N at {place / POINTS_PER_DEG:g} deg; no door "
            f"is opened with more than {FURTHEST_N:g} N. Correct the spike or leave the profile out."
        )
    return force


def checked_wishes(rating: Array, attributes: int) -> Array:
    """Return ratings (n, attributes) as float64. Raises ModelDataError for ratings far off the scale 0..100."""
    wish = as_rows(rating, attributes, "ratings")
    if (bad := np.argwhere((wish < WISH[0]) | (wish > WISH[1]))).size:
        row, place = bad[0]
        raise ModelDataError(
            f"ratings: row {row + 1} holds {wish[row, place]:g} at place {place + 1}; 0..100 is asked."
        )
    return wish


def inner_folds(group: Indices, folds: int = INNER_FOLDS) -> Iterator[tuple[Indices, Indices]]:
    """Yield training and test rows of folds with no group on both sides. Raises ModelDataError for a single group."""
    from sklearn.model_selection import GroupKFold

    count = len(np.unique(group))
    if count < 2:
        raise ModelDataError(
            "all training stimuli come from one source: a penalty is chosen between sources, so two are needed."
        )
    yield from GroupKFold(min(folds, count)).split(group, groups=group)


@dataclass(frozen=True)
class Featured:
    """A function from profiles (n, 621) in newtons to standardised features (n, features) (thesis 5.3.4.1, figure 5.6).

    A feature that was constant in training becomes 0, since its effect is unknown.
    """

    standard: Standard

    def __call__(self, force_N: Array) -> Array:
        """Return the features of profiles. Raises ModelDataError for invalid profiles."""
        return self.standard(features(checked_forces(force_N)))

    @property
    def steps(self) -> tuple[Step, ...]:
        """The steps of a card that compute the features."""
        return DoorFeatures(names=FEATURES), Affine(gain="feature_gain", offset="feature_offset")

    @property
    def tensors(self) -> Mapping[str, Array]:
        """The tensors that the steps name."""
        return {"feature_gain": self.standard.gain, "feature_offset": self.standard.offset}


def featured(rows: TrainingRows) -> tuple[Featured, Array]:
    """Return the feature function fitted to these rows, and their standardised features (n, features)."""
    raw = features(rows.force_N)
    standard = standard_of(raw)
    return Featured(standard), standard(raw)
