"""Likelihood-ratio tests between fits to the same values."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.special import gammaincc

from palpate.analysis.mixed_models.model import MixedModel
from palpate.analysis.statistics.f_and_t import SMALLEST, p_note
from palpate.analysis.statistics.refusals import NotComparable

COLUMNS = ["parameters", "aic", "bic", "log_likelihood", "deviance", "chi2", "df", "p", "note"]


def compare_models(smaller: MixedModel, larger: MixedModel) -> pd.DataFrame:
    """Return the likelihood-ratio test of a model against one that contains it: one row each.

    Chi squared, df and p are in the second row. Both must be fits by maximum likelihood, or by REML with equal fixed
    effects. A tested variance is on the boundary of its range, where p is too large (up to twice; the note says so).
    Raises NotComparable for other values, REML with other fixed effects, no further parameters, or a worse fit.
    """
    if not np.array_equal(np.sort(_values(smaller)), np.sort(_values(larger))):
        raise NotComparable("the two models are fits of different values; fit both to the same rows")
    if smaller.reml != larger.reml:
        raise NotComparable("one model is fitted by REML and one by maximum likelihood; fit both with reml=False")
    same = smaller.fixed["effect"].tolist() == larger.fixed["effect"].tolist()
    if smaller.reml and not same:
        raise NotComparable("REML criteria of models with different fixed effects have no common scale; use reml=False")
    if larger.parameters <= smaller.parameters:
        raise NotComparable(
            f"the first model has {smaller.parameters} parameters and the second {larger.parameters}; "
            "give the smaller model first, and one that contains it second"
        )
    df = larger.parameters - smaller.parameters
    chi2 = smaller.criterion - larger.criterion
    if chi2 < -1e-6:
        raise NotComparable(
            f"the model with more parameters fits worse (by {-chi2:.3g}), so it does not contain the other; "
            "compare a model with one that has all of its effects and more"
        )
    p = max(float(gammaincc(df / 2, max(chi2, 0.0) / 2)), SMALLEST)
    random = larger.fit.best.parameters.free > smaller.fit.best.parameters.free
    border = "a variance of zero lies on the border: p is at most this" if random else ""
    rows = [
        _row(smaller, None, None, None, ""),
        _row(larger, max(chi2, 0.0), df, p, "; ".join(filter(None, (p_note([p]), border)))),
    ]
    return pd.DataFrame(rows, columns=COLUMNS)


def _row(m: MixedModel, chi2: float | None, df: int | None, p: float | None, note: str) -> tuple[object, ...]:
    numbers = [np.nan if number is None else float(number) for number in (chi2, df, p)]
    return (m.parameters, m.aic, m.bic, m.log_likelihood, m.criterion, *numbers, note)


def _values(model: MixedModel) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.ldexp(model.fit.problem.y + model.fit.problem.y_low, model.fit.y_exponent) + model.fit.y_pivot
