"""Cumulative link models against R's ordinal 2022.11.16, statsmodels, and integrals done one by one."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import quad
from scipy.special import expit

from benchmarks.statistics.ordinal_truth import separated_table, wine_table
from palpate.analysis.ordinal.ordinal_model import ordinal_model
from palpate.analysis.statistics.refusals import (
    BadOption,
    BadValue,
    IncompleteCells,
    NotConverged,
    Separated,
    StatisticsError,
    TooFew,
    UnknownColumn,
)
from tests.analysis.ordinal.r_values import HOUSING_ORDERS, r_table, r_values


def wine(**options):
    return ordinal_model(r_table("wine"), "rating", **{"fixed": ("temp", "contact")} | options)


def same_fit(model, expected, rel):
    assert model.coefficients["estimate"].tolist() == pytest.approx(expected["estimate"], rel=rel)
    assert model.coefficients["se"].tolist() == pytest.approx(expected["se"], rel=rel)
    assert model.log_likelihood == pytest.approx(expected["logLik"], rel=rel)
    assert model.aic == pytest.approx(expected["aic"], rel=rel)
    assert model.n == expected["n"]


def test_wine_is_clm_of_r():
    for link in ("logit", "probit"):
        same_fit(wine(link=link), r_values("clm")[f"wine_{link}"], 1e-11)
    same_fit(wine(interactions="temp:contact"), r_values("clm")["wine_interaction"], 1e-11)


@pytest.mark.parametrize("link", ["logit", "probit"])
def test_housing_is_clm_of_r(link):
    table = r_table("housing")
    model = ordinal_model(table, "Sat", fixed=("Infl", "Type", "Cont"), orders=HOUSING_ORDERS, link=link)
    same_fit(model, r_values("clm")[f"housing_{link}"], 2e-11)
    assert model.coefficients["term"].tolist()[2:4] == ["Infl[Medium]", "Infl[High]"]


def test_likelihood_ratios_are_drop1_and_nominal_test_of_r():
    table = r_table("housing")
    models = {
        "wine_logit": wine(),
        "housing_logit": ordinal_model(table, "Sat", fixed=("Infl", "Type", "Cont"), orders=HOUSING_ORDERS),
    }
    for name, model in models.items():
        for ours, theirs in ((model.tests, "drop"), (model.proportional, "nominal")):
            expected = r_values("clm")[name][theirs]
            assert ours["Source"].tolist() == expected["term"][1:]
            assert ours["ddof"].tolist() == expected["df"][1:]
            assert ours["LR"].tolist() == pytest.approx(expected["lr"][1:], rel=1e-7)
            assert ours["p_unc"].tolist() == pytest.approx(expected["p"][1:], rel=1e-7)
    # nobody called a warm wine 1: the larger model has no maximum, only a limit, and says so
    assert "infinite" in models["wine_logit"].proportional["note"].iloc[0]


@pytest.mark.parametrize("name", ["wine_logit", "wine_probit", "soup_logit"])
def test_random_intercepts_are_clmm_of_r(name):
    expected = r_values("clmm")[name]
    if name == "soup_logit":
        model = ordinal_model(r_table("soup"), "sureness", fixed="prod", random="resp")
    else:
        model = wine(random="judge", link=name.removeprefix("wine_"))
    same_fit(model, expected, 1e-4)
    assert model.sd == pytest.approx(expected["sigma"], rel=1e-4)
    assert model.log_likelihood >= expected["logLik"] - 1e-10  # R stops a little below the maximum


def test_the_marginal_likelihood_is_the_integral_over_each_participant():
    model, table = wine(random="judge"), r_table("wine")
    estimates = dict(zip(model.coefficients["term"], model.coefficients["estimate"], strict=True))
    cuts = np.array([-np.inf, *model.coefficients["estimate"].tolist()[:4], np.inf])
    shift = (table["temp"] == "warm") * estimates["temp[warm]"] + (table["contact"] == "yes") * estimates[
        "contact[yes]"
    ]

    def density(z, rows, shifts):
        at = shifts + model.sd * z
        chances = expit(cuts[rows] - at) - expit(cuts[rows - 1] - at)
        return float(np.prod(chances)) * math.exp(-z * z / 2) / math.sqrt(2 * math.pi)

    total = 0.0
    for judge in table["judge"].unique():
        own = table["judge"] == judge
        rows, shifts = table.loc[own, "rating"].to_numpy(), shift[own].to_numpy()
        total += math.log(quad(density, -12, 12, args=(rows, shifts), epsabs=0, epsrel=1e-12, limit=200)[0])
    assert model.log_likelihood == pytest.approx(total, rel=1e-12)


def test_statsmodels_agrees_where_it_converges():
    from statsmodels.miscmodels.ordinal_model import OrderedModel

    table = wine_table()
    x = pd.get_dummies(table[["temp", "contact"]], drop_first=True, dtype=float)
    theirs = OrderedModel(table["y"], x, distr="probit").fit(method="bfgs", disp=False)
    ours = ordinal_model(table, "y", fixed=("temp", "contact"), link="probit")
    assert ours.coefficients["estimate"].tolist()[-2:] == pytest.approx(theirs.params.iloc[:2].tolist(), rel=1e-4)
    assert ours.log_likelihood == pytest.approx(theirs.llf, rel=1e-9)


def test_separated_answers_are_refused_where_statsmodels_gives_a_number():
    with pytest.raises(Separated, match="'?group'? divide the answers without overlap"):
        ordinal_model(separated_table(), "y", fixed="group")
    overlap = pd.concat([separated_table(), pd.DataFrame({"group": ["a", "b"], "y": [3, 2]})])
    assert ordinal_model(overlap, "y", fixed="group").coefficients["estimate"].abs().max() < 6
    ladder = pd.DataFrame({"x": np.arange(12.0), "y": np.repeat([1, 2, 3], 4)})
    with pytest.raises(Separated):
        ordinal_model(ladder, "y", numeric="x")


def test_participants_who_never_change_their_answer_have_no_finite_spread():
    table = pd.DataFrame(
        {"who": np.repeat(np.arange(9), 6), "y": np.repeat([1, 2, 3] * 3, 6), "x": np.tile(list("ababab"), 9)}
    )
    with pytest.raises((NotConverged, Separated)):
        ordinal_model(table, "y", fixed="x", random="who")


def test_a_random_intercept_that_explains_nothing_is_zero_and_reported():
    rng = np.random.Generator(np.random.PCG64(11))
    table = pd.DataFrame({"who": np.tile(np.arange(12), 20), "x": rng.choice(["a", "b"], 240)})
    # every person gives every answer equally often, but for what x adds
    table["y"] = [1 + (place // 12 + (x == "b")) % 3 for place, x in enumerate(table["x"])]
    mixed, plain = (ordinal_model(table, "y", fixed="x", random=random) for random in ("who", None))
    assert mixed.sd == 0.0
    assert "standard deviation is 0" in mixed.note
    assert mixed.coefficients["estimate"].tolist() == pytest.approx(plain.coefficients["estimate"].tolist(), rel=1e-9)
    row = mixed.tests.iloc[-1]
    assert (row["Source"], row["LR"], row["p_unc"]) == ("random intercept", 0.0, 1.0)


def numbered():
    rng = np.random.Generator(np.random.PCG64(4))
    x, person = np.round(rng.normal(size=150) * 64) / 64, rng.normal(size=15)
    who = np.tile(np.arange(15), 10)
    y = np.digitize(0.8 * x + person[who] + rng.logistic(size=150), [-1.5, 0, 1.5])
    return pd.DataFrame({"x": x, "who": who, "g": np.where(rng.random(150) < 0.5, "k", "l"), "y": y})


@pytest.mark.parametrize("random", [None, "who"])
def test_units_and_offsets_of_a_predictor_move_its_slope_and_the_thresholds_only(random):
    table = numbered().query("who < 8", engine="python")
    plain = ordinal_model(table, "y", numeric="x", fixed="g", random=random)
    small = ordinal_model(table.assign(x=table["x"] * 1e-6), "y", numeric="x", fixed="g", random=random)
    moved = ordinal_model(table.assign(x=table["x"] + 2.0**30), "y", numeric="x", fixed="g", random=random)
    slopes = [model.coefficients.set_index("term").loc["x"] for model in (plain, small, moved)]
    assert slopes[1]["estimate"] == pytest.approx(slopes[0]["estimate"] * 1e6, rel=1e-7)
    assert slopes[2]["estimate"] == pytest.approx(slopes[0]["estimate"], rel=1e-6)
    assert [slope["z"] for slope in slopes[1:]] == pytest.approx([slopes[0]["z"]] * 2, rel=1e-6)
    assert moved.log_likelihood == pytest.approx(plain.log_likelihood, rel=1e-12)
    assert moved.tests["LR"].tolist() == pytest.approx(plain.tests["LR"].tolist(), rel=1e-6)


@pytest.mark.parametrize("random", [None, "who"])
def test_order_of_rows_types_of_labels_and_coding_change_nothing(random):
    table = numbered().query("who < 8", engine="python")
    plain = ordinal_model(table, "y", numeric="x", fixed="g", random=random)
    mixed_up = table.sample(frac=1, random_state=3)[["y", "g", "who", "x"]]
    again = ordinal_model(mixed_up.astype({"who": str, "g": "category"}), "y", numeric="x", fixed="g", random=random)
    pd.testing.assert_frame_equal(again.coefficients, plain.coefficients, rtol=1e-9)
    summed = ordinal_model(table, "y", numeric="x", fixed="g", random=random, coding="sum")
    assert summed.log_likelihood == pytest.approx(plain.log_likelihood, rel=1e-10)
    assert summed.tests["LR"].tolist() == pytest.approx(plain.tests["LR"].tolist(), rel=1e-6)
    named = table.assign(y=table["y"].map(dict(enumerate(["no", "rather", "yes", "very"]))))
    words = ordinal_model(named, "y", numeric="x", fixed="g", random=random, levels=["no", "rather", "yes", "very"])
    assert words.log_likelihood == pytest.approx(plain.log_likelihood, rel=1e-12)


@pytest.mark.parametrize(("seed", "gaps"), [(1, False), (6, False), (4, True), (8, True)])
def test_a_slope_at_every_threshold_of_one_factor_is_each_levels_own_shares_or_undefined(seed, gaps):
    """Answers say nothing about a threshold beyond a level's outermost; one within would make a chance negative."""
    rng = np.random.Generator(np.random.PCG64(seed))
    level = rng.choice(["a", "b", "c"], 80)
    answers = np.clip(np.rint(5.5 + 2.2 * rng.normal(size=80) + 11 / 6 * (level == "b")), 0, 10)
    table = pd.DataFrame({"level": level, "y": answers})
    counts = pd.crosstab(table["level"], table["y"]).to_numpy().astype(float)
    shares = counts / counts.sum(axis=1, keepdims=True)
    largest = float((counts * np.log(np.where(counts > 0, shares, 1.0))).sum())
    model = ordinal_model(table, "y", fixed="level")
    row = model.proportional.iloc[0]
    if gaps:
        assert math.isnan(row["LR"])
        assert "thresholds are out of order" in row["note"]
    else:
        assert row["LR"] == pytest.approx(2 * (largest - model.log_likelihood), rel=1e-7)
        assert row["note"] == "some slope of the larger model is infinite; its likelihood is the limit"


