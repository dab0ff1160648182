"""The ordinal model of a long table: thresholds, slopes, tests of every term and of proportional odds."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.special import chdtrc, ndtr, ndtri

from palpate.analysis.ordinal.fitting import Fitted, fit, limit
from palpate.analysis.ordinal.links import LINKS, Link
from palpate.analysis.ordinal.ordinal_data import OrdinalData, ordinal_data
from palpate.analysis.ordinal.predictors import Asked, Coding, Orders, Term
from palpate.analysis.ordinal.refusals import NotConverged
from palpate.analysis.ordinal.resampling import check_interval
from palpate.analysis.statistics.pvalues import SMALLEST
from palpate.analysis.statistics.refusals import BadOption, refuse_idle, refuse_idle_levels, shown

NO_SPREAD = "the participants' standard deviation is 0: answers of one participant are no more alike than others"


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
    `interactions` products "a:b". The answers in `dv` are numbers, or labels whose order `levels` gives; `orders`
    gives factors' levels in an order of one's own. Without `random` every row counts as independent.
    Raises a StatisticsError (a ValueError): Separated where an estimate would be infinite, NotConverged where the
    likelihood has no maximum, and what is wrong with the table or the request.
    Sources: McCullagh 1980; Christensen 2018 (R's ordinal: clm, clmm).
    """
    check_interval(100, confidence)
    asked = _asked(fixed, numeric, interactions, coding)
    if not asked.fixed:
        refuse_idle("coding", coding, "treatment", "without a factor in `fixed`")
    refuse_idle_levels(orders or {}, asked.fixed, "orders")
    if link not in LINKS:
        raise BadOption(f"link={shown(link)} is unknown: 'logit' or 'probit'")
    given = ordinal_data(data, dv, asked, random, levels, orders or {})
    return _model(given, fit(given, given.terms, link), link, confidence)


def _model(given: OrdinalData, found: Fitted, link: Link, confidence: float) -> OrdinalModel:
    return OrdinalModel(
        coefficients(given, found, confidence),
        pd.DataFrame(list(term_tests(given, found, link))),
        pd.DataFrame([_proportional(given, term, found, link) for term in given.terms]),
        found.log_likelihood,
        2 * found.parameters - 2 * found.log_likelihood,
        int(given.weights.sum()),
        given.people,
        found.sigma,
        found.sigma_error,
        link,
        given.names,
        NO_SPREAD if found.sigma == 0 else "",
    )


def _asked(fixed: Any, numeric: Any, interactions: Any, coding: Any) -> Asked:
    lists = [(names,) if isinstance(names, str) else tuple(names) for names in (fixed, numeric, interactions)]
    if not all(isinstance(name, str) for names in lists for name in names):
        raise BadOption("predictors are named by text; rename the columns")
    if coding not in ("treatment", "sum"):
        raise BadOption(f"coding={shown(coding)} is unknown: 'treatment' or 'sum'")
    return Asked(lists[0], lists[1], lists[2], coding)


def coefficients(given: OrdinalData, found: Fitted, confidence: float) -> pd.DataFrame:
    """Thresholds and slopes with their Wald statistics."""
    names = [f"{low}|{high}" for low, high in zip(given.names, given.names[1:], strict=False)]
    slopes = [name for term in given.terms for name in term.columns]
    errors = np.sqrt(np.diag(found.covariance))
    z = found.estimates / errors
    half = float(ndtri((1 + confidence) / 2)) * errors
    return pd.DataFrame(
        {
            "kind": ["threshold"] * len(names) + ["slope"] * len(slopes),
            "term": names + slopes,
            "estimate": found.estimates,
            "se": errors,
            "z": z,
            "p": np.clip(2 * ndtr(-np.abs(z)), SMALLEST, 1.0),
            "ci_low": found.estimates - half,
            "ci_high": found.estimates + half,
        }
    )


def term_tests(given: OrdinalData, found: Fitted, link: Link) -> Iterator[dict[str, Any]]:
    """Likelihood ratio tests of every term, type II, and of the random intercept."""
    for term in given.terms:
        others = [other for other in given.terms if not term.parts <= other.parts]
        larger = found
        if len(others) < len(given.terms) - 1:
            larger = fit(given, [*others, term], link)
        smaller = fit(given, others, link)
        yield _ratio(term.name, larger.log_likelihood, smaller.log_likelihood, len(term.columns), "")
    if given.people is not None:
        plain = fit(_pooled(given), given.terms, link)
        row = _ratio("random intercept", found.log_likelihood, plain.log_likelihood, 1, NO_SPREAD * (found.sigma == 0))
        yield row | {"p_unc": row["p_unc"] / 2 if row["LR"] > 0 else 1.0}


def _pooled(given: OrdinalData) -> OrdinalData:
    """The same answers, participants forgotten."""
    return OrdinalData(given.answers, given.names, given.terms, given.weights, given.starts, None)


def _proportional(given: OrdinalData, term: Term, found: Fitted, link: Link) -> dict[str, Any]:
    """One slope of this term for all thresholds against one at each."""
    df = len(term.columns) * (given.points - 2)
    try:
        reached, note = limit(given, given.terms, term, link)
    except NotConverged as reason:
        return _ratio(term.name, math.nan, found.log_likelihood, df, f"undefined: {reason}")
    return _ratio(term.name, reached, found.log_likelihood, df, note)


def _ratio(source: str, larger: float, smaller: float, df: int, note: str) -> dict[str, Any]:
    ratio = math.nan if math.isnan(larger) else max(0.0, 2 * (larger - smaller))
    p = math.nan if math.isnan(ratio) else max(float(chdtrc(df, ratio)), SMALLEST)
    return {"Source": source, "ddof": df, "LR": ratio, "p_unc": p, "note": note}
