"""Fits of ordinal models to data, in coordinates where the predictors are orthonormal, so that no unit matters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.analysis.ordinal.cumulative import Fit, Rows, fitted, rows_of, start_of
from palpate.analysis.ordinal.links import Link
from palpate.analysis.ordinal.ordinal_data import OrdinalData
from palpate.analysis.ordinal.predictors import Term
from palpate.analysis.ordinal.random_intercept import fit_intercepts
from palpate.analysis.ordinal.refusals import NotConverged, Separated
from palpate.analysis.ordinal.separation import escape
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import listed

FLAT = 0.05  # information in some direction, in answers, below which the maximum may be at infinity
FIRST_SD = 1.0
NOTHING = 1e-8  # log likelihood that a random intercept must bring to be one
ORDERED = 1e-9  # a fall from one threshold to the next, on the latent scale, that rounding explains
INFINITE = "some slope of the larger model is infinite"
DISORDER = "undefined: the larger model's thresholds are out of order; some answers are too rare for a slope at each"


@dataclass(frozen=True)
class Fitted:
    """A fitted model: thresholds and slopes in the predictors' units, their covariances, and the intercepts' spread."""

    estimates: Floats
    covariance: Floats
    log_likelihood: float
    sigma: float | None
    sigma_error: float
    parameters: int
    gradient_steps: int


@dataclass(frozen=True)
class Coordinates:
    """x - centre = basis @ turn, `basis` orthonormal but for sqrt(rows)."""

    basis: Floats
    turn: Floats
    centre: Floats


def coordinates(terms: Sequence[Term], weights: Floats) -> Coordinates:
    """The predictors of these terms in orthonormal coordinates."""
    rows = len(weights)
    x = np.concatenate([np.zeros((rows, 0)), *(term.values for term in terms)], axis=1)
    centre = (weights @ x) / weights.sum()
    basis, turn = np.linalg.qr(x - centre)
    return Coordinates(basis * math.sqrt(rows), turn / math.sqrt(rows), centre)


def fit(data: OrdinalData, terms: Sequence[Term], link: Link) -> Fitted:
    """The model with these terms, with a random intercept where the data have participants.

    Raises Separated or NotConverged.
    """
    own = coordinates(terms, data.weights)
    rows = _rows(data, own.basis, own.basis[:, :0])
    plain = _plain(rows, _start(data, own.basis.shape[1], 0, link), link, _names(data, terms))
    to_units = _to_units(own, data.points - 1)
    if data.people is None:
        return _in_units(plain, to_units, None)
    mixed, sigma = fit_intercepts(rows, plain.g, FIRST_SD, link)
    if mixed.log_likelihood - plain.log_likelihood <= NOTHING:
        return _in_units(plain, to_units, 0.0)
    return _in_units(mixed, to_units, sigma)


def limit(data: OrdinalData, terms: Sequence[Term], free: Term, link: Link) -> tuple[float, str]:
    """The highest log likelihood with a slope of its own at every threshold for `free`, and a note.

    A limit is approached as some slope grows for ever, and reached by none. NaN where it has no value, or where the
    thresholds are out of order somewhere, so that some answer would have a negative chance. Raises NotConverged.
    """
    x = coordinates([term for term in terms if term is not free], data.weights).basis
    own = coordinates([free], data.weights).basis
    rows = _rows(data, x, own)
    plain = fitted(rows, _start(data, x.shape[1], own.shape[1], link), link)
    unbounded = _flat(plain) and escape(rows) is not None
    if unbounded and data.people is not None:
        return math.nan, f"undefined: {INFINITE}"
    found = plain
    if data.people is not None:
        mixed, _ = fit_intercepts(rows, plain.g, FIRST_SD, link)
        found = max(plain, mixed, key=lambda each: each.log_likelihood)
    if not _in_order(data, free, _thresholds(found.g, own, data.points - 1), unbounded):
        return math.nan, DISORDER
    return found.log_likelihood, f"{INFINITE}; its likelihood is the limit" if unbounded else ""


def _thresholds(g: Floats, free: Floats, count: int) -> Floats:
    """The thresholds of each row, moved by the slopes of `free` at each: (rows, thresholds)."""
    slopes = g[: count * (1 + free.shape[1])].reshape(count, -1)
    found: Floats = slopes[:, 0] - free @ slopes[:, 1:].T
    return found


def _in_order(data: OrdinalData, free: Term, thresholds: Floats, unbounded: bool) -> bool:
    """Whether the thresholds rise for every kind of row: all of them, or where `unbounded` those that answers tell of.

    Other predictors move all thresholds alike, so that only `free` matters.
    """
    _, rows, kind = np.unique(free.values, axis=0, return_index=True, return_inverse=True)
    for i, rises in enumerate(np.diff(thresholds[rows], axis=1)):
        answers = data.answers[kind.ravel() == i]
        told = rises[int(answers.min()) : max(int(answers.max()) - 1, 0)] if unbounded else rises
        if (told < -ORDERED).any():
            return False
    return True


def _rows(data: OrdinalData, x: Floats, free: Floats) -> Rows:
    return rows_of(data.answers, data.points, x, free, data.weights, data.starts)


def _start(data: OrdinalData, columns: int, free: int, link: Link) -> Floats:
    return start_of(data.answers, data.points, data.weights, columns, free, link)


def _plain(rows: Rows, start: Floats, link: Link, names: list[str]) -> Fit:
    try:
        found = fitted(rows, start, link)
    except NotConverged:
        _refuse_separated(rows, names)
        raise
    if _flat(found):
        _refuse_separated(rows, names)
    return found


def _flat(found: Fit) -> bool:
    return float(np.linalg.eigvalsh(found.information)[0]) < FLAT


def _refuse_separated(rows: Rows, names: list[str]) -> None:
    if escape(rows) is not None:
        raise Separated(
            f"the predictors {listed(names, len(names))} divide the answers without overlap, so an estimate would be "
            "infinite; join answers or levels, or leave a predictor out"
        )


def _names(data: OrdinalData, terms: Sequence[Term]) -> list[str]:
    return [term.name for term in terms] or [f"answers {', '.join(data.names)}"]


def _to_units(own: Coordinates, thresholds: int) -> Floats:
    """The matrix from thresholds and slopes in `own` to those in the predictors' units."""
    back = np.linalg.inv(own.turn)
    size = thresholds + len(back)
    matrix = np.eye(size)
    matrix[:thresholds, thresholds:] = own.centre @ back
    matrix[thresholds:, thresholds:] = back
    return matrix


def _in_units(found: Fit, to_units: Floats, sigma: float | None) -> Fitted:
    size = len(to_units)
    covariance = np.linalg.inv(found.information)
    estimates: Floats = to_units @ found.g[:size]
    spread: Floats = to_units @ covariance[:size, :size] @ to_units.T
    mixed = len(found.g) > size
    error = math.sqrt(float(covariance[-1, -1])) if mixed else math.nan
    count = size if sigma is None else size + 1
    return Fitted(estimates, spread, found.log_likelihood, sigma, error, count, found.steps)
