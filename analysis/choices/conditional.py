"""Choices among alternatives whose utilities are linear in some parameters: maximum likelihood by Newton's method."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from palpate.analysis.choices.existing import NoEstimate
from palpate.analysis.statistics.doubles import Floats

STEPS, HALVINGS = 100, 40
DONE = 1e-24


class Maximum(NamedTuple):
    """Where a likelihood is largest: parameters, their covariance (inverse information), log likelihood."""

    parameters: Floats
    covariance: Floats
    log_likelihood: float
    fitted: Floats


def inverse(information: Floats) -> Floats:
    """The covariance of estimates with this information."""
    return np.asarray(np.linalg.inv(information), dtype=np.float64)


def most_likely(design: Floats, counts: Floats) -> Maximum:
    """The maximum for `design` (contexts, alternatives, parameters) and `counts` (contexts, alternatives).

    The likelihood is concave, so there is one maximum; its existence is the caller's to check.
    Raises NoEstimate where Newton's method does not arrive. Source: McFadden 1974.
    """
    total = counts.sum(axis=1)
    place = np.zeros(design.shape[2])
    value, slope, bend, fitted = _around(design, counts, total, place)
    for _ in range(STEPS):
        step: Floats = np.asarray(np.linalg.solve(bend, slope), dtype=np.float64)
        gain = float(step @ slope)
        if gain <= DONE * max(1.0, abs(value)):
            return Maximum(place, inverse(bend), value, fitted)
        for halving in range(HALVINGS):
            moved = place + step * 0.5**halving
            found = _around(design, counts, total, moved)
            if found[0] >= value:
                break
        else:
            return Maximum(place, inverse(bend), value, fitted)
        if found[0] == value and gain < 1e-12:
            return Maximum(moved, inverse(found[2]), found[0], found[3])
        place, (value, slope, bend, fitted) = moved, found
    raise NoEstimate(f"the estimates still move after {STEPS} steps of Newton's method; the comparisons are too few")


def _around(design: Floats, counts: Floats, total: Floats, place: Floats) -> tuple[float, Floats, Floats, Floats]:
    """Log likelihood, its slope, its curvature (positive) and the probabilities at some parameters."""
    utility = design @ place
    log_share = utility - logsumexp(utility, axis=1, keepdims=True)
    share = np.exp(log_share)
    left = counts - total[:, None] * share
    mean = np.einsum("ca,cap->cp", share, design)
    around = design - mean[:, None, :]
    bend = np.einsum("c,ca,cap,caq->pq", total, share, around, around, optimize=True)
    return float((counts * log_share).sum()), np.einsum("ca,cap->p", left, design), bend, share
