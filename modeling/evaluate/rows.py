"""Rows of numbers as methods and their scores take them: checked, or refused by `ModelDataError`."""

from __future__ import annotations

import numpy as np

from palpate.signals.arrays import Array


class ModelDataError(ValueError):
    """The data cannot be used to train or test a model; the message says where and why."""


def as_rows(given: Array, size: int, what: str) -> Array:
    """Return rows (n, size) as finite float64, also of one row or float16. Raises ModelDataError otherwise."""
    rows = np.atleast_2d(np.asarray(given, dtype=np.float64))
    if rows.ndim != 2 or rows.shape[1] != size or not len(rows):
        raise ModelDataError(
            f"{what}: {size} numbers a row are expected, at least one row; found an array of shape {np.shape(given)}."
        )
    if (bad := np.argwhere(~np.isfinite(rows))).size:
        row, place = bad[0]
        raise ModelDataError(f"{what}: row {row + 1} holds {rows[row, place]} at place {place + 1}.")
    return rows
