"""Methods that learn from whole textures: the mean of the ratings, ridge regression, gradient-boosted trees.

A texture is one row: the mean of its segments and pictures, and their SD. Fifty textures of 110 segments are fifty
samples, not 5,500: what cannot tell rows from textures is given textures. Scikit-learn grows the trees, NumPy reads
them."""

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
"""A texture's numbers are kept within so many SDs: what is far off all that was learned from says no more than that."""
SHARES = (0.0, 0.2, 0.5, 0.8, 1.0)
"""How much of a texture's row is touch, the rest is sight: each attribute has its own."""
TREES, DEPTH, RATE = 200, 2, 0.05
COLUMNS = 0.1
"""The share of the columns that a split may choose from: ten times as fast, and no worse for so many alike."""


@dataclass(frozen=True)
class Part:
    """One modality of a texture as a row: `kinds` side by side, `widths` numbers each; the means, and then the SDs."""

    modality: Modality
    kinds: tuple[str, ...]
    widths: tuple[int, ...]

    @classmethod
    def of(cls, texture: Texture, modality: Modality, kinds: Sequence[str]) -> Self:
        """As this texture has them. Raises MaterialError where it has not."""
        return cls(modality, tuple(kinds), tuple(rows_of(texture, modality, [kind]).shape[1] for kind in kinds))

    @property
    def size(self) -> int:
        """Numbers in a row of a segment or picture; a texture's row has twice as many."""
        return sum(self.widths)

    def rows(self, texture: Texture) -> Array:
        """(segments or pictures, size)."""
        return rows_of(texture, self.modality, self.kinds, self.size).astype(np.float64)

    def row(self, texture: Texture) -> Array:
        """(2 x size,): means and SDs. An SD of one row is not known: NaN."""
        rows = self.rows(texture)
        spread = rows.std(axis=0, ddof=1) if len(rows) > 1 else np.full(self.size, np.nan)
        return np.concatenate([rows.mean(axis=0), spread])

    @property
    def blocks(self) -> tuple[slice, ...]:
        """Where each kind's means and each kind's SDs stand in a texture's row."""
        ends = np.cumsum([0, *self.widths, *self.widths]).tolist()
        return tuple(slice(start, end) for start, end in pairwise(ends))


@dataclass(frozen=True)
class Whole:
    """All parts of a texture in one standardised row; what is constant or not known becomes 0."""

    parts: tuple[Part, ...]
    standard: Standard

    def __call__(self, texture: Texture) -> Array:
        """(1, columns). Raises MaterialError for features that were not learned from."""
        return self.scaled(_row(self.parts, texture)[None])

    def scaled(self, rows: Array) -> Array:
        """Standardise rows (n, columns): missing values become 0, values beyond LIMIT the limit."""
        return np.clip(np.nan_to_num(self.standard(rows), nan=0.0), -LIMIT, LIMIT)

    def metadata(self) -> dict[str, Any]:
        """Return what `of` makes the same from, with the arrays `gain` and `offset`."""
        return {"parts": [[part.modality, list(part.kinds), list(part.widths)] for part in self.parts]}

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the standardisation."""
        return {"gain": self.standard.gain, "offset": self.standard.offset}

    @classmethod
    def of(cls, arrays: Any, metadata: Any) -> Self:
        """Return the whole from what `metadata` and `arrays` gave."""
        parts = (Part(modality, tuple(kinds), tuple(widths)) for modality, kinds, widths in metadata["parts"])
        return cls(tuple(parts), Standard(arrays["gain"], arrays["offset"]))


def whole_of(textures: Sequence[Texture], touch: Sequence[str], sight: Sequence[str]) -> tuple[Whole, Array]:
    """How these textures become rows, and the rows (textures, columns), standardised; a modality may be left out.

    Raises MaterialError where there is no kind at all, where a texture lacks one, or where their sizes differ.
    """
    named: tuple[tuple[Modality, Sequence[str]], ...] = (("touch", touch), ("sight", sight))
    parts = tuple(Part.of(textures[0], modality, kinds) for modality, kinds in named if kinds)
    if not parts:
        raise MaterialError("no kind of feature was named: at least one of touch or sight is looked at.")
    rows = np.stack([_row(parts, texture) for texture in textures])
    # an unknown value becomes the mean of the known ones, or 0 where there are none
    known = np.isfinite(rows)
    total = np.where(known, rows, 0.0).sum(axis=0)
    whole = Whole(parts, standard_of(np.where(known, rows, total / np.maximum(known.sum(axis=0), 1))))
    return whole, whole.scaled(rows)


def _row(parts: Sequence[Part], texture: Texture) -> Array:
    return np.concatenate([part.row(texture) for part in parts])


@dataclass(frozen=True)
class Mean:
    """The same for all."""

    mean: Array

    def predict(self, _texture: Texture) -> Array:
        """(1, attributes) on 0..100."""
        return self.mean[None].copy()

    def saved(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Return arrays and plain values, for `restore_mean`."""
        return {"mean": self.mean}, {"method": MEAN.name}


