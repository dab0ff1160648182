"""What must not change a fit, and what it must equal."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.analysis.mixed_models.blups import random_effects
from palpate.analysis.mixed_models.model import mixed_model
from palpate.analysis.statistics.anova import rm_anova
from tests.analysis.mixed_models.reference_for_tests import model_options, ours, table
from tests.examples import examples

CROSSED = table("crossed").iloc[:200]
OPTIONS = {"fixed": ["texture", "group"], "random": {"participant": [], "stimulus": []}}
COLUMNS = ["estimate", "se", "df", "t", "p"]


def numbers(model):
    return np.concatenate(
        [model.fixed[COLUMNS].to_numpy().ravel(), model.variances["variance"], [model.log_likelihood]]
    )


BASE = numbers(mixed_model(CROSSED, "y", **OPTIONS))


@settings(max_examples=examples(6), deadline=None)
@given(st.permutations(range(len(CROSSED))), st.permutations(list(CROSSED.columns)))
def test_order_of_rows_and_columns_changes_nothing(rows, columns):
    shuffled = CROSSED.iloc[rows][columns]
    np.testing.assert_array_equal(numbers(mixed_model(shuffled, "y", **OPTIONS)), BASE)


@pytest.mark.parametrize("kind", ["category", "object", "string", "integers"])
def test_the_type_of_labels_changes_nothing(kind):
    texts = ["participant", "stimulus", "texture", "group"]
    if kind == "integers":
        numbered = {name: CROSSED[name].str[1:].astype(int) for name in ("participant", "stimulus")}
        changed = CROSSED.assign(**numbered)
    else:
        changed = CROSSED.astype(dict.fromkeys(texts, kind))
    np.testing.assert_array_equal(numbers(mixed_model(changed, "y", **OPTIONS)), BASE)


def test_the_outcomes_unit_and_origin_change_what_they_should():
    shifted = CROSSED.assign(y=1e9 - 4096 * (CROSSED["y"] * 64).round() / 64)
    base = mixed_model(CROSSED.assign(y=(CROSSED["y"] * 64).round() / 64), "y", **OPTIONS)
    model = mixed_model(shifted, "y", **OPTIONS)
    np.testing.assert_allclose(model.fixed["estimate"][1:], -4096 * base.fixed["estimate"][1:], rtol=1e-8)
    np.testing.assert_allclose(model.variances["variance"], 4096.0**2 * base.variances["variance"], rtol=1e-7)
    np.testing.assert_allclose(model.effects[["F", "ddof2"]], base.effects[["F", "ddof2"]], rtol=1e-6)


def test_a_covariates_unit_and_origin_change_no_test_of_it():
    base, moved = ours("sloped"), table("sloped").copy()
    moved["speed"] = 2.0**40 + moved["speed"] * 8
    model = mixed_model(moved, "y", **{**model_options("sloped"), "reml": True})
    np.testing.assert_allclose(model.effects[["F", "ddof2", "p_unc"]], base.effects[["F", "ddof2", "p_unc"]], rtol=1e-5)
    np.testing.assert_allclose(model.variances["variance"][1] * 64, base.variances["variance"][1], rtol=1e-5)
    assert model.fixed["estimate"][1] * 8 == pytest.approx(base.fixed["estimate"][1], rel=1e-7)


def test_coding_changes_coefficients_but_no_test_and_no_variance():
    one, other = (mixed_model(CROSSED, "y", **OPTIONS, coding=coding) for coding in ("treatment", "sum"))
    pd.testing.assert_frame_equal(one.effects, other.effects)
    np.testing.assert_allclose(one.variances["variance"], other.variances["variance"], rtol=1e-12)
    # The means of cells: intercept alone at the reference, or intercept plus both effects in sum coding.
    treated, summed = (dict(zip(m.fixed["effect"], m.fixed["estimate"], strict=True)) for m in (one, other))
    cell = summed["(Intercept)"] + summed["texture[coarse]"] + summed["group[expert]"]
    assert treated["(Intercept)"] == pytest.approx(cell, rel=1e-12)


def test_levels_set_the_reference():
    order = {"texture": ["medium", "fine", "coarse", "never met"]}
    model = mixed_model(CROSSED, "y", **OPTIONS, levels=order)
    assert model.fixed["effect"].tolist() == ["(Intercept)", "texture[fine]", "texture[coarse]", "group[novice]"]


def test_on_complete_data_a_random_intercept_gives_the_anova():
    rng = np.random.default_rng(4)
    person, a = np.indices((14, 5)).reshape(2, -1)
    data = pd.DataFrame({"s": person, "a": a, "y": rng.normal(0, 4, 14)[person] + a + rng.normal(0, 2, 70)})
    model, anova = mixed_model(data, "y", ["a"], {"s": []}), rm_anova(data, "y", "a", "s")
    row = model.effects.iloc[0]
    assert (row["F"], row["ddof1"], row["ddof2"]) == pytest.approx((anova["F"][0], 4, 52), rel=1e-6)
    assert row["p_unc"] == pytest.approx(anova["p_unc"][0], rel=1e-5)


def test_level_effects_add_up_to_what_the_model_predicts():
    """Shrinkage in the balanced one-way design: n v / (n v + s) of the deviation of a participant's mean."""
    rng = np.random.default_rng(11)
    cells = rng.normal(0, 3, (9, 1)) + rng.normal(0, 2, (9, 6))
    person = np.indices(cells.shape)[0].ravel()
    model = mixed_model(pd.DataFrame({"p": person, "y": cells.ravel()}), "y", [], {"p": []})
    between, residual = model.variances["variance"]
    share = 6 * between / (6 * between + residual)
    np.testing.assert_allclose(random_effects(model)["value"], share * (cells.mean(1) - cells.mean()), rtol=1e-9)
