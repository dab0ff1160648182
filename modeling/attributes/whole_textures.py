"""Methods that learn from whole textures: the mean of the ratings, ridge regression, gradient-boosted trees.

A texture is one row: the mean of its segments and pictures, and their SD. Fifty textures of 110 segments are fifty
samples, not 5,500. Scikit-learn fits the trees, NumPy evaluates them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.statistics.one_thread import one_thread
from palpate.modeling.attributes.learnable import inner_folds, rows_of, textures_of
from palpate.modeling.attributes.material import MaterialError, Modality, Texture
from palpate.modeling.attributes.methods import Learning, Method
from palpate.modeling.regression import PENALTIES, Standard, Trees, inner_errors, path_of, standard_of, trees_of
from palpate.signals.arrays import Array

LIMIT = 10.0
"""The SDs to which a texture's standardised numbers are clipped."""
SHARES = (0.0, 0.2, 0.5, 0.8, 1.0)
"""Weights of touch in a texture's row, the rest is sight; one is chosen for each attribute."""
TREES, DEPTH, RATE = 200, 2, 0.05
COLUMNS = 0.1
"""The share of columns that a split chooses from: ten times as fast, and no worse, since many columns are similar."""


@dataclass(frozen=True)
class Part:
    """One modality of a texture as a row: the means of all kinds side by side, `widths` numbers each, then SDs."""

    modality: Modality
    kinds: tuple[str, ...]
    widths: tuple[int, ...]

    @classmethod
    def of(cls, texture: Texture, modality: Modality, kinds: Sequence[str]) -> Self:
        """Return the part with the widths of a texture. Raises MaterialError for missing features."""
        return cls(modality, tuple(kinds), tuple(rows_of(texture, modality, [kind]).shape[1] for kind in kinds))

    @property
    def size(self) -> int:
        """The number of features of a segment or picture; a texture's row has twice as many."""
        return sum(self.widths)

    def rows(self, texture: Texture) -> Array:
        """Return a texture's rows (segments or pictures, size). Raises MaterialError for other features."""
        return rows_of(texture, self.modality, self.kinds, self.size).astype(np.float64)

    def row(self, texture: Texture) -> Array:
        """Return a texture's row (2 x size,), means and SDs; the SD of a single row is NaN."""
        rows = self.rows(texture)
        spread = rows.std(axis=0, ddof=1) if len(rows) > 1 else np.full(self.size, np.nan)
        return np.concatenate([rows.mean(axis=0), spread])

    @property
    def blocks(self) -> tuple[slice, ...]:
        """The slices of each kind's means and of each kind's SDs in a texture's row."""
        ends = np.cumsum([0, *self.widths, *self.widths]).tolist()
        return tuple(slice(start, end) for start, end in pairwise(ends))


@dataclass(frozen=True)
class Whole:
    """The standardised row of a texture with all parts; constant columns and missing values become 0."""

    parts: tuple[Part, ...]
    standard: Standard

    def __call__(self, texture: Texture) -> Array:
        """Return a texture's row (1, columns). Raises MaterialError for other features."""
        return self.scaled(_row(self.parts, texture)[None])

    def scaled(self, rows: Array) -> Array:
        """Return standardised rows (n, columns), with 0 for missing values, clipped to `LIMIT`."""
        return np.clip(np.nan_to_num(self.standard(rows), nan=0.0), -LIMIT, LIMIT)

    def metadata(self) -> dict[str, Any]:
        """Return the plain values that `of` takes beside `arrays`."""
        return {"parts": [[part.modality, list(part.kinds), list(part.widths)] for part in self.parts]}

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the standardisation, (columns,) each."""
        return {"gain": self.standard.gain, "offset": self.standard.offset}

    @classmethod
    def of(cls, arrays: Any, metadata: Any) -> Self:
        """Return the object from its `arrays` and `metadata`."""
        parts = (Part(modality, tuple(kinds), tuple(widths)) for modality, kinds, widths in metadata["parts"])
        return cls(tuple(parts), Standard(arrays["gain"], arrays["offset"]))


def whole_of(textures: Sequence[Texture], touch: Sequence[str], sight: Sequence[str]) -> tuple[Whole, Array]:
    """Return the standardisation of these textures' rows, and the rows (textures, columns); a modality may be empty.

    Raises MaterialError where no kind is named, a texture has no such features, or their sizes differ.
    """
    named: tuple[tuple[Modality, Sequence[str]], ...] = (("touch", touch), ("sight", sight))
    parts = tuple(Part.of(textures[0], modality, kinds) for modality, kinds in named if kinds)
    if not parts:
        raise MaterialError("no kind of feature was named: at least one of touch or sight is looked at.")
    rows = np.stack([_row(parts, texture) for texture in textures])
    # a missing value becomes the mean of the column, or 0 where the column has no values
    known = np.isfinite(rows)
    total = np.where(known, rows, 0.0).sum(axis=0)
    whole = Whole(parts, standard_of(np.where(known, rows, total / np.maximum(known.sum(axis=0), 1))))
    return whole, whole.scaled(rows)


def _row(parts: Sequence[Part], texture: Texture) -> Array:
    return np.concatenate([part.row(texture) for part in parts])


@dataclass(frozen=True)
class Mean:
    """The mean ratings, (attributes,) on 0..100, as the prediction for every texture."""

    mean: Array

    def predict(self, _texture: Texture) -> Array:
        """Return the mean ratings (1, attributes)."""
        return self.mean[None].copy()

    def saved(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Return arrays and plain values, for `restore_mean`."""
        return {"mean": self.mean}, {"method": MEAN.name}


