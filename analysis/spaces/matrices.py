"""Wide tables of numbers (objects x attributes, or objects x objects) in the order of their labels.

The orientation of a map, of which many fit equally well, is that of principal axes with a rule for their signs.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from palpate.analysis.statistics.cells import coded, numbers_of
from palpate.analysis.statistics.doubles import ROUNDING, Floats
from palpate.analysis.statistics.refusals import BadValue, DuplicatedCells, UnknownColumn, listed

NEAR = 1e-9
"""Relative difference below which sizes count as equal for a sign, so that rounding never decides it."""


@dataclass(frozen=True)
class Matrix:
    """Numbers with a label for each row and column, both in natural order."""

    values: Floats
    rows: tuple[Hashable, ...]
    columns: tuple[Hashable, ...]


def matrix_of(frame: pd.DataFrame) -> Matrix:
    """Return a wide table as numbers, sorted by its labels, independent of their order and type.

    Raises UnknownColumn for anything but a DataFrame, BadValue for a value that is not a finite number, DuplicatedCells
    for a duplicate label.
    """
    if not isinstance(frame, pd.DataFrame):
        raise UnknownColumn(f"got a {type(frame).__name__}; expected a pandas DataFrame, one row per object")
    if frame.empty:
        raise BadValue(f"the table has {frame.shape[0]} rows and {frame.shape[1]} columns; expected some of both")
    rows, row_order = _sorted_labels(frame.index, "row")
    columns, column_order = _sorted_labels(frame.columns, "column")
    values = np.column_stack([numbers_of(frame.iloc[:, i], frame.columns[i]) for i in range(frame.shape[1])])
    values = values[np.ix_(row_order, column_order)]
    gaps = [f"row {rows[i]!r}, column {columns[j]!r}" for i, j in np.argwhere(np.isnan(values))]
    if gaps:
        raise BadValue(f"no value in {listed(gaps, len(gaps))}; fill these cells or take their rows out")
    return Matrix(values, rows, columns)


def _sorted_labels(index: pd.Index[Any], what: str) -> tuple[tuple[Hashable, ...], Any]:
    labels = coded(pd.Series(index.tolist(), dtype=object), f"{what} labels")
    twice = np.flatnonzero(np.bincount(labels.codes) > 1).tolist()
    if twice:
        names = listed((repr(labels.labels[i]) for i in twice), len(twice))
        raise DuplicatedCells(f"{what} label {names} appears more than once; every {what} needs its own label")
    return tuple(labels.labels), np.argsort(labels.codes)


def pivoted(values: Floats) -> Floats:
    """Return each column minus its smallest value, so that an offset of 1e9 costs no digits afterwards."""
    result: Floats = values - np.nanmin(values, axis=0)
    return result


def varies(values: Floats) -> Any:
    """Return whether each column varies by more than the rounding of its numbers."""
    largest = np.nanmax(np.abs(values), axis=0)
    return np.nanmax(values, axis=0) - np.nanmin(values, axis=0) > 2 * ROUNDING * largest


def centred(values: Floats) -> Floats:
    """Return each column minus its mean, computed after subtraction of its smallest value."""
    small = pivoted(values)
    once = small - small.mean(axis=0)
    result: Floats = once - once.mean(axis=0)
    return result


def in_units(squares: Floats, exponent: int) -> Floats:
    """Return squares of numbers that were divided by 2**exponent, in the data's own units.

    Raises BadValue where a double cannot hold them: data beyond about 1e150 or below 1e-150.
    """
    with np.errstate(over="ignore", under="ignore"):
        result: Floats = np.ldexp(squares, 2 * exponent)
    if not np.isfinite(result).all() or np.abs(result).max() < np.finfo(float).tiny:
        raise BadValue("the squares of these numbers exceed what a double holds; give the data in another unit")
    return result


def frame_of(values: Floats, rows: tuple[Hashable, ...], columns: list[str] | tuple[Hashable, ...]) -> pd.DataFrame:
    """Return an array as a table with its labels."""
    return pd.DataFrame(values, index=pd.Index(list(rows)), columns=pd.Index(list(columns)))


def signs(columns: Floats) -> Floats:
    """Return +1 or -1 for each column, so that its largest value by size (the first of equal ones) becomes positive."""
    size = np.abs(columns)
    first = np.argmax(size >= size.max(axis=0) * (1 - NEAR), axis=0)
    chosen = columns[first, np.arange(columns.shape[1])]
    return np.where(chosen < 0, -1.0, 1.0)


def principal(points: Floats) -> Floats:
    """Return the configuration about its centroid, rotated to its principal axes, with the rule's signs."""
    about = points - points.mean(axis=0)
    _, _, directions = np.linalg.svd(about, full_matrices=False)
    turned = about @ directions.T
    result: Floats = turned * signs(turned)
    return result


def unit_size(points: Floats) -> Floats:
    """Return the configuration with a root mean square distance of 1 from its centroid."""
    size = np.sqrt((points * points).sum() / len(points))
    result: Floats = points / size
    return result
