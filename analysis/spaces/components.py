"""Principal components of a table of objects by attributes."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.spaces.matrices import Matrix, centred, frame_of, in_units, matrix_of, varies
from palpate.analysis.spaces.orienting import signs
from palpate.analysis.statistics.doubles import Floats, rescaled, scaled
from palpate.analysis.statistics.refusals import BadOption, BadValue, TooFew, listed, shown

Kind: TypeAlias = Literal["covariance", "correlation"]
EQUAL = 1e-8


@dataclass(frozen=True)
class Components:
    """Principal components in descending order, as many as the table has dimensions (`PC1`, `PC2`, ...).

    `scores` (objects x components) are in units of the data (covariance) or of standard deviations (correlation),
    `directions` (attributes x components) are unit vectors, `loadings` are the correlations of the attributes with the
    components (NaN for a constant attribute), `variances` divide by n - 1, `shares` are of the total.
    """

    scores: pd.DataFrame
    directions: pd.DataFrame
    loadings: pd.DataFrame
    variances: tuple[float, ...]
    shares: tuple[float, ...]
    kind: Kind
    notes: tuple[str, ...] = ()


def pca(table: pd.DataFrame, kind: Kind = "covariance") -> Components:
    """Principal components of a wide table (one row per object, one column per attribute), by SVD of centred data.

    Of each component the direction's largest coefficient is positive (of equal ones the first in label order): this
    makes the result unique wherever the variances differ; a note says where they do not.
    Raises BadOption, BadValue (no variation; a constant attribute under "correlation"), TooFew, UnknownColumn.
    Source: Jolliffe 2002, 2nd ed., 3.5 and 2.3.
    """
    matrix = matrix_of(table)
    small, exponent = prepared(matrix, kind)
    left, size, right = np.linalg.svd(small, full_matrices=False)
    rank = int((size > size[0] * max(small.shape) * np.finfo(float).eps).sum())
    turn = signs(right[:rank].T)
    directions = right[:rank].T * turn
    scores = left[:, :rank] * size[:rank] * turn
    names = [f"PC{i + 1}" for i in range(rank)]
    spread = np.sqrt((small * small).sum(axis=0))
    variances = size[:rank] ** 2 / (len(small) - 1)
    unit = rescaled(1.0, exponent)
    return Components(
        frame_of(scores * unit, matrix.rows, names),
        frame_of(directions, matrix.columns, names),
        frame_of(_correlations(directions * size[:rank], spread), matrix.columns, names),
        tuple(in_units(variances, exponent).tolist()),
        tuple((size[:rank] ** 2 / (size * size).sum()).tolist()),
        kind,
        tuple(_equal_variances(variances)),
    )


def prepared(matrix: Matrix, kind: Kind) -> tuple[Floats, int]:
    """Centred columns over a power of two (and its exponent), of unit variance under "correlation"."""
    if not isinstance(kind, str) or kind not in ("covariance", "correlation"):
        raise BadOption(f"kind={shown(kind)} is unknown: 'covariance' or 'correlation'")
    rows, columns = matrix.values.shape
    if rows < 2 or columns < 2:
        raise TooFew(f"{rows} objects and {columns} attributes; components need two or more of both")
    varied = varies(matrix.values)
    _refuse_constant(varied, matrix.columns, kind)
    about = centred(matrix.values) * varied
    if kind == "covariance":
        return scaled(about)
    small = about / np.abs(about).max(axis=0)
    return small / np.sqrt((small * small).sum(axis=0) / (rows - 1)), 0


def _refuse_constant(varied: Floats, names: tuple[Hashable, ...], kind: Kind) -> None:
    if not varied.any():
        raise BadValue("no attribute differs between the objects: there are no components")
    constant = [repr(names[i]) for i in np.flatnonzero(~varied.astype(bool)).tolist()]
    if constant and kind == "correlation":
        raise BadValue(
            f"the same value for every object: {listed(constant, len(constant))}; a constant has no correlation; "
            "leave it out or use kind='covariance'"
        )


def _correlations(weighted: Floats, spread: Floats) -> Floats:
    with np.errstate(invalid="ignore"):
        result: Floats = weighted / np.where(spread > 0, spread, np.nan)[:, None]
    return np.clip(result, -1, 1)


def _equal_variances(variances: Floats) -> list[str]:
    gaps = variances[:-1] - variances[1:]
    return [
        f"PC{i + 1} and PC{i + 2} have equal variances: their plane is determined, their directions in it are not"
        for i in np.flatnonzero(gaps <= EQUAL * variances[:-1]).tolist()
    ]