def fit_mean(learning: Learning) -> Mean:
    """Return the mean rating of each attribute, each texture counted once."""
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
    """Penalty and share of touch are those of least squared error over inner folds, for each attribute.

    Each kind's means and SDs weigh the same, however many numbers they are. Ridge regression does not notice a
    rotation, so what is searched are the textures' places along at most as many axes as there are textures.
    """
    with one_thread():
        textures, ratings = textures_of(learning)
        front, z = whole_of(textures, learning.touch, learning.sight)
        weighed = z * _evened(front)
        codes = []
        for columns in _columns(front.parts):
            left, singular, axes = np.linalg.svd(weighed[:, columns], full_matrices=False)
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
    """Choose by the errors (shares, penalties, attributes), then fit each attribute to all textures.

    Gives the weights (attributes, columns), and share and penalty of each (attributes, 2).
    """
    weights, chosen = [], []
    for attribute in range(ratings.shape[1]):
        best, penalty = np.unravel_index(int(np.argmin(errors[:, :, attribute])), errors.shape[:2])
        share = shares[int(best)]
        path = path_of(_joined([code for code, _ in codes], share), ratings[:, attribute : attribute + 1])
        best_weights = path.weights(float(PENALTIES[penalty]))[:, 0]
        parts = np.split(best_weights, np.cumsum([len(axes) for _, axes in codes])[:-1])
        rotated = zip(parts, codes, _roots(share), strict=False)
        weights.append(np.concatenate([part @ axes * root for part, (_, axes), root in rotated]) * _evened(front))
        chosen.append((share, float(PENALTIES[penalty])))
        learning.report(f"ridge: {learning.attributes[attribute].name}: touch {share:g}, penalty {chosen[-1][1]:.3g}")
    return np.stack(weights), np.array(chosen)


def _evened(front: Whole) -> Array:
    """(columns,): each block of varying columns as a whole weighs 1, whether 6 numbers or 2048."""
    factors = [np.zeros(0)]
    for part, columns in zip(front.parts, _columns(front.parts), strict=True):
        gain = front.standard.gain[columns]
        factors += [
            np.full(gain[block].size, max(int(np.count_nonzero(gain[block])), 1) ** -0.5) for block in part.blocks
        ]
    return np.concatenate(factors)


def _columns(parts: Sequence[Part]) -> list[slice]:
    ends = np.cumsum([0, *(2 * part.size for part in parts)]).tolist()
    return [slice(start, end) for start, end in pairwise(ends)]


def _joined(places: Sequence[Array], share: float) -> Array:
    return np.concatenate([place * root for place, root in zip(places, _roots(share), strict=False)], axis=1)


def _roots(share: float) -> tuple[float, float]:
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
    """y = bias + rate times the sum of an attribute's trees; `first` is where each attribute's trees begin."""

    front: Whole
    trees: Trees
    first: NDArray[np.int64]
    bias: Array

    def predict(self, texture: Texture) -> Array:
        """(1, attributes) on 0..100: the texture as a whole. Raises MaterialError for other features."""
        return self.answers(self.front(texture))

    def answers(self, z: Array) -> Array:
        """(n, columns) of whole textures to (n, attributes), summed in the order that scikit-learn sums in."""
        single = z.astype(np.float32).astype(np.float64)  # it compares in single precision
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
    """Fit Friedman's gradient boosting of squared error to each attribute by itself. Raises MaterialError."""
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
    """scikit-learn's regressors, one for each attribute, as arrays."""
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
