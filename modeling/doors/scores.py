"""Errors of predictions (thesis 5.5.3), and shares within the JND and within the raters' spread (5.5.4)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.evaluate.intervals import JND
from palpate.modeling.evaluate.rows import ModelDataError, as_rows
from palpate.signals.arrays import Array


def mae(actual: Array, predicted: Array) -> float:
    """Return the mean absolute difference (equation 5.5)."""
    return float(np.mean(np.abs(predicted - actual)))


def rmse(actual: Array, predicted: Array) -> float:
    """Return the root mean square difference (equation 5.6)."""
    return float(np.sqrt(np.mean((predicted - actual) ** 2)))


def r2(actual: Array, predicted: Array) -> float | None:
    """Return R2 (equation 5.7): 1 - residual over total sum of squares, by column means; None if nothing varies."""
    total = float(np.sum((actual - actual.mean(axis=0)) ** 2))
    if total <= 1e-12 * actual.size:
        return None
    return 1.0 - float(np.sum((predicted - actual) ** 2)) / total


@dataclass(frozen=True)
class Share:
    """A share of predictions by attribute and over all, each with its binomial standard error."""

    share: tuple[float, ...]
    error: tuple[float, ...]
    overall: float
    overall_error: float


def share_within(predicted: Array, rated: Array, jnd: float = JND) -> Share:
    """Return the share of predictions (n, attributes) no more than `jnd` from the mean ratings, both on 0..100.

    Source: thesis 5.5.4.1. Raises ModelDataError for arrays that do not match, are empty or are not finite, or a JND
    that is not positive.
    """
    if not (math.isfinite(jnd) and jnd > 0):
        raise ModelDataError(f"the JND is {jnd:g}: a positive number on 0..100 is expected, such as {JND:g}.")
    return _share(np.abs(_difference(predicted, rated)) <= jnd)


def share_within_sd(predicted: Array, rated: Array, sd: Array | float) -> Share:
    """Return the share of predictions no more than one SD of the raters from their mean, all on 0..100.

    `sd` is (n, attributes): between the raters of each stimulus; or one number for all, as in the thesis' figures 5.12
    and 5.13. It lies on 0..100: `sd / (high - low) * 100` of the scaling. Raises ModelDataError as `share_within`, and
    for an SD that is missing or negative: one rater has none.
    """
    difference = _difference(predicted, rated)
    given = np.asarray(sd, dtype=np.float64)
    if given.ndim and given.shape != difference.shape:
        raise ModelDataError(f"SD of the raters has shape {given.shape}; {difference.shape} or one number is expected.")
    spread = np.broadcast_to(given, difference.shape)
    if not np.all(np.isfinite(spread) & (spread >= 0)):
        row = int(np.argwhere(~(np.isfinite(spread) & (spread >= 0)))[0][0])
        raise ModelDataError(
            f"SD of the raters: row {row + 1} holds {spread[row].tolist()}; 0 or more is expected. A stimulus that one "
            "person rated has no SD: give one number for all, or leave it out."
        )
    return _share(np.abs(difference) <= spread)


def _difference(predicted: Array, rated: Array) -> Array:
    if np.shape(predicted) != np.shape(rated) or np.ndim(rated) != 2 or not np.size(rated):
        raise ModelDataError(
            f"predictions have shape {np.shape(predicted)} and ratings {np.shape(rated)}: the same rows and attributes "
            "are expected, one at least."
        )
    return as_rows(predicted, np.shape(rated)[1], "predictions") - as_rows(rated, np.shape(rated)[1], "ratings")


def _share(held: NDArray[np.bool_]) -> Share:
    n, _ = held.shape
    share, overall = held.mean(axis=0), float(held.mean())
    error = np.sqrt(share * (1 - share) / n)
    return Share(tuple(share.tolist()), tuple(error.tolist()), overall, math.sqrt(overall * (1 - overall) / held.size))
