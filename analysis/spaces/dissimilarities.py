"""Dissimilarities of objects: distances between profiles of ratings, or ratings of pairs."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd
from scipy.spatial.distance import pdist, squareform

from palpate.analysis.spaces.matrices import Matrix, matrix_of, varies
from palpate.analysis.spaces.profiles import Profiles
from palpate.analysis.spaces.resampling import Ratings
from palpate.analysis.statistics.cells import Coded, Counts, cell_means, check_columns, coded, numbers_of
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import (
    BadOption,
    BadValue,
    DuplicatedCells,
    IncompleteCells,
    TooFew,
    listed,
    shown,
)

Meaning: TypeAlias = Literal["dissimilarity", "similarity"]
LEAST = 3


@dataclass(frozen=True)
class Dissimilarities:
    """A symmetric table without negative values, 0 on the diagonal, in label order; `source` describes its origin.

    `ratings` has each participant's contribution, `remade` makes such a table from a mean of it, for resampling; None
    without participants.
    """

    values: Floats
    labels: tuple[Hashable, ...]
    source: str
    ratings: Ratings | None = None
    remade: Callable[[Floats], Floats] | None = None
    notes: tuple[str, ...] = ()


def dissimilarities_of(frame: pd.DataFrame) -> Dissimilarities:
    """Return a square table with the same labels in rows and columns as dissimilarities.

    Raises BadValue for negative values, a diagonal that is not 0 or a table that is not symmetric (relative 1e-9),
    TooFew for fewer than three objects, UnknownColumn or DuplicatedCells for its labels.
    """
    matrix = matrix_of(frame)
    if matrix.rows != matrix.columns:
        raise BadValue(f"rows and columns name different objects: {matrix.rows[:3]}... and {matrix.columns[:3]}...")
    size = float(np.abs(matrix.values).max())
    uneven = np.argwhere(np.abs(matrix.values - matrix.values.T) > 1e-9 * size).tolist()
    if uneven:
        listing = listed((f"{matrix.rows[i]!r}, {matrix.rows[j]!r}" for i, j in uneven if i < j), len(uneven) // 2)
        raise BadValue(
            f"the table is not symmetric at {listing}; average the two halves first if both are measurements"
        )
    if (matrix.values < 0).any():
        i, j = np.argwhere(matrix.values < 0)[0].tolist()
        raise BadValue(f"negative dissimilarity of {matrix.rows[i]!r} and {matrix.rows[j]!r}; expected 0 or more")
    if np.abs(np.diag(matrix.values)).max() > 1e-9 * size:
        raise BadValue("an object differs from itself: the diagonal must be 0; are these similarities?")
    square = (matrix.values + matrix.values.T) / 2
    np.fill_diagonal(square, 0.0)
    return _checked(Dissimilarities(square, matrix.rows, "given dissimilarities"))


def distances(table: pd.DataFrame, scaled: bool = False) -> Dissimilarities:
    """Return Euclidean distances between the rows of a wide table (objects x attributes).

    `scaled` divides each attribute by its standard deviation over the objects first, so that all have the same weight;
    a constant attribute is then refused (BadValue).
    """
    return _checked(_from_matrix(matrix_of(table), scaled))


def profile_distances(profiles: Profiles, scaled: bool = False) -> Dissimilarities:
    """Return Euclidean distances between the stimuli's mean ratings, ready to be resampled over participants."""
    stimuli, attributes = profiles.stimuli, profiles.attributes
    result = _from_matrix(Matrix(profiles.small_means(), stimuli, attributes), scaled)
    shape = (len(stimuli), len(attributes))

    def remade(means: Floats) -> Floats:
        return _euclidean(means.reshape(shape), scaled)

    return _checked(Dissimilarities(result.values, stimuli, result.source, profiles.ratings, remade))


def _from_matrix(matrix: Matrix, scaled: bool) -> Dissimilarities:
    if scaled:
        constant = [repr(matrix.columns[i]) for i in np.flatnonzero(~varies(matrix.values).astype(bool)).tolist()]
        if constant:
            listing = listed(constant, len(constant))
            raise BadValue(f"the same value for every object: {listing}; it cannot be scaled: leave it out")
    how = "each attribute over its standard deviation" if scaled else "attributes in their own units"
    source = f"Euclidean distances between means, {how}"
    return Dissimilarities(_euclidean(matrix.values, scaled), matrix.rows, source)


