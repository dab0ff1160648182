"""What a mixed model refuses, and what it says of fits on the border."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.mixed_models.comparing import compare_models
from palpate.analysis.mixed_models.model import mixed_model
from palpate.analysis.statistics.refusals import (
    BadOption,
    BadValue,
    IncompleteCells,
    NoResidual,
    NotComparable,
    NotIdentified,
    RankDeficient,
    StatisticsError,
    TooFew,
    UnknownColumn,
)


def ratings(n=10, k=4, repeats=2, seed=3):
    rng = np.random.default_rng(seed)
    p, c, _ = np.indices((n, k, repeats)).reshape(3, -1)
    y = rng.normal(0, 3, n)[p] + c + rng.normal(0, 1, len(p))
    return pd.DataFrame({"p": p, "c": [f"c{i}" for i in c], "x": c * 1.5, "g": np.where(p < n // 2, "a", "b"), "y": y})


GOOD = ratings()


@pytest.mark.parametrize(
    ("change", "options", "error", "words"),
    [
        ({}, {"fixed": ["colour"]}, UnknownColumn, "no column 'colour'"),
        ({}, {"random": {"who": []}}, UnknownColumn, "no column 'who'"),
        ({}, {"random": {}}, BadOption, "no grouping factor"),
        ({}, {"interactions": ["c:g"]}, BadOption, "needs g"),
        ({}, {"coding": "helmert"}, BadOption, "'treatment' or 'sum'"),
        ({}, {"uncorrelated": ["c"]}, UnknownColumn, "no grouping factor"),
        ({}, {"fixed": ["c", "c"]}, UnknownColumn, "twice"),
        ({}, {"fixed": ["p"]}, BadOption, "a fixed effect and a grouping factor"),
        ({"p": 1}, {}, TooFew, "grouping factor 'p' has one level, '1'"),
        ({"c": "c0"}, {}, TooFew, "factor 'c' has one level"),
        ({"x": 2.0}, {"numeric": ["x"]}, TooFew, "column 'x' has one value"),
        ({"y": 4.0}, {}, BadValue, "one value, 4, in every row"),
        ({"y": GOOD["y"].where(GOOD.index != 7)}, {}, IncompleteCells, "no value in row 8"),
        ({"y": GOOD["y"].where(GOOD.index != 7, np.inf)}, {}, BadValue, "inf in row 8"),
        ({"x": GOOD["x"].where(GOOD.index != 7)}, {"numeric": ["x"]}, BadValue, "column 'x' has no number"),
        ({"p": GOOD["p"].astype(object).where(GOOD.index != 7, None)}, {}, BadValue, "no label in row 8"),
        ({"p": range(80)}, {}, NotIdentified, "80 random effects (80 levels x 1) for 80 values"),
        ({}, {"random": {"p": ["g"]}}, NotIdentified, r"'g[b]' varies within no level of 'p'"),
        ({"s": [f"s{i}" for i in GOOD["p"]]}, {"random": {"p": [], "s": []}}, NotIdentified, "have the same groups"),
        ({}, {"random": {"p": [], "p:g": []}}, NotIdentified, "'p' and 'p:g' have the same groups"),
        (
            {"s": "s" + GOOD["c"]},
            {"random": {"p": [], "s": []}},
            NotIdentified,
            "tell the levels of grouping factor 's'",
        ),
        ({"y": GOOD["y"] * 1e200}, {}, BadValue, "'y' differ by about 1e+20"),
        ({"y": GOOD["y"] * 1e-200}, {}, BadValue, "'y' differ by about 1e-19"),
        ({"z": GOOD["x"] * 2 + 1}, {"fixed": ["c"], "numeric": ["x"]}, RankDeficient, "'x'"),
        ({"z": GOOD["x"] * 2 + 1}, {"fixed": [], "numeric": ["x", "z"]}, RankDeficient, "'z'"),
        ({"y": GOOD["p"] * 10 + GOOD["x"]}, {}, NoResidual, "leave no residual"),
        ({"y": GOOD["p"] * 0.1 + GOOD["x"] * 0.3}, {}, NoResidual, "leave no residual"),
    ],
)
def test_refused_with_a_reason(change, options, error, words):
    given = {"fixed": ["c"], "random": {"p": []}, **options}
    with pytest.raises(error) as caught:
        mixed_model(GOOD.assign(**change), "y", given.pop("fixed"), given.pop("random"), **given)
    assert words in str(caught.value)
    assert isinstance(caught.value, StatisticsError)


def test_an_empty_cell_is_refused_by_the_name_of_its_coefficient():
    table = GOOD[~((GOOD["g"] == "b") & (GOOD["c"] == "c3"))]
    with pytest.raises(RankDeficient, match=r"'c\[c3\]:g\[b\]'|'c\[c2\]:g"):
        mixed_model(table, "y", ["c", "g"], {"p": []}, interactions=["c:g"])


def test_rows_without_a_value_are_left_out_on_request_and_counted():
    table = GOOD.assign(y=GOOD["y"].where(GOOD.index % 9 != 0))
    model = mixed_model(table, "y", ["c"], {"p": []}, missing="listwise")
    whole = mixed_model(table.dropna(), "y", ["c"], {"p": []})
    assert (model.dropped, model.values) == (9, 71)
    pd.testing.assert_frame_equal(model.fixed, whole.fixed)


def test_no_variance_between_participants_is_reported_and_is_exactly_zero():
    table = GOOD.assign(y=GOOD["y"] - GOOD.groupby("p")["y"].transform("mean"))
    model = mixed_model(table, "y", ["c"], {"p": []})
    assert model.singular
    assert model.notes == ("singular fit: no variance between levels of 'p'",)
    assert model.variances["variance"][0] == 0
    # Ordinary least squares then: residual df of the fixed effects alone, F(3, 76).
    assert model.effects["ddof2"][0] == pytest.approx(76, rel=1e-6)


def test_p_is_never_zero():
    table = GOOD.assign(y=GOOD["y"] + 1e9 * (GOOD["c"] == "c3"))
    tall = pd.concat([table.assign(p=table["p"] + 10 * i) for i in range(60)])
    model = mixed_model(tall, "y", ["c"], {"p": []})
    assert (model.effects["p_unc"] > 0).all()
    assert model.effects["note"][0] == "p < 5e-324"


def test_what_a_likelihood_ratio_does_not_compare():
    small, large = (mixed_model(GOOD, "y", fixed, {"p": []}) for fixed in ([], ["c"]))
    with pytest.raises(NotComparable, match="no common scale"):
        compare_models(small, large)
    ml = mixed_model(GOOD, "y", ["c"], {"p": []}, reml=False)
    with pytest.raises(NotComparable, match="one by maximum likelihood"):
        compare_models(small, ml)
    with pytest.raises(NotComparable, match="smaller model first"):
        compare_models(ml, mixed_model(GOOD, "y", [], {"p": []}, reml=False))
    with pytest.raises(NotComparable, match="different values"):
        compare_models(mixed_model(GOOD[:60], "y", [], {"p": []}, reml=False), ml)
