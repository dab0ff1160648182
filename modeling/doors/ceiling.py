"""The best possible prediction of ratings, which is limited by the noise of means over few people."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.doors.data import Scaling, scaling_of
from palpate.modeling.doors.rated import Individual, Rated
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.protocols.keyed import keyed_bits
from palpate.signals.arrays import Array, Indices

SPLITS = 1000
ROUNDING = 1e-12
"""Mean squares of ratings on 0..100 up to this value are rounding, not variance."""
Of = Literal["other_people", "same_people"]
OF: tuple[Of, ...] = ("other_people", "same_people")


@dataclass(frozen=True)
class Ceiling:
    """The noise of the mean ratings, on 0..100, by attribute and overall (the last entry of each array).

    `half_r` is the correlation between the means of two random halves of the raters, `reliability` that of the means
    of all (Spearman-Brown). `mae`, `rmse` and `r2` are those of a perfect predictor. `note` says why a number is NaN.
    """

    attributes: tuple[str, ...]
    half_r: Array
    reliability: Array
    mae: Array
    rmse: Array
    r2: Array
    of: Of
    splits: int
    seed: int
    note: str = ""


def noise_ceiling(
    rated: Rated, scaling: Scaling | None = None, *, of: Of = "other_people", splits: int = SPLITS, seed: int = 0
) -> Ceiling:
    """Return the errors of a perfect predictor, from random halves of the people within each group of raters.

    The predictor of `other_people` knows the mean of the whole population: the raters' own bias and taste are noise to
    it. That of the `same_people` also knows each rater's mean deviation from the others, which is removed first. A
    model trained on the same people's ratings of other stimuli can learn these deviations, and so have less error than
    the first predictor.

    With halves of a and b people, the difference of their means has the variance s^2 (1/a + 1/b), the mean of all
    a + b the variance s^2 / (a + b); so a perfect predictor's error is the halves' difference times
    sqrt(a b) / (a + b), one half of it where a = b (its RMSE exactly, its MAE where errors are normal). R2 is
    1 - sum of squared errors / sum of squares of the means (thesis 5.7). `scaling` is that of the data, unless given.
    Raises ModelDataError where a group or a stimulus has one rater, so that nothing can be split.
    """
    if of not in OF or splits < 1:
        raise ModelDataError(f"of={of!r}, splits={splits}: one of {', '.join(OF)} and at least 1 split are expected")
    scaling = scaling or scaling_of(rated.data)
    value = scaling.rating_up(rated.individual.value)
    raters = (~np.isnan(rated.individual.value)).sum(axis=0).min(axis=1)
    counts = [(f"group {name!r}", count) for name, count in Counter(rated.individual.groups).items()]
    counts += [(f"stimulus {name!r}", int(count)) for name, count in zip(rated.data.ids, raters, strict=True)]
    for what, count in counts:
        if count < 2:
            raise ModelDataError(
                f"{what} has {count} rater: there is nothing to split in halves, so the noise of the mean ratings is"
                " not known; ask at least two people"
            )
    if of == "same_people":
        value = _levelled(value)
    halves = [_halves(value, half) for half in _random_halves(rated.individual, splits, seed)]
    first, second, shrunk = (np.array(values) for values in zip(*halves, strict=True))
    # first, second and shrunk are (splits, stimuli, attributes)
    rating = scaling.rating_up(rated.data.rating)
    by_attribute = [
        _one(rating[:, [i]], first[..., [i]], second[..., [i]], shrunk[..., [i]])
        for i in range(len(rated.data.attributes))
    ]
    half_r, reliability, mae, rmse, r2 = np.array([*by_attribute, _one(rating, first, second, shrunk)]).T
    names = (*rated.data.attributes, "overall")
    flat, half = np.isnan(r2), np.isnan(half_r) & ~np.isnan(r2)
    undefined = [
        ("the means do not vary: no correlation and no R2", flat),
        ("a half's means do not vary: no correlation", half),
    ]
    note = "; ".join(f"{why} of {', '.join(np.array(names)[which])}" for why, which in undefined if which.any())
    return Ceiling(tuple(rated.data.attributes), half_r, reliability, mae, rmse, r2, of, len(first), seed, note)


def _levelled(value: Array) -> Array:
    """Return the answers without each person's mean deviation from all answers to the same stimuli.

    A deviation that is estimated from n answers takes 1/n of their variance with it, which is restored. A person with
    one answer is left out, since nothing would remain.
    """
    count = (~np.isnan(value)).sum(axis=1, keepdims=True)
    value = np.where(count > 1, value, np.nan)
    level = _mean((value - _over_people(value)).swapaxes(0, 1), count[:, 0])[:, None]
    centre = _over_people(value - level)
    levelled: Array = centre + (value - level - centre) * np.sqrt(count / np.maximum(count - 1, 1))
    return levelled


def _over_people(value: Array) -> Array:
    return _mean(value, (~np.isnan(value)).sum(axis=0))


def _random_halves(individual: Individual, splits: int, seed: int) -> NDArray[np.bool_]:
    """Return whether each person is in the first half, (splits, people); half of each group is, within one."""
    draw = np.random.Generator(np.random.PCG64(keyed_bits("halves", seed)))
    order = np.argsort(np.array(individual.people))
    first = np.zeros((splits, len(order)), dtype=bool)
    for group in sorted(set(individual.groups)):
        members = [person for person in order if individual.groups[person] == group]
        for split in range(splits):
            size = (len(members) + int(draw.integers(2))) // 2
            first[split, draw.permutation(members)[:size]] = True
    return first


def _halves(value: Array, first: NDArray[np.bool_]) -> tuple[Array, Array, Array]:
    """Return the means of both halves, and the error of a perfect predictor of the mean of both."""
    a, b = ((~np.isnan(value[half])).sum(axis=0) for half in (first, ~first))
    one, two = (_mean(value[half], count) for half, count in ((first, a), (~first, b)))
    return one, two, (one - two) * np.sqrt(a * b) / np.maximum(a + b, 1)


def _mean(value: Array, count: Indices) -> Array:
    """Return the mean over the first axis of `count` values, NaN where there are none."""
    mean: Array = np.divide(np.nansum(value, axis=0), count, out=np.full(count.shape, np.nan), where=count > 0)
    return mean


def _one(rating: Array, first: Array, second: Array, error: Array) -> tuple[float, float, float, float, float]:
    seen = error[~np.isnan(error)]
    if not seen.size:
        raise ModelDataError("no stimulus was rated in both halves of its raters: more splits or raters are needed")
    half_r = float(np.mean([_r(*pair) for pair in zip(first, second, strict=True)]))
    square = float(np.mean(seen**2))
    total = float(np.mean((rating - rating.mean(axis=0)) ** 2))
    whole_r = 2 * half_r / (1 + half_r) if half_r > -1 else np.nan
    r2 = 1 - square / total if total > ROUNDING else np.nan
    return half_r, whole_r, float(np.mean(np.abs(seen))), float(np.sqrt(square)), r2


def _r(first: Array, second: Array) -> float:
    """Return Pearson's r between two halves' means, within attributes if there are several; NaN if they do not vary."""
    both = ~np.isnan(first) & ~np.isnan(second)
    count = np.maximum(both.sum(axis=0), 1)
    x, y = (np.where(both, half - np.where(both, half, 0.0).sum(axis=0) / count, 0.0) for half in (first, second))
    length = float(np.sqrt((x * x).sum() * (y * y).sum()))
    return float((x * y).sum() / length) if length > ROUNDING * both.sum() else np.nan