def fit_mean(learning: Learning) -> Mean:
    """Return the mean rating of each attribute over textures. Raises MaterialError for textures without ratings."""
    _, ratings = textures_of(learning, least=1)
    return Mean(ratings.mean(axis=0))


def restore_mean(arrays: Mapping[str, NDArray[Any]], _metadata: Mapping[str, Any]) -> Mean:
    """Return the fitted method from the arrays and plain values of `saved`."""
    return Mean(arrays["mean"])


MEAN = Method(
    "mean",
    "Mean of the training textures",
    fit_mean,
    sees=frozenset(),
    source="the reference of R2",
    restore=restore_mean,
)


@dataclass(frozen=True)
class Ridge:
    """A fitted ridge regression y = weight z + bias on a texture's standardised row z.

    `weight` is (attributes, columns), the others (attributes,); `share` of touch and `penalty` are those chosen.
    """

    front: Whole
    weight: Array
    bias: Array
    share: Array
    penalty: Array

    def predict(self, texture: Texture) -> Array:
        """Return predictions (segments x pictures, attributes) on 0..100, of each pair with the texture's SDs.

        Their mean is the prediction for the texture's row. Raises MaterialError for other features.
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
        result: Array = whole + answers
        return result

    def saved(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Return arrays and plain values, for `restore_ridge`."""
        own = {"weight": self.weight, "bias": self.bias, "share": self.share, "penalty": self.penalty}
        return {**own, **self.front.arrays()}, {"method": RIDGE.name, **self.front.metadata()}


def restore_ridge(arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any]) -> Ridge:
    """Return the fitted method from the arrays and plain values of `saved`."""
    front = Whole.of(arrays, metadata)
    return Ridge(front, *(arrays[name] for name in ("weight", "bias", "share", "penalty")))


def fit_ridge(learning: Learning) -> Ridge:
    """Fit a ridge regression to each attribute, with the penalty and share of touch of least error over inner folds.

    Each kind's means and SDs have the same weight, whatever their number. Ridge regression is invariant to rotation, so
    the search uses the textures' coordinates on at most as many axes as there are textures. Raises MaterialError for
    textures that cannot be learned from.
    """
    with one_thread():
        textures, ratings = textures_of(learning)
        front, z = whole_of(textures, learning.touch, learning.sight)
        weighted = z * _block_weights(front)
        codes = []
        for columns in _columns(front.parts):
            left, singular, axes = np.linalg.svd(weighted[:, columns], full_matrices=False)
            codes.append((left * singular, axes))
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
    """Choose share and penalty by the errors (shares, penalties, attributes), then fit each attribute to all textures.

    Return the weights (attributes, columns), and share and penalty of each attribute, (attributes, 2).
    """
    weights, chosen = [], []
    for attribute in range(ratings.shape[1]):
        best, penalty = np.unravel_index(int(np.argmin(errors[:, :, attribute])), errors.shape[:2])
        share = shares[int(best)]
        path = path_of(_joined([code for code, _ in codes], share), ratings[:, attribute : attribute + 1])
        best_weights = path.weights(float(PENALTIES[penalty]))[:, 0]
        parts = np.split(best_weights, np.cumsum([len(axes) for _, axes in codes])[:-1])
        rotated = zip(parts, codes, _roots(share), strict=False)
        own = np.concatenate([part @ axes * root for part, (_, axes), root in rotated])
        weights.append(own * _block_weights(front))
        chosen.append((share, float(PENALTIES[penalty])))
        learning.report(f"ridge: {learning.attributes[attribute].name}: touch {share:g}, penalty {chosen[-1][1]:.3g}")
    return np.stack(weights), np.array(chosen)


