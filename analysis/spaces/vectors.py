"""Adjectives as directions in a map: where each increases, and how well the map explains it."""

from __future__ import annotations

import math
from collections.abc import Hashable
from itertools import permutations

import numpy as np
import pandas as pd

from palpate.analysis.spaces.matrices import Matrix, centred, matrix_of, varies
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.draws import check_draws, p_of_draws, stream
from palpate.analysis.statistics.f_and_t import f_tail
from palpate.analysis.statistics.refusals import IncompleteCells, TooFew, listed, refuse_idle

BATCH = 500
NEAR = 1e-12


def property_vectors(
    points: pd.DataFrame, properties: pd.DataFrame, draws: int | None = None, seed: int = 0
) -> pd.DataFrame:
    """Regress each property (a column of objects x properties) on the coordinates of the objects' points.

    Columns: `property`; the direction cosines of its steepest ascent, one column per dimension; `r2` and `r` (multiple
    correlation); `F`, `df1`, `df2`, `p_F`; `p` of a permutation test that shuffles the property over the objects (in
    all ways if there are at most `draws`; NaN without `draws`); `note`. Undefined numbers are NaN, and the note says
    why. Raises IncompleteCells for objects in one table only, TooFew if objects - 1 <= dimensions. Sources: Carroll &
    Chang 1964 (property fitting); Oksanen et al., vegan::envfit.
    """
    if draws is None:
        refuse_idle("seed", seed, 0, "without `draws`: nothing is shuffled")
    place, values = matrix_of(points), matrix_of(properties)
    lonely = set(place.rows) ^ set(values.rows)
    if lonely:
        names = listed(sorted(map(repr, lonely)), len(lonely))
        raise IncompleteCells(f"only one of the tables holds {names}; the map and the properties need the same objects")
    objects, dimensions = place.values.shape
    if objects - 1 <= dimensions:
        raise TooFew(f"{objects} objects in {dimensions} dimensions fit any property exactly; expected more objects")
    if not varies(place.values).all():
        raise TooFew("a dimension of the map is the same for every object; leave it out")
    # An orthonormal basis of the map's columns, and what turns its coefficients into slopes along the dimensions.
    left, sizes, right = np.linalg.svd(centred(place.values), full_matrices=False)
    if sizes[-1] <= sizes[0] * len(left) * np.finfo(float).eps:
        raise TooFew("the dimensions of the map are multiples of each other; leave one out")
    basis, back = left, right.T / sizes
    shuffled, varied = _reached(basis, values, draws, seed), varies(values.values)
    rows = [
        _row(place, name, centred(values.values[:, [i]])[:, 0], basis, back, shuffled[i], bool(varied[i]))
        for i, name in enumerate(values.columns)
    ]
    return pd.DataFrame(rows)


def _row(
    place: Matrix, name: Hashable, about: Floats, basis: Floats, back: Floats, p: float, varied: bool
) -> dict[Hashable, object]:
    size = float(np.abs(about).max()) or 1.0
    weights = basis.T @ (about / size)
    slopes = back @ weights
    length = float(np.sqrt(slopes @ slopes))
    cosines = slopes / length if varied and length > 0 else np.full(len(slopes), math.nan)
    r2 = min(1.0, float(weights @ weights) / float((about / size) @ (about / size))) if varied else math.nan
    note = ""
    if math.isnan(r2):
        note = "the same value for every object: it has no direction"
    elif 1 - r2 <= NEAR:
        note = "the map explains it without remainder: F has no error to be held against"
    named: dict[Hashable, object] = {"property": name}
    named.update(zip(place.columns, cosines.tolist(), strict=True))
    # R squared and the F test of a regression; no F where nothing is left to hold it against.
    objects = len(place.rows)
    dimensions = len(slopes)
    df1, df2 = dimensions, objects - 1 - dimensions
    f = math.nan if math.isnan(r2) or 1 - r2 <= NEAR else r2 / df1 / ((1 - r2) / df2)
    return (
        named
        | {"r2": r2, "r": math.sqrt(r2), "F": f, "df1": df1, "df2": df2, "p_F": f_tail(f, df1, df2)}
        | {"p": p if varied else math.nan, "note": note}
    )


def _reached(basis: Floats, values: Matrix, draws: int | None, seed: int) -> list[float]:
    if draws is None:
        return [math.nan] * len(values.columns)
    check_draws(draws)
    about = centred(values.values)
    about = about / np.where(np.abs(about).max(axis=0) > 0, np.abs(about).max(axis=0), 1.0)
    objects = len(about)
    every = objects <= 12 and math.factorial(objects) <= draws
    orders = (
        np.array(list(permutations(range(objects))))
        if every
        else stream(seed, "property vectors").permuted(np.broadcast_to(np.arange(objects), (draws, objects)), axis=1)
    )
    observed = ((basis.T @ about) ** 2).sum(axis=0)
    reached = np.zeros(about.shape[1], dtype=np.intp)
    for start in range(0, len(orders), BATCH):
        drawn = ((basis.T @ about[orders[start : start + BATCH]]) ** 2).sum(axis=1)
        reached += (drawn >= observed * (1 - NEAR)).sum(axis=0)
    return [n / len(orders) if every else p_of_draws(n, draws) for n in reached.tolist()]
