"""Classical (metric) multidimensional scaling."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.linalg import eigh

from palpate.analysis.spaces.dissimilarities import Dissimilarities
from palpate.analysis.spaces.matrices import frame_of, in_units, principal
from palpate.analysis.statistics.doubles import Floats, scaled
from palpate.analysis.statistics.refusals import BadOption, shown

EQUAL = 1e-8


@dataclass(frozen=True)
class Classical:
    """The result: `points` (objects x `Dim1`, ...), every eigenvalue in descending order, and two measures of fit.

    `fit_absolute` is the sum of the kept eigenvalues over the sum of all sizes, `fit_positive` over the sum of the
    positive ones; they are equal for distances in a Euclidean space.
    """

    points: pd.DataFrame
    eigenvalues: tuple[float, ...]
    fit_absolute: float
    fit_positive: float
    notes: tuple[str, ...] = ()


def classical_mds(between: Dissimilarities, dimensions: int = 2) -> Classical:
    """Return a map by Torgerson's scaling: the best inner products in few dimensions, rotated to principal axes.

    Raises BadOption for more dimensions than the distances have (positive eigenvalues).
    Sources: Torgerson 1952; Gower 1966; measures of fit: Mardia 1978.
    """
    check_dimensions(dimensions, len(between.labels))
    points, values, exponent = torgerson(between.values)
    positive = points.shape[1]
    if dimensions > positive:
        raise BadOption(f"dimensions={dimensions}, but the dissimilarities span {positive}; ask for at most {positive}")
    unit = float(np.ldexp(1.0, exponent))
    represented = float(values[:dimensions].sum())
    names = [f"Dim{i + 1}" for i in range(dimensions)]
    notes = []
    negative = -values[values < 0]
    if len(negative):
        share = float(negative.sum() / np.abs(values).sum())
        notes.append(
            f"{len(negative)} of {len(values)} eigenvalues are negative ({share:.2g} of their total size): "
            "the dissimilarities are not distances in a Euclidean space"
        )
    if dimensions < len(values) and values[dimensions - 1] - values[dimensions] <= EQUAL * values[0]:
        notes.append(f"eigenvalues {dimensions} and {dimensions + 1} are equal: the last dimension is one of many")
    inner = np.flatnonzero(np.diff(values[:dimensions]) >= -EQUAL * values[0]).tolist()
    notes += [f"Dim{i + 1} and Dim{i + 2} are equally large: their directions are one choice of many" for i in inner]
    return Classical(
        frame_of(principal(points[:, :dimensions]) * unit, between.labels, names),
        tuple(in_units(values, exponent).tolist()),
        represented / float(np.abs(values).sum()),
        represented / float(values[values > 0].sum()),
        (*between.notes, *notes),
    )


def torgerson(between: Floats) -> tuple[Floats, Floats, int]:
    """Return the points in every positive dimension, all eigenvalues, and the power of two that divides the points."""
    small, exponent = scaled(between)
    square = small * small
    rows = square - square.mean(axis=0)
    inner = -0.5 * (rows - rows.mean(axis=1, keepdims=True))
    # NumPy's divide and conquer waits for its threads: on a busy machine 35 ms for 90 objects, where this takes 4.
    values, vectors = eigh((inner + inner.T) / 2, driver="ev", check_finite=False)
    values, vectors = values[::-1], vectors[:, ::-1]
    tolerance = len(values) * np.finfo(float).eps * 4 * np.abs(values).max()
    values = np.where(np.abs(values) <= tolerance, 0.0, values)
    positive = int((values > 0).sum())
    return vectors[:, :positive] * np.sqrt(values[:positive]), values, exponent


def check_dimensions(dimensions: int, objects: int) -> None:
    """Refuse a number of dimensions that is not a whole number from 1 to objects - 1."""
    if isinstance(dimensions, bool) or not isinstance(dimensions, int) or not 1 <= dimensions < objects:
        raise BadOption(f"dimensions={shown(dimensions)}: expected a whole number from 1 to {objects - 1}")
