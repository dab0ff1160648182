"""Every number of a fit against R 4.2.2, lme4 1.1.31 and lmerTest 3.1.3 (tests/analysis/data/r/mixed_models.R)."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.analysis.mixed_models.blups import random_effects
from palpate.analysis.mixed_models.comparing import compare_models
from palpate.analysis.mixed_models.model import mixed_model
from palpate.analysis.mixed_models.profiling import profile_intervals
from palpate.analysis.statistics.references import reference_table, reference_values
from tests.analysis.mixed_models.reference_for_tests import NAMES, expected, group_of, ours, plain, table, whole

SHIPPED = {
    "lmm_sleepstudy_slope_REML": (["days"], {"subject": ["days"]}, ["days"]),
    "lmm_sleepstudy_slope_ML": (["days"], {"subject": ["days"]}, ["days"]),
    "lmm_sleepstudy_int_REML": (["days"], {"subject": []}, ["days"]),
    "lmm_ergoStool_REML": (["type"], {"subject": []}, []),
    "lmm_md15_int": (["time"], {"subject": []}, []),
}


def many(values):
    return values if isinstance(values, list) else [values]


@pytest.mark.parametrize("name", NAMES)
def test_fixed_effects(name):
    result = ours(name).fixed
    result = result.assign(effect=result["effect"].map(plain)).set_index("effect").loc[many(expected(name)["names"])]
    for column, key, rtol in (
        *(("estimate", "estimate", 1e-8), ("se", "se", 1e-8), ("t", "t", 2e-8)),
        *(("df", "df", 1e-6), ("p", "p", 2e-5)),
    ):
        np.testing.assert_allclose(result[column], many(expected(name)[key]), rtol=rtol, err_msg=column)


@pytest.mark.parametrize("name", NAMES)
def test_variances_and_correlations(name):
    model = ours(name)
    variances = {(group_of(g), plain(e)): v for g, e, v in model.variances[["group", "effect", "variance"]].to_numpy()}
    pairs = {(group_of(g), plain(a), plain(b)): r for g, a, b, _, r, _ in model.correlations.to_numpy()}
    for row in expected(name)["varcorr"]:
        group, one, other = group_of(row["grp"].removesuffix(".1")), row["var1"] or "", row["var2"]
        if other is None:
            np.testing.assert_allclose(variances[group, one], row["vcov"], rtol=1e-7, err_msg=str((group, one)))
        else:
            np.testing.assert_allclose(pairs[group, plain(one), other], row["sdcor"], rtol=1e-6)
    assert model.singular == expected(name)["singular"]


@pytest.mark.parametrize("name", NAMES)
def test_likelihood_and_criteria(name):
    model, r = ours(name), expected(name)
    result = (model.log_likelihood, model.criterion, model.aic, model.bic)
    np.testing.assert_allclose(result, [r["logLik"], r["criterion"], r["AIC"], r["BIC"]], rtol=1e-11)


@pytest.mark.parametrize("name", [name for name in NAMES if expected(name)["effects"]])
def test_effects_of_type_three(name):
    result = ours(name).effects.set_index("Source")
    assert list(expected(name)["effects"]) == list(result.index)
    for source, r in expected(name)["effects"].items():
        assert result["ddof1"][source] == r["NumDF"]
        np.testing.assert_allclose(result["F"][source], r["F"], rtol=1e-6)
        np.testing.assert_allclose(result["ddof2"][source], r["DenDF"], rtol=1e-6)
        np.testing.assert_allclose(result["p_unc"][source], r["p"], rtol=1e-4)


@pytest.mark.parametrize("name", NAMES)
def test_random_effects_of_every_level(name):
    result = random_effects(ours(name))
    keys = zip(result["group"], result["level"], result["effect"], strict=True)
    mine = {(group_of(g), group_of(level), plain(e)): v for (g, level, e), v in zip(keys, result["value"], strict=True)}
    for group, r in expected(name)["ranef"].items():
        for level, row in zip(r["levels"], r["values"], strict=True):
            for effect, value in zip(many(r["effects"]), row, strict=True):
                assert mine[group_of(group), group_of(level), effect] == pytest.approx(value, abs=1e-6, rel=1e-6)
    assert len(mine) == sum(np.size(r["values"]) for r in expected(name)["ranef"].values())


@pytest.mark.parametrize("name", NAMES)
def test_explained_variance(name):
    """Nakagawa & Schielzeth's formula on R's own parts of it."""
    r = expected(name)
    random, residual = sum(many(r["mean_variances"]["values"])), r["varcorr"][-1]["vcov"]
    total = r["fixed_variance"] + random + residual
    model = ours(name)
    assert model.marginal_r2 == pytest.approx(r["fixed_variance"] / total, rel=1e-6, abs=1e-12)
    assert model.conditional_r2 == pytest.approx((r["fixed_variance"] + random) / total, rel=1e-6)
    assert model.variances["icc"].sum() == pytest.approx(random / (random + residual), rel=1e-6)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_references(name):
    r = reference_values("r_reference")[name]
    fixed, random, numeric = SHIPPED[name]
    data = reference_table(f"csv/{r['csv']}")
    model = mixed_model(data, "y", fixed, random, numeric=numeric, reml="REML=TRUE" in r["call"])
    result = model.fixed.assign(effect=model.fixed["effect"].map(plain)).set_index("effect")
    for effect, value in r["fixef"].items():
        assert result["estimate"][effect] == pytest.approx(value, rel=1e-8)
        assert result["se"][effect] == pytest.approx(r["se"][effect], rel=1e-6)
    variances = [row["vcov"] for row in r["varcorr"] if row["var2"] is None]
    np.testing.assert_allclose(model.variances["variance"], variances, rtol=1e-6)
    assert model.log_likelihood == pytest.approx(r["logLik"], rel=1e-8)
    for source, row in r["lmerTest_satterthwaite"].items():
        mine = model.effects.set_index("Source").loc[source]
        assert mine["ddof2"] == pytest.approx(row["DenDF"], rel=2e-5)
        assert mine["F"] == pytest.approx(row["F"], rel=1e-5)


def test_likelihood_ratio():
    crossed = {"participant": [], "stimulus": []}
    null = mixed_model(table("crossed"), "y", [], crossed, reml=False)
    row = compare_models(null, ours("crossed_ml")).iloc[1]
    r = whole()["likelihood_ratio"]
    assert (row["chi2"], row["df"], row["p"]) == pytest.approx((r["chi2"], r["df"], r["p"]), rel=1e-9)


@pytest.mark.parametrize("name", ["penicillin", "crossed_ml"])
def test_profile_intervals(name):
    """R's confint(profile(m, delta = 0.1)), whose steps are close enough to interpolate between."""
    r = whole()["profile"][name]
    result = profile_intervals(ours(name))
    spread = {f"sd_{e}|{g}" if e else "sigma": (low, high) for g, e, _, low, high in result.to_numpy()}
    assert set(spread) == set(r["names"])
    for label, low, high in zip(r["names"], r["low"], r["high"], strict=True):
        assert spread[label] == pytest.approx((low, high), rel=1e-6)