def _block_weights(front: Whole) -> Array:
    """Return weights (columns,) with which each block of varying columns has a total weight of 1."""
    factors = [np.zeros(0)]
    for part, columns in zip(front.parts, _columns(front.parts), strict=True):
        gain = front.standard.gain[columns]
        factors += [
            np.full(gain[block].size, max(int(np.count_nonzero(gain[block])), 1) ** -0.5) for block in part.blocks
        ]
    return np.concatenate(factors)


def _columns(parts: Sequence[Part]) -> list[slice]:
    """Return the slices of the parts in a texture's row."""
    ends = np.cumsum([0, *(2 * part.size for part in parts)]).tolist()
    return [slice(start, end) for start, end in pairwise(ends)]


def _joined(places: Sequence[Array], share: float) -> Array:
    """Return the parts' coordinates side by side, weighted by the share of touch."""
    return np.concatenate([place * root for place, root in zip(places, _roots(share), strict=False)], axis=1)


def _roots(share: float) -> tuple[float, float]:
    """Return the factors of touch and sight."""
    return share**0.5, (1.0 - share) ** 0.5


RIDGE = Method(
    "ridge",
    "Ridge on whole textures",
    fit_ridge,
    source="Hoerl and Kennard 1970; a penalty for each modality",
    restore=restore_ridge,
)


@dataclass(frozen=True)
class Boosted:
    """Fitted boosted trees: y = bias + rate times the sum of an attribute's trees.

    `first`, (attributes + 1,), are the positions of each attribute's first tree; `bias` is (attributes,).
    """

    front: Whole
    trees: Trees
    first: NDArray[np.int64]
    bias: Array

    def predict(self, texture: Texture) -> Array:
        """Return a prediction (1, attributes) on 0..100. Raises MaterialError for other features."""
        return self.answers(self.front(texture))

    def answers(self, z: Array) -> Array:
        """Return predictions (n, attributes) of rows (n, columns), summed in scikit-learn's order."""
        single = z.astype(np.float32).astype(np.float64)  # scikit-learn compares in single precision
        steps = RATE * self.trees.value[self.trees.leaves(single), 0]
        parts = [steps[:, start:end] for start, end in pairwise(self.first)]
        terms_of = [np.column_stack([np.full(len(z), bias), part]) for bias, part in zip(self.bias, parts, strict=True)]
        return np.stack([np.add.accumulate(terms, axis=1)[:, -1] for terms in terms_of], axis=1)

    def saved(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Return arrays and plain values, for `restore_boosting`."""
        nodes = {f"trees.{name}": getattr(self.trees, name) for name in Trees.__dataclass_fields__}
        own = {"first": self.first, "bias": self.bias}
        return {**nodes, **own, **self.front.arrays()}, {"method": BOOSTING.name, **self.front.metadata()}


def restore_boosting(arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any]) -> Boosted:
    """Return the fitted method from the arrays and plain values of `saved`."""
    trees = Trees(*(arrays[f"trees.{name}"] for name in Trees.__dataclass_fields__))
    return Boosted(Whole.of(arrays, metadata), trees, arrays["first"], arrays["bias"])


def fit_boosting(learning: Learning) -> Boosted:
    """Fit Friedman's gradient boosting of squared error to each attribute by itself.

    Raises MaterialError for textures that cannot be learned from.
    """
    from sklearn.ensemble import GradientBoostingRegressor

    textures, ratings = textures_of(learning)
    front, z = whole_of(textures, learning.touch, learning.sight)
    grown = []
    for rating in ratings.T:
        ensemble = GradientBoostingRegressor(
            n_estimators=TREES, max_depth=DEPTH, learning_rate=RATE, max_features=COLUMNS,
            random_state=learning.seed % 2**32,
        )  # fmt: skip
        grown.append(ensemble.fit(z.astype(np.float32), rating))
    learning.report(f"boosting: {TREES} trees for each attribute")
    return boosted(front, grown, ratings.mean(axis=0))


def boosted(front: Whole, grown: Sequence[Any], bias: Array) -> Boosted:
    """Return scikit-learn's regressors, one for each attribute, as arrays."""
    trees = [[tree.tree_ for tree in forest.estimators_[:, 0]] for forest in grown]
    first = np.cumsum([0, *map(len, trees)]).astype(np.int64)
    return Boosted(front, trees_of([tree for own in trees for tree in own]), first, bias)


BOOSTING = Method(
    "boosting",
    "Boosted trees on whole textures",
    fit_boosting,
    source="Friedman 2001, by scikit-learn",
    restore=restore_boosting,
)
