"""Balanced designs have closed forms: ours is right where the spread between participants is a million residuals."""

from __future__ import annotations

import warnings
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.mixed_models.model import mixed_model


def balanced(between, residual, offset=0.0, n=12, k=4, seed=5):
    rng = np.random.default_rng(seed)
    cells = offset + between * rng.normal(size=(n, 1)) + residual * rng.normal(size=(n, k)) + residual * np.arange(k)
    person, condition = np.indices(cells.shape).reshape(2, -1)
    return pd.DataFrame({"p": person, "c": condition, "y": cells.ravel()})


def exact(table):
    """The estimators of the balanced analysis of variance in exact fractions: REML is they, where none is negative."""
    n, k = table["p"].nunique(), table["c"].nunique()
    y = [[Fraction(v) for v in row] for row in table.sort_values(["p", "c"])["y"].to_numpy().reshape(n, k).tolist()]
    rows, columns = [sum(row) / k for row in y], [sum(column) / n for column in zip(*y, strict=True)]
    mean = sum(rows) / n
    rest = sum((y[i][j] - rows[i] - columns[j] + mean) ** 2 for i in range(n) for j in range(k))
    residual = rest / ((n - 1) * (k - 1))
    person = k * sum((row - mean) ** 2 for row in rows) / (n - 1)
    return {
        "residual": float(residual),
        "between": float((person - residual) / k),
        "F": float(n * sum((column - mean) ** 2 for column in columns) / (k - 1) / residual),
        "estimate": float(columns[0]),
    }


CASES = [
    (1e6, 1.0, 0.0),
    (1.0, 1.0, 1e9),
    (1e9, 1.0, 0.0),
    (1e6, 1.0, 1e9),
    (1.0, 1e-6, 1.0),
    (1e-9, 1e-9, 0.0),
    (1e150, 1e149, 0.0),
]


@pytest.mark.parametrize(("between", "residual", "offset"), CASES)
def test_right_where_the_closed_form_is(between, residual, offset):
    table = balanced(between, residual, offset)
    r, model = exact(table), mixed_model(table, "y", ["c"], {"p": []})
    np.testing.assert_allclose(model.variances["variance"], [r["between"], r["residual"]], rtol=1e-8)
    np.testing.assert_allclose(model.effects["F"], r["F"], rtol=1e-8)
    np.testing.assert_allclose(model.effects["ddof2"], 33, rtol=1e-6)
    assert model.fixed["estimate"][0] == pytest.approx(r["estimate"], rel=1e-12)


def test_statsmodels_says_converged_and_is_wrong():
    """What this room is for: MixedLM's variances at 1e6 are not those of the closed form, and it does not say so."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from statsmodels.formula import api as formula

        table = balanced(1e6, 1.0)
        result = formula.mixedlm("y ~ C(c)", table, groups=table["p"]).fit(reml=True)
    r = exact(table)
    assert result.converged
    assert abs(result.scale / r["residual"] - 1) > 0.01 or abs(result.cov_re.iloc[0, 0] / r["between"] - 1) > 0.01


@pytest.mark.parametrize("size", [1e3, 1e6])
def test_both_of_two_crossed_factors_may_be_large(size):
    rng = np.random.default_rng(2)
    n, k = 15, 9
    cells = size * rng.normal(size=(n, 1)) + size * rng.normal(size=(1, k)) + rng.normal(size=(n, k))
    p, s = np.indices(cells.shape).reshape(2, -1)
    model = mixed_model(pd.DataFrame({"p": p, "s": s, "y": cells.ravel()}), "y", [], {"p": [], "s": []})
    centred = cells - cells.mean(0) - cells.mean(1, keepdims=True) + cells.mean()
    residual = (centred**2).sum() / ((n - 1) * (k - 1))
    rows, columns = k * cells.mean(1).var(ddof=1), n * cells.mean(0).var(ddof=1)
    right = [(rows - residual) / k, (columns - residual) / n, residual]
    np.testing.assert_allclose(model.variances["variance"], right, rtol=1e-6)


def test_a_large_crossed_design_is_fitted_right():
    """1,000 participants x 30 stimuli, complete: the closed form, in well under a second."""
    rng = np.random.default_rng(8)
    n, k = 1000, 30
    cells = 10 * rng.normal(size=(n, 1)) + 5 * rng.normal(size=(1, k)) + 7 * rng.normal(size=(n, k))
    p, s = np.indices(cells.shape).reshape(2, -1)
    model = mixed_model(pd.DataFrame({"p": p, "s": s, "y": cells.ravel()}), "y", [], {"p": [], "s": []})
    centred = cells - cells.mean(0) - cells.mean(1, keepdims=True) + cells.mean()
    residual = (centred**2).sum() / ((n - 1) * (k - 1))
    right = [(k * cells.mean(1).var(ddof=1) - residual) / k, (n * cells.mean(0).var(ddof=1) - residual) / n, residual]
    np.testing.assert_allclose(model.variances["variance"], right, rtol=1e-7)
    assert model.fit.problem.layout.blocks == n
