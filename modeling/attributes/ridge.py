"""Ridge regression on whole textures: what a practitioner would try first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.statistics.one_thread import one_thread
from palpate.modeling.attributes.learnable import inner_folds, textures_of
from palpate.modeling.attributes.material import Texture
from palpate.modeling.attributes.methods import Learning, Method
from palpate.modeling.attributes.whole import Part, Whole, whole_of
from palpate.modeling.linear_path import PENALTIES, inner_errors, path_of
from palpate.signals.arrays import Array

SHARES = (0.0, 0.2, 0.5, 0.8, 1.0)
"""How much of a texture's row is touch, the rest is sight: each attribute has its own."""


@dataclass(frozen=True)
class Ridge:
    """y = weight z + bias over a texture's standardised row z; `share` of touch and `penalty` are those chosen."""

    front: Whole
    weight: Array
    bias: Array
    share: Array
    penalty: Array

    def predict(self, texture: Texture) -> Array:
        """(segments x pictures, attributes) on 0..100: each pair's own means with the texture's SDs.

        Their mean is the answer to the texture's row. Raises MaterialError for other features.
        """
        whole = (self.front(texture) @ self.weight.T + self.bias)[0]
        gain = self.front.standard.gain
        answers, start = np.zeros((1, len(whole))), 0
        for part in self.front.parts:
            columns = slice(start, start + part.size)
            rows = part.rows(texture)
            own = (rows - rows.mean(axis=0)) * gain[columns] @ self.weight[:, columns].T
            answers = (answers[:, None] + own[None]).reshape(-1, len(whole))
            start += 2 * part.size
        found: Array = whole + answers
        return found

    def saved(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Arrays and what is told of them, for `restored`."""
        own = {"weight": self.weight, "bias": self.bias, "share": self.share, "penalty": self.penalty}
        return {**own, **self.front.arrays()}, {"method": RIDGE.name, **self.front.told()}


def restored(tensors: Mapping[str, NDArray[Any]], told: Mapping[str, Any]) -> Ridge:
    """What `saved` gave, fitted again."""
    front = Whole.of(tensors, told)
    return Ridge(front, *(tensors[name] for name in ("weight", "bias", "share", "penalty")))


def fit(learning: Learning) -> Ridge:
    """Penalty and share of touch are those of least squared error over inner folds, for each attribute.

    Each kind's means and SDs weigh the same, however many numbers they are. Ridge regression does not notice a
    rotation, so what is searched are the textures' places along at most as many axes as there are textures.
    """
    with one_thread():
        textures, ratings = textures_of(learning)
        front, z = whole_of(textures, learning.touch, learning.sight)
        weighed = z * _evened(front)
        codes = [_rotated(weighed[:, columns]) for columns in _columns(front.parts)]
        shares = SHARES if len(codes) == 2 else (1.0,)
        places = [code for code, _ in codes]
        folds = list(inner_folds(textures))
        errors = np.stack([inner_errors(_joined(places, share), ratings, folds) for share in shares])
        weight, chosen = _best(learning, front, codes, ratings, errors, shares)
        return Ridge(front, weight, ratings.mean(axis=0) - weight @ z.mean(axis=0), *chosen.T)


def _best(
    learning: Learning,
    front: Whole,
    codes: Sequence[tuple[Array, Array]],
    ratings: Array,
    errors: Array,
    shares: Sequence[float],
) -> tuple[Array, Array]:
    """The errors (shares, penalties, attributes) choose; then each attribute is fitted to all textures.

    Gives the weights (attributes, columns), and share and penalty of each (attributes, 2).
    """
    weights, chosen = [], []
    for attribute in range(ratings.shape[1]):
        best, penalty = np.unravel_index(int(np.argmin(errors[:, :, attribute])), errors.shape[:2])
        share = shares[int(best)]
        path = path_of(_joined([code for code, _ in codes], share), ratings[:, attribute : attribute + 1])
        found = path.weights(float(PENALTIES[penalty]))[:, 0]
        weights.append(_unrotated(found, [axes for _, axes in codes], share) * _evened(front))
        chosen.append((share, float(PENALTIES[penalty])))
        learning.report(f"ridge: {learning.attributes[attribute].name}: touch {share:g}, penalty {chosen[-1][1]:.3g}")
    return np.stack(weights), np.array(chosen)


def _evened(front: Whole) -> Array:
    """(columns,): each block of varying columns as a whole weighs 1, whether 6 numbers or 2048."""
    factors = [np.zeros(0)]
    for part, columns in zip(front.parts, _columns(front.parts), strict=True):
        gain = front.standard.gain[columns]
        factors += [np.full(gain[one].size, max(int(np.count_nonzero(gain[one])), 1) ** -0.5) for one in part.blocks]
    return np.concatenate(factors)


def _columns(parts: Sequence[Part]) -> list[slice]:
    ends = np.cumsum([0, *(2 * part.size for part in parts)]).tolist()
    return [slice(start, end) for start, end in pairwise(ends)]


def _rotated(z: Array) -> tuple[Array, Array]:
    """Places (n, axes) along the axes (axes, columns) of least number that hold all of z."""
    left, singular, axes = np.linalg.svd(z, full_matrices=False)
    return left * singular, axes


def _joined(places: Sequence[Array], share: float) -> Array:
    return np.concatenate([each * root for each, root in zip(places, _roots(share), strict=False)], axis=1)


def _unrotated(weights: Array, axes: Sequence[Array], share: float) -> Array:
    parts = np.split(weights, np.cumsum([len(each) for each in axes])[:-1])
    return np.concatenate([part @ each * root for part, each, root in zip(parts, axes, _roots(share), strict=False)])


def _roots(share: float) -> tuple[float, float]:
    return share**0.5, (1.0 - share) ** 0.5


RIDGE = Method(
    "ridge",
    "Ridge on whole textures",
    fit,
    source="Hoerl and Kennard 1970; a penalty for each modality",
    restore=restored,
)