def _euclidean(values: Floats, scaled: bool) -> Floats:
    # Differences come before products, so that an offset costs nothing; a unit as large as the data avoids overflow.
    small = values - values.min(axis=0)
    if scaled:
        spread = small.std(axis=0, ddof=1)
        small = np.divide(small, spread, out=np.zeros_like(small), where=spread > 0)
    unit = np.ldexp(1.0, int(np.frexp(small.max(initial=0.0))[1]))
    result: Floats = squareform(pdist(small / unit)) * unit
    return result


def pair_dissimilarities(
    data: pd.DataFrame,
    dv: Hashable,
    first: Hashable,
    second: Hashable,
    participant: Hashable | None = None,
    meaning: Meaning = "dissimilarity",
    top: float | None = None,
) -> Dissimilarities:
    """Return the means of ratings of pairs, over a participant's repetitions (either order), then over participants.

    A similarity s becomes `top` - s; `top` is the similarity of identical objects (default: the largest mean, with a
    note). Rows that pair an object with itself are left out. Raises IncompleteCells for a pair that nobody rated,
    BadValue for a negative dissimilarity or s above top.
    """
    if meaning not in ("dissimilarity", "similarity"):
        raise BadOption(f"meaning={shown(meaning)} is unknown: 'dissimilarity' or 'similarity'")
    check_columns(data, [dv, first, second, *([] if participant is None else [participant])])
    values = numbers_of(data[dv], dv)
    # Codes of both objects of each row, in one set of labels.
    objects = coded(pd.concat([data[first], data[second]], ignore_index=True), f"{first} and {second}")
    half = len(data)
    one, two, labels = objects.codes[:half], objects.codes[half:], tuple(objects.labels)
    people = Coded(np.zeros(len(data), np.intp), ["all"]) if participant is None else coded(data[participant], "people")
    between = (one != two) & ~np.isnan(values)
    ratings = _own_pairs(
        values[between], one[between], two[between], people.codes[between], len(labels), len(people.labels)
    )
    empty = np.isnan(ratings.values).all(axis=0)
    if empty.any():
        unrated = np.argwhere(np.triu(squareform(empty))).tolist()
        names = listed((f"{labels[i]!r} and {labels[j]!r}" for i, j in unrated), len(unrated))
        raise IncompleteCells(f"nobody compared {names}; every pair needs a value")
    means = ratings.means()[0]
    highest = float(means.max()) if top is None else top

    def remade(cells: Floats) -> Floats:
        turned = highest - cells if meaning == "similarity" else cells
        result: Floats = squareform(np.maximum(turned, 0.0))
        return result

    how = f"{highest:.15g} - mean similarity" if meaning == "similarity" else "mean dissimilarity"
    cells = highest - means if meaning == "similarity" else means
    size = float(np.abs(cells).max())
    negative = np.argwhere(np.triu(squareform(cells < -1e-9 * size))).tolist()
    if negative:
        names = listed((f"{labels[i]!r} and {labels[j]!r}" for i, j in negative), len(negative))
        raise BadValue(f"{how} is negative for {names}; name the scale's right end (top=) or its meaning")
    known = ratings if participant is not None else None
    return _checked(Dissimilarities(remade(means), labels, f"{how} of each pair", known, remade))


def _own_pairs(values: Floats, one: Counts, two: Counts, people: Counts, size: int, persons: int) -> Ratings:
    if size < LEAST:
        raise TooFew(f"{size} objects; a space needs {LEAST} or more")
    low, high = np.minimum(one, two), np.maximum(one, two)
    pair = (low * (2 * size - low - 1) // 2 + high - low - 1).astype(np.intp)
    pairs = size * (size - 1) // 2
    flat = people.astype(np.intp) * pairs + pair
    count = np.bincount(flat, minlength=persons * pairs)
    return Ratings(cell_means(values, flat, count).reshape(persons, pairs))


def _checked(result: Dissimilarities) -> Dissimilarities:
    if len(result.labels) < LEAST:
        raise TooFew(f"{len(result.labels)} objects; a space needs {LEAST} or more")
    if len(set(result.labels)) != len(result.labels):
        raise DuplicatedCells("an object's label appears twice")
    if not result.values.any():
        raise BadValue("all objects are the same: every dissimilarity is 0, there is no space")
    same = np.argwhere(np.triu(result.values == 0, 1)).tolist()
    if not same:
        return result
    names = listed((f"{result.labels[i]!r} and {result.labels[j]!r}" for i, j in same), len(same))
    note = f"no difference between {names}: their points coincide"
    return Dissimilarities(
        result.values, result.labels, result.source, result.ratings, result.remade, (*result.notes, note)
    )
