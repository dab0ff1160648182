"""The ordinal model of a long table: thresholds, slopes, tests of every term and of proportional odds.

It is fitted in coordinates where the predictors are orthonormal, so that no unit matters. A model has no maximum where
the predictors separate the answers without overlap: the log likelihood never decreases along a direction that lowers no
upper bound and raises no lower one. If such a direction moves any bound, some estimate is infinite (Haberman 1980;
Albert & Anderson 1984), which a linear programme decides exactly.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import linprog
from scipy.special import chdtrc, ndtr, ndtri

from palpate.analysis.ordinal.cumulative import LINKS, AnswerIntervals, Fit, Link, fit_rows, rows_of, start_of
from palpate.analysis.ordinal.ordinal_data import Coding, Orders, OrdinalData, Predictors, Term, ordinal_data
from palpate.analysis.ordinal.random_intercept import fit_intercepts
from palpate.analysis.ordinal.resampling import check_interval
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.f_and_t import SMALLEST
from palpate.analysis.statistics.refusals import (
    BadOption,
    NotConverged,
    Separated,
    listed,
    refuse_idle,
    refuse_idle_levels,
    shown,
)

NO_SPREAD = "the participants' standard deviation is 0: answers of one participant are no more alike than others"
FLAT = 0.05  # information in some direction, in answers, below which the maximum may be at infinity
FIRST_SD = 1.0
NOTHING = 1e-8  # log likelihood that a random intercept must bring to be one
ORDERED = 1e-9  # a fall from one threshold to the next, on the latent scale, that rounding explains
INFINITE = "some slope of the larger model is infinite"
DISORDER = "undefined: the larger model's thresholds are out of order; some answers are too rare for a slope at each"
MOVED = 1e-7


@dataclass(frozen=True)
class OrdinalModel:
    """A fitted cumulative link model, P(answer <= j) = F(threshold_j - slopes'x - sd z).

    `coefficients`: kind ("threshold", "slope"), term, estimate, se, z, p, ci_low, ci_high (Wald). `tests`: the
    likelihood ratio test of each term (type II: against the model of all terms that do not contain it) and, last, of
    the random intercept (half of chi-squared with 1 df: a standard deviation is not negative). `proportional`: of
    each term, one slope for all thresholds against one at each. `sd` and `sd_error` are None and NaN without a random
    intercept. `n` counts answers, `levels` are the answers from lowest to highest.
    """

    coefficients: pd.DataFrame
    tests: pd.DataFrame
    proportional: pd.DataFrame
    log_likelihood: float
    aic: float
    n: int
    participants: int | None
    sd: float | None
    sd_error: float
    link: Link
    levels: tuple[str, ...]
    note: str = ""


def ordinal_model(
    data: pd.DataFrame,
    dv: Hashable,
    *,
    fixed: str | Sequence[str] = (),
    numeric: str | Sequence[str] = (),
    interactions: str | Sequence[str] = (),
    random: Hashable | None = None,
    link: Link = "logit",
    coding: Coding = "treatment",
    levels: Sequence[Hashable] | None = None,
    orders: Orders | None = None,
    confidence: float = 0.95,
) -> OrdinalModel:
    """Fit a cumulative link model by maximum likelihood, with `random` (the participants' column) a mixed one.

    `fixed` names factors ("treatment" coding against the first level, or "sum"), `numeric` columns of numbers,
    `interactions` products "a:b". The answers in `dv` are numbers, or labels whose order `levels` gives; `orders` gives
    the order of factors' levels. Without `random` every row counts as independent. Raises a StatisticsError (a
    ValueError): Separated where an estimate would be infinite, NotConverged where the likelihood has no maximum, and
    what is wrong with the table or the request. Sources: McCullagh 1980; Christensen 2018 (R's ordinal: clm, clmm).
    """
    check_interval(100, confidence)
    lists = [(names,) if isinstance(names, str) else tuple(names) for names in (fixed, numeric, interactions)]
    if not all(isinstance(name, str) for names in lists for name in names):
        raise BadOption("predictors are named by text; rename the columns")
    if coding not in ("treatment", "sum"):
        raise BadOption(f"coding={shown(coding)} is unknown: 'treatment' or 'sum'")
    predictors = Predictors(lists[0], lists[1], lists[2], coding)
    if not predictors.fixed:
        refuse_idle("coding", coding, "treatment", "without a factor in `fixed`")
    refuse_idle_levels(orders or {}, predictors.fixed, "orders")
    if link not in LINKS:
        raise BadOption(f"link={shown(link)} is unknown: 'logit' or 'probit'")
    answers = ordinal_data(data, dv, predictors, random, levels, orders or {})
    model = fit(answers, answers.terms, link)
    return OrdinalModel(
        coefficients(answers, model, confidence),
        pd.DataFrame(list(term_tests(answers, model, link))),
        pd.DataFrame([_proportional(answers, term, model, link) for term in answers.terms]),
        model.log_likelihood,
        2 * model.parameters - 2 * model.log_likelihood,
        int(answers.weights.sum()),
        answers.people,
        model.sigma,
        model.sigma_error,
        link,
        answers.names,
        NO_SPREAD if model.sigma == 0 else "",
    )


def coefficients(data: OrdinalData, model: Fitted, confidence: float) -> pd.DataFrame:
    """Return the thresholds and slopes with their Wald statistics."""
    names = [f"{low}|{high}" for low, high in zip(data.names, data.names[1:], strict=False)]
    slopes = [name for term in data.terms for name in term.columns]
    errors = np.sqrt(np.diag(model.covariance))
    z = model.estimates / errors
    half = float(ndtri((1 + confidence) / 2)) * errors
    return pd.DataFrame(
        {
            "kind": ["threshold"] * len(names) + ["slope"] * len(slopes),
            "term": names + slopes,
            "estimate": model.estimates,
            "se": errors,
            "z": z,
            "p": np.clip(2 * ndtr(-np.abs(z)), SMALLEST, 1.0),
            "ci_low": model.estimates - half,
            "ci_high": model.estimates + half,
        }
    )


def term_tests(data: OrdinalData, model: Fitted, link: Link) -> Iterator[dict[str, Any]]:
    """Yield likelihood ratio tests of every term, type II, and of the random intercept."""
    for term in data.terms:
        others = [other for other in data.terms if not term.parts <= other.parts]
        larger = model
        if len(others) < len(data.terms) - 1:
            larger = fit(data, [*others, term], link)
        smaller = fit(data, others, link)
        yield _ratio(term.name, larger.log_likelihood, smaller.log_likelihood, len(term.columns), "")
    if data.people is not None:
        plain = fit(
            OrdinalData(data.answers, data.names, data.terms, data.weights, data.starts, None), data.terms, link
        )
        row = _ratio("random intercept", model.log_likelihood, plain.log_likelihood, 1, NO_SPREAD * (model.sigma == 0))
        yield row | {"p_unc": row["p_unc"] / 2 if row["LR"] > 0 else 1.0}


def _proportional(data: OrdinalData, term: Term, model: Fitted, link: Link) -> dict[str, Any]:
    """Return the comparison of one slope of this term for all thresholds with one at each."""
    df = len(term.columns) * (data.points - 2)
    try:
        reached, note = limit(data, data.terms, term, link)
    except NotConverged as reason:
        return _ratio(term.name, math.nan, model.log_likelihood, df, f"undefined: {reason}")
    return _ratio(term.name, reached, model.log_likelihood, df, note)


def _ratio(source: str, larger: float, smaller: float, df: int, note: str) -> dict[str, Any]:
    ratio = math.nan if math.isnan(larger) else max(0.0, 2 * (larger - smaller))
    p = math.nan if math.isnan(ratio) else max(float(chdtrc(df, ratio)), SMALLEST)
    return {"Source": source, "ddof": df, "LR": ratio, "p_unc": p, "note": note}


@dataclass(frozen=True)
class Fitted:
    """A fitted model: thresholds and slopes in the predictors' units, their covariances, and the intercepts' SD."""

    estimates: Floats
    covariance: Floats
    log_likelihood: float
    sigma: float | None
    sigma_error: float
    parameters: int
    gradient_steps: int


@dataclass(frozen=True)
class Coordinates:
    """Coordinates of the predictors: x - centre = basis @ turn, `basis` orthonormal except for sqrt(rows)."""

    basis: Floats
    turn: Floats
    centre: Floats


def coordinates(terms: Sequence[Term], weights: Floats) -> Coordinates:
    """Return the predictors of these terms in orthonormal coordinates."""
    rows = len(weights)
    x = np.concatenate([np.zeros((rows, 0)), *(term.values for term in terms)], axis=1)
    centre = (weights @ x) / weights.sum()
    basis, turn = np.linalg.qr(x - centre)
    return Coordinates(basis * math.sqrt(rows), turn / math.sqrt(rows), centre)


def fit(data: OrdinalData, terms: Sequence[Term], link: Link) -> Fitted:
    """Fit the model with these terms, with a random intercept where the data have participants.

    Raises Separated or NotConverged.
    """
    own = coordinates(terms, data.weights)
    rows = _rows(data, own.basis, own.basis[:, :0])
    start = _start(data, own.basis.shape[1], 0, link)
    names = [term.name for term in terms] or [f"answers {', '.join(data.names)}"]
    try:
        plain = fit_rows(rows, start, link)
    except NotConverged:
        _refuse_separated(rows, names)
        raise
    if _flat(plain):
        _refuse_separated(rows, names)
    # The matrix from thresholds and slopes in `own` to those in the predictors' units.
    thresholds = data.points - 1
    back = np.linalg.inv(own.turn)
    size = thresholds + len(back)
    to_units = np.eye(size)
    to_units[:thresholds, thresholds:] = own.centre @ back
    to_units[thresholds:, thresholds:] = back
    if data.people is None:
        return _in_units(plain, to_units, None)
    mixed, sigma = fit_intercepts(rows, plain.g, FIRST_SD, link)
    if mixed.log_likelihood - plain.log_likelihood <= NOTHING:
        return _in_units(plain, to_units, 0.0)
    return _in_units(mixed, to_units, sigma)


def limit(data: OrdinalData, terms: Sequence[Term], free: Term, link: Link) -> tuple[float, str]:
    """Return the highest log likelihood with a slope at every threshold for `free`, and a note.

    It may be a limit that is only approached as some slope grows without bound. NaN where it is undefined, or where
    thresholds are out of order somewhere, so that some answer would have a negative probability. Raises NotConverged.
    """
    x = coordinates([term for term in terms if term is not free], data.weights).basis
    own = coordinates([free], data.weights).basis
    rows = _rows(data, x, own)
    plain = fit_rows(rows, _start(data, x.shape[1], own.shape[1], link), link)
    unbounded = _flat(plain) and escape(rows) is not None
    if unbounded and data.people is not None:
        return math.nan, f"undefined: {INFINITE}"
    best = plain
    if data.people is not None:
        mixed, _ = fit_intercepts(rows, plain.g, FIRST_SD, link)
        best = max(plain, mixed, key=lambda candidate: candidate.log_likelihood)
    # The thresholds of each row, moved by the slopes of `free` at each: (rows, thresholds).
    count = data.points - 1
    slopes = best.g[: count * (1 + own.shape[1])].reshape(count, -1)
    thresholds: Floats = slopes[:, 0] - own @ slopes[:, 1:].T
    if not _in_order(data, free, thresholds, unbounded):
        return math.nan, DISORDER
    return best.log_likelihood, f"{INFINITE}; its likelihood is the limit" if unbounded else ""


def _in_order(data: OrdinalData, free: Term, thresholds: Floats, unbounded: bool) -> bool:
    """Return whether the thresholds are in order for every kind of row.

    With `unbounded` only those that answers determine count. Other predictors move all thresholds equally, so that only
    `free` matters.
    """
    _, rows, kind = np.unique(free.values, axis=0, return_index=True, return_inverse=True)
    for i, rises in enumerate(np.diff(thresholds[rows], axis=1)):
        answers = data.answers[kind.ravel() == i]
        informed = rises[int(answers.min()) : max(int(answers.max()) - 1, 0)] if unbounded else rises
        if (informed < -ORDERED).any():
            return False
    return True


def _rows(data: OrdinalData, x: Floats, free: Floats) -> AnswerIntervals:
    return rows_of(data.answers, data.points, x, free, data.weights, data.starts)


def _start(data: OrdinalData, columns: int, free: int, link: Link) -> Floats:
    return start_of(data.answers, data.points, data.weights, columns, free, link)


def _flat(maximum: Fit) -> bool:
    return float(np.linalg.eigvalsh(maximum.information)[0]) < FLAT


def _refuse_separated(rows: AnswerIntervals, names: list[str]) -> None:
    if escape(rows) is not None:
        raise Separated(
            f"the predictors {listed(names, len(names))} divide the answers without overlap, so an estimate would be "
            "infinite; join answers or levels, or leave a predictor out"
        )


def _in_units(maximum: Fit, to_units: Floats, sigma: float | None) -> Fitted:
    size = len(to_units)
    covariance = np.linalg.inv(maximum.information)
    estimates: Floats = to_units @ maximum.g[:size]
    spread: Floats = to_units @ covariance[:size, :size] @ to_units.T
    mixed = len(maximum.g) > size
    error = math.sqrt(float(covariance[-1, -1])) if mixed else math.nan
    count = size if sigma is None else size + 1
    return Fitted(estimates, spread, maximum.log_likelihood, sigma, error, count, maximum.steps)


def escape(rows: AnswerIntervals) -> Floats | None:
    """Return a direction along which the likelihood grows without bound, each part at most 1; None if there is none."""
    bounds = np.concatenate((rows.upper[~rows.last], -rows.lower[~rows.first]))
    bounds = np.unique(bounds, axis=0)
    programme = linprog(-bounds.sum(axis=0), A_ub=-bounds, b_ub=np.zeros(len(bounds)), bounds=(-1, 1), method="highs")
    if programme.x is None or float((bounds @ programme.x).max()) <= MOVED:
        return None
    direction: Floats = programme.x
    return direction
