"""Intervals around predictions that hold a nominal share of new answers, and their actual coverage.

Conformal: the half width is a quantile of the absolute residuals of stimuli that the model had not seen (Vovk,
Gammerman and Shafer 2005; Lei et al. 2018). It needs no distribution, only that new stimuli are drawn like the old.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.modeling.evaluate.rows import ModelDataError, as_rows
from palpate.signals.arrays import Array
from palpate.signals.models.card import Interval

COVERAGE = 0.9
JND = 10.0
"""The just noticeable difference that the thesis takes from similar studies, on 0..100 (5.5.4.1)."""
LEAST_SD = 0.1
"""An SD below this share of the attribute's median SD counts as that share, so that no interval becomes empty."""
ROUNDING = 1e-9
"""A rank within this distance of an integer counts as that integer, such as 10 * 0.9 = 9."""


@dataclass(frozen=True)
class Coverage:
    """The share of answers within their intervals, for stimuli that the intervals were not calibrated on.

    `share` and `error` (its binomial standard error) are by attribute; `overall` over all answers, with the binomial
    error as if they were independent, and `overall_error_by_stimulus` that of the mean over stimuli, whose attributes
    err together. `half_width` is the mean half width by attribute.
    """

    share: tuple[float, ...]
    error: tuple[float, ...]
    overall: float
    overall_error: float
    overall_error_by_stimulus: float
    half_width: tuple[float, ...]
    stimuli: int


def needed(coverage: float) -> int:
    """Return the least number of residuals for an interval of this coverage: 9 for 90 %, 19 for 95 %."""
    if not 0 < coverage < 1:
        raise ModelDataError(f"a coverage is a share between 0 and 1, such as 0.9; found {coverage:g}.")
    return max(1, math.ceil((coverage - ROUNDING) / (1 - coverage)))


def half_widths(residual: Array, coverage: float = COVERAGE) -> Array:
    """Return half widths (attributes,): the k-th smallest absolute residuals, k = ceil((n + 1) coverage).

    `residual` is (n, attributes), each from a model that had not seen the stimulus. Raises ModelDataError where n is
    too small for the coverage, or a residual is not finite.
    """
    least = needed(coverage)
    size = np.abs(_residuals(residual))
    if len(size) < least:
        raise ModelDataError(
            f"an interval that holds {coverage:.0%} needs residuals of at least {least} stimuli; there are {len(size)}."
            " Ask for a smaller coverage, or rate more stimuli."
        )
    widths: Array = np.sort(size, axis=0)[math.ceil((len(size) + 1) * coverage - ROUNDING) - 1]
    return widths


def scaled_half_widths(residual: Array, sd: Array, new_sd: Array, coverage: float = COVERAGE) -> Array:
    """Return half widths (m, attributes) for new answers with the model's own SD `new_sd` (m, attributes).

    Each residual is divided by the model's SD for it, `sd` (n, attributes), so that a more uncertain answer gets a
    wider interval (normalised conformal, Lei et al. 2018, section 5.2). An SD below a tenth of the calibration's median
    counts as that tenth. Raises ModelDataError as `half_widths` does, or where an SD is negative or not finite, or half
    of them are 0.
    """
    residual = _residuals(residual)
    known = _deviations(sd, residual.shape, "calibration")
    expected = _deviations(new_sd, (*np.shape(new_sd)[:1], residual.shape[1]), "new answers")
    least = LEAST_SD * np.median(known, axis=0)
    if np.any(least <= 0):
        raise ModelDataError("half of the calibration's SDs or more are 0: no interval can be scaled by them.")
    factor = half_widths(residual / np.maximum(known, least), coverage)
    widths: Array = factor * np.maximum(expected, least)
    return widths


def nested_coverage(
    residual: Array, fold: Sequence[int], coverage: float = COVERAGE, sd: Array | None = None
) -> Coverage:
    """Return the coverage of each fold's answers by intervals that are calibrated on the residuals of all other folds.

    `residual` (n, attributes) and `fold` (n,) come from one cross-validation, `sd` from the same models for intervals
    scaled by it. Raises ModelDataError as `half_widths`, or for a single fold.
    """
    residual, folds = _residuals(residual), np.asarray(fold)
    if folds.shape != (len(residual),) or len(np.unique(folds)) < 2:
        raise ModelDataError(f"{len(residual)} residuals need a fold each, of two folds at least; found {folds.shape}.")
    width = np.empty_like(residual)
    for one in np.unique(folds):
        own = folds == one
        if sd is None:
            width[own] = half_widths(residual[~own], coverage)
        else:
            width[own] = scaled_half_widths(residual[~own], sd[~own], sd[own], coverage)
    held = np.abs(residual) <= width
    n, attributes = held.shape
    share, by_stimulus = held.mean(axis=0), held.mean(axis=1)
    overall = float(held.mean())
    return Coverage(
        share=tuple(share.tolist()),
        error=tuple(np.sqrt(share * (1 - share) / n).tolist()),
        overall=overall,
        overall_error=math.sqrt(overall * (1 - overall) / (n * attributes)),
        overall_error_by_stimulus=float(by_stimulus.std(ddof=1)) / math.sqrt(n),
        half_width=tuple(width.mean(axis=0).tolist()),
        stimuli=n,
    )


def interval(residual: Array, coverage: float = COVERAGE, splitting: str = "grouped folds") -> Interval:
    """Return the interval for a model's card."""
    method = f"conformal, from out-of-fold residuals of {len(residual)} stimuli ({splitting})"
    return Interval(method=method, coverage=coverage, half_width=tuple(half_widths(residual, coverage).tolist()))


def _residuals(residual: Array) -> Array:
    if np.ndim(residual) != 2:
        raise ModelDataError(
            f"residuals: (stimuli, attributes) is expected, found an array of shape {np.shape(residual)}."
        )
    return as_rows(residual, np.shape(residual)[1], "residuals")


def _deviations(sd: Array, shape: tuple[int, ...], what: str) -> Array:
    if np.shape(sd) != shape:
        raise ModelDataError(f"SD of the {what} has shape {np.shape(sd)}; {shape} is expected, as the residuals have.")
    result = as_rows(sd, shape[1], f"SD of the {what}")
    if np.any(result < 0):
        raise ModelDataError(f"SD of the {what}: {result.min():g} was found; an SD is 0 or more.")
    return result
