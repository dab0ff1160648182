"""What a plan's anova, pairs and equivalence answer: the right call, the study's order of levels, refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pydantic import ValidationError

from palpate.analysis import anova, pairwise_tests, rm_anova
from palpate.analysis.plans.answers import Answer, Selected
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.statistics.mixed_anova import mixed_anova
from tests.analysis.statistics.variance_for_tests import UNEQUAL, design

ORDER = {"A": ("a2", "a0", "a1"), "B": ("b0", "b1"), "g": ("v", "u"), "h": ("f", "m")}


def rows_of(table: pd.DataFrame) -> pd.DataFrame:
    return table.rename(columns={"subject": "participant", "y": "value"}).assign(
        attribute="Damped", stimulus=table["A"]
    )


def ask(table: pd.DataFrame, test: str, **settings: Any) -> Answer:
    kind = TESTS[test]
    request = kind.settings.model_validate({"name": "q", "test": test, **settings})
    rows = rows_of(table)
    return kind.answer(Selected(rows, rows[["participant"]], ("Damped",), ORDER), request)


def plain(answer: Answer) -> None:
    for row in (*answer.rows, *(row for table in answer.more.values() for row in table)):
        for name, value in row.items():
            assert value is None or type(value) in (float, int, str, bool), name
            assert not isinstance(value, float) or math.isfinite(value), name
            assert value is not None or row["note"], name
            assert value != 0 or name != "p"
    assert set(answer.kinds) <= set(answer.rows[0])


def test_within_between_and_mixed() -> None:
    table = design(UNEQUAL)
    cases: list[tuple[dict[str, Any], pd.DataFrame]] = [
        ({"within": ["A", "B"]}, rm_anova(table, "y", ["A", "B"], "subject")),
        ({"within": ["A"]}, rm_anova(table, "y", "A", "subject", aggregate="mean")),
        ({"between": ["g"]}, anova(table, "y", "g", subject="subject", aggregate="mean")),
        (
            {"between": ["g", "h"]},
            mixed_anova(table, "y", between=["g", "h"], subject="subject", aggregate="mean"),
        ),
        (
            {"within": ["A"], "between": ["g", "h"], "sum_of_squares": "II"},
            mixed_anova(
                *(table, "y"),
                within="A",
                between=["g", "h"],
                subject="subject",
                sum_of_squares="II",
                aggregate="mean",
            ),
        ),
    ]
    for settings, expected in cases:
        result = ask(table, "anova", **settings)
        plain(result)
        assert [row["effect"] for row in result.rows] == expected["Source"].tolist()
        assert [row["F"] for row in result.rows] == expected["F"].tolist()
        assert result.participants == 16
        assert result.headline.count("F(") == len(expected)
        assert ("sphericity" in result.more) is ("within" in settings)
    assert "type II" in ask(table, "anova", **cases[-1][0]).method


def test_p_is_corrected_where_there_is_something_to_correct() -> None:
    table = design(UNEQUAL).assign(y=lambda t: t["y"] + 3 * (t["A"] == "a1"))
    result = {row["effect"]: row for row in ask(table, "anova", within=["A"], between=["g"]).rows}
    assert result["g"]["correction"] == "none"
    assert result["A"]["p"] == result["A"]["p_greenhouse_geisser"] != result["A"]["p_uncorrected"]
    limits = [result["A"][f"generalized_eta_squared{end}"] for end in ("_low", "", "_high")]
    assert limits == sorted(limits)
    few = design({("u", "f"): 2, ("v", "f"): 2}, k=(5, 1))
    row = ask(few, "anova", within=["A"], between=["g"], correction="HF").rows[1]
    assert (row["correction"], row["p"]) == ("GG", row["p_greenhouse_geisser"])
    assert "Huynh-Feldt is undefined" in str(row["note"])


def test_pairs_are_in_the_order_of_the_study() -> None:
    table = design(UNEQUAL)
    result = ask(table, "pairs", factor="A", correction="bonferroni", family=12)
    plain(result)
    assert [(row["a"], row["b"]) for row in result.rows] == [("a2", "a0"), ("a2", "a1"), ("a0", "a1")]
    theirs = pairwise_tests(
        table, "y", within="A", subject="subject", aggregate="mean", padjust="bonf", family=12, effect_interval=0.95
    ).set_index(["A", "B"])
    turned, row = theirs.loc[("a0", "a2")], result.rows[0]
    assert (row["t"], row["mean_difference"], row["p"]) == (-turned["T"], -turned["mean_diff"], turned["p_corr"])
    assert (row["ci95_low"], row["cohens_dz_high"]) == (-turned["ci_high"], -turned["dz_low"])
    assert (row["family"], "family of 12" in result.headline) == (12, True)
    assert "values are means" in " ".join(result.notes) or "averaged first" in " ".join(result.notes)


def test_pairs_of_a_factor_that_is_constant_within_participants() -> None:
    result = ask(design(UNEQUAL), "pairs", factor="g")
    plain(result)
    (row,) = result.rows
    assert (row["a"], row["b"]) == ("v", "u")
    assert row["hedges_g_low"] < row["hedges_g"] < row["hedges_g_high"]


@pytest.mark.parametrize("factor", ["A", "g"])
def test_equivalence_takes_its_bounds_in_the_order_of_the_study(factor: str) -> None:
    table = design({("u", "f"): 9, ("v", "f"): 9})
    shifted = table.assign(y=table["y"] + 6.0 * (table["A"] == "a2") + 30.0 * (table["g"] == "v"))
    low, high = (3, 9) if factor == "A" else (20, 40)
    result = ask(shifted, "equivalence", factor=factor, bounds=[low, high])
    plain(result)
    row = result.rows[0]
    assert (row["a"], row["bound_low"], row["bound_high"]) == (ORDER[factor][0], low, high)
    assert row["mean_difference"] > 0
    assert row["equivalent"] is (low < row["interval_low"] and row["interval_high"] < high)
    assert row["p"] == max(row["p_low"], row["p_high"])
    mirrored = ask(shifted, "equivalence", factor=factor, bounds=[-high, -low]).rows[0]
    assert mirrored["p"] > 0.5
    plain(ask(shifted, "equivalence", factor=factor, bounds_dz=0.5))


def test_undefined_numbers_are_none_with_a_reason() -> None:
    flat = design(UNEQUAL).assign(y=0.3)
    for test, settings in (
        ("anova", {"within": ["A"], "between": ["g"]}),
        ("pairs", {"factor": "A"}),
        ("equivalence", {"factor": "A", "bounds": [-1, 1]}),
    ):
        result = ask(flat, test, **settings)
        plain(result)
        assert all(row["p"] is None for row in result.rows)


def test_what_is_refused() -> None:
    table = design(UNEQUAL)
    with pytest.raises(ValueError, match="no column 'groop'"):
        ask(table, "anova", between=["groop"])
    with pytest.raises(ValueError, match="family=2 is smaller than the 3 pairs"):
        ask(table, "pairs", factor="A", family=2)
    with pytest.raises(ValueError, match="missing in all"):
        ask(table[~((table["subject"] == "uf0") & (table["A"] == "a1"))], "anova", within=["A"])
    for test, settings in (
        ("anova", {}),
        ("anova", {"within": ["A"], "between": ["A"]}),
        ("equivalence", {"factor": "A"}),
        ("equivalence", {"factor": "A", "bounds": [2, 1]}),
    ):
        with pytest.raises(ValidationError):
            ask(table, test, **settings)


def test_the_order_of_rows_changes_nothing() -> None:
    table = design(UNEQUAL)
    mixed = table.sample(frac=1, random_state=3)
    for test, settings in (
        ("anova", {"within": ["A"], "between": ["g", "h"]}),
        ("pairs", {"factor": "A"}),
        ("equivalence", {"factor": "A", "bounds_dz": 0.4}),
    ):
        assert ask(table, test, **settings) == ask(mixed, test, **settings)


def test_a_levels_table_may_hold_numbers() -> None:
    table = design(UNEQUAL).assign(A=lambda t: t["A"].str[1:].astype(int))
    result = ask(table, "pairs", factor="A")
    assert [(row["a"], row["b"]) for row in result.rows] == [("0", "1"), ("0", "2"), ("1", "2")]
    assert np.isfinite([row["t"] for row in result.rows]).all()