def test_answers_the_other_way_round_change_signs_only():
    table = numbered()
    plain, turned = (ordinal_model(data, "y", numeric="x") for data in (table, table.assign(y=3 - table["y"])))
    assert turned.coefficients["estimate"].tolist()[-1] == pytest.approx(-plain.coefficients["estimate"].tolist()[-1])
    thresholds = plain.coefficients["estimate"].tolist()[:3]
    assert turned.coefficients["estimate"].tolist()[:3] == pytest.approx(
        [-threshold for threshold in reversed(thresholds)]
    )


def test_every_row_twice_doubles_the_likelihood():
    table = numbered()
    once, twice = (ordinal_model(data, "y", numeric="x", fixed="g") for data in (table, pd.concat([table, table])))
    assert twice.log_likelihood == pytest.approx(2 * once.log_likelihood, rel=1e-13)
    assert twice.coefficients["estimate"].tolist() == pytest.approx(once.coefficients["estimate"].tolist(), rel=1e-10)
    assert twice.n == 300


@pytest.mark.parametrize(
    ("change", "options", "error", "words"),
    [
        ({"y": 1}, {}, TooFew, "1 different answer"),
        ({"y": [1, 2] * 75}, {}, TooFew, "2 different answer"),
        ({"y": np.arange(150) % 37 / 1000}, {"most": True}, None, ""),
        ({"x": 3.0}, {}, BadOption, "never varies"),
        ({"g": "k"}, {"fixed": "g"}, TooFew, "one level"),
        ({"y": [np.nan] + [1.0, 2.0, 3.0] * 49 + [1.0, 1.0]}, {}, IncompleteCells, "row 1"),
        ({"y": [np.inf] + [1.0, 2.0, 3.0] * 49 + [1.0, 1.0]}, {}, BadValue, "finite"),
        ({"x": [np.nan] + [1.0] * 149}, {}, BadValue, "no number in row 1"),
        ({}, {"numeric": ("x", "z")}, UnknownColumn, "'z'"),
        ({"x2": "double"}, {"numeric": ("x", "x2")}, BadOption, "x2"),
        ({}, {"interactions": "x:g"}, UnknownColumn, "'g'"),
        ({}, {"link": "cauchit"}, BadOption, "cauchit"),
        ({}, {"levels": [0, 1, 2]}, BadValue, "3"),
        ({"who": 1}, {"random": "who"}, TooFew, "one participant"),
        ({}, {"numeric": ()}, BadOption, "no predictor"),
    ],
)
def test_what_has_no_answer_is_refused_by_name(change, options, error, words):
    table = numbered()
    table = table.assign(
        **{name: table["x"] * 2 if value == "double" else value for name, value in change.items()}
        if "x2" in change
        else change
    )
    if error is None:
        assert ordinal_model(table, "y", numeric="x").n == 150
        return
    with pytest.raises(error, match=words) as caught:
        ordinal_model(table, "y", **{"numeric": "x"} | options)
    assert isinstance(caught.value, StatisticsError)
