"""What a plan's ordinal tests answer: plain values, every number's kind named, undefined ones with a reason."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from pydantic import ValidationError

from palpate.analysis.plans.answers import Selected
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.statistics.refusals import BadOption, IncompleteCells
from tests.analysis.ordinal.r_values import r_table, r_values, shipped

RANKS = ("friedman", "nemenyi", "wilcoxon")


def selected_of(table, **options):
    table = table.assign(attribute="Smooth - Rough")
    text = table.select_dtypes(exclude="number")
    levels = {name: tuple(sorted(set(table[name]))) for name in text}
    return Selected(table, table, ("Smooth - Rough",), levels, **{"draws": 200} | options)


def rounding_times():
    return selected_of(shipped("RoundingTimes").rename(columns={"subject": "participant", "y": "value"}))


def wine():
    return selected_of(r_table("wine").rename(columns={"judge": "participant", "rating": "value"}), scale=(1.0, 5.0))


def ask(test, selected, **settings):
    kind = TESTS[test]
    return kind.answer(selected, kind.settings(name="asked", test=test, **settings))


def demand_named_numbers(answer):
    """Plain values only, strict JSON, a kind for every number, a note where one is undefined."""
    for table in (answer.rows, *answer.more.values()):
        for row in table:
            json.dumps(dict(row), allow_nan=False)
            assert all(value is None or type(value) in (int, float, str, bool) for value in row.values())
            assert row.get("note") or None not in row.values(), row
            assert not [name for name in row if name.startswith("p") and row[name] == 0]
    floats = {name for row in answer.rows for name, value in row.items() if isinstance(value, float)}
    assert floats - set(answer.kinds) == {name for name in floats if name.startswith("share_")}
    assert answer.method
    return answer


def test_friedman_and_its_pairs():
    result = {test: demand_named_numbers(ask(test, rounding_times(), factor="method")) for test in RANKS}
    assert result["friedman"].rows[0]["chi2"] == pytest.approx(r_values("friedman")["RoundingTimes"]["chi2"], rel=1e-14)
    assert result["friedman"].headline.startswith("method: χ²(2) = 11.14, p = .004, Kendall's W = .25, 95% CI [")
    assert result["nemenyi"].headline == "method: 1 of 3 pairs differ at 0.05 (Nemenyi)"
    assert [row["family"] for row in result["wilcoxon"].rows] == [3, 3, 3]
    assert (result["friedman"].participants, result["friedman"].values) == (22, 66)


def test_a_factor_constant_within_participants_is_compared_by_rank_sums():
    table = shipped("sk2011.1").rename(columns={"subject": "participant", "y": "value"})
    answer = demand_named_numbers(ask("wilcoxon", selected_of(table), factor="instruction", correction="none"))
    (row,) = answer.rows
    assert (row["Paired"], row["n_A"], row["n_B"]) == (False, 20, 20)
    assert "Mann-Whitney" in answer.method
    assert answer.notes == ("Each participant's 8 ratings in a cell were averaged first.",)


def test_aligned_ranks_of_a_mixed_design():
    table = shipped("sk2011.1").rename(columns={"subject": "participant", "y": "value"})
    settings = {"within": ("inference", "plausibility"), "between": ("instruction",)}
    answer = demand_named_numbers(ask("aligned_ranks", selected_of(table), **settings))
    expected = r_values("aligned")["sk_mixed"]
    assert {row["Source"]: row["F"] for row in answer.rows} == pytest.approx(
        {source: values["F"] for source, values in expected.items()}, rel=1e-12
    )


def test_the_ordinal_model_with_its_tests():
    answer = demand_named_numbers(ask("ordinal_model", wine(), fixed=("temp", "contact"), random="participant"))
    assert [row["kind"] for row in answer.rows] == ["threshold"] * 4 + ["slope"] * 2 + ["sd"]
    assert answer.rows[-1]["estimate"] == pytest.approx(r_values("clmm")["wine_logit"]["sigma"], rel=1e-4)
    assert set(answer.more) == {"tests", "proportional", "fit"}
    assert not answer.notes
    plain = ask("ordinal_model", wine(), fixed=("temp", "contact"))
    assert plain.notes == ("Answers of one participant count as independent; `random: participant` would not.",)


def test_the_studys_first_level_is_what_others_are_compared_with():
    turned = replace(wine(), levels={"temp": ("warm", "cold"), "contact": ("no", "yes")})
    rows = {row["term"]: row["estimate"] for row in ask("ordinal_model", turned, fixed=("temp", "contact")).rows}
    assert rows["temp[cold]"] == pytest.approx(-r_values("clm")["wine_logit"]["estimate"][4], rel=1e-11)


def test_empty_answers_are_left_out_only_where_the_plan_says_so():
    table = wine().table.assign(value=lambda rows: rows["value"].where(rows.index != 3, np.nan))
    gaps = replace(wine(), table=table)
    with pytest.raises(IncompleteCells):
        ask("ordinal_model", gaps, fixed=("temp",))
    answer = ask("ordinal_model", gaps, fixed=("temp",), missing="listwise")
    assert answer.values == 71
    assert answer.notes[0] == "Left out: 1 row without an answer."
    assert TESTS["ordinal_model"].with_gaps is not None


def forms():
    rows = [
        {
            "participant": f"P{i:03}",
            "form": "likert",
            "attribute": item,
            "value": float(1 + (i * 7 + j) % 7),
            "text": "",
        }
        for i in range(16)
        for j, item in enumerate(("Correctness", "Realism"))
    ]
    rows += [{**rows[0], "attribute": "Remarks", "value": np.nan, "text": "nice"}]
    table = pd.DataFrame(rows)
    return Selected(table, table, ("Realism", "Correctness", "Remarks"), {}, scale=(1.0, 7.0))


def test_likert_items_are_in_the_order_of_the_questionnaire():
    assert (TESTS["likert"].takes, TESTS["likert"].each) == ("forms", "all")
    answer = demand_named_numbers(ask("likert", forms()))
    assert [row["item"] for row in answer.rows] == ["Realism", "Correctness"]
    assert [row["n"] for row in answer.rows] == [16, 16]
    assert answer.notes == ("Answered in words, not summarised: Remarks.",)
    halves = ask("likert", wine(), by="temp")
    assert [(row["item"], row["temp"], row["n"]) for row in halves.rows] == [
        ("Smooth - Rough", "cold", 36),
        ("Smooth - Rough", "warm", 36),
    ]


def test_constant_answers_are_answered_with_a_reason():
    flat = replace(rounding_times(), table=rounding_times().table.assign(value=5.0))
    for test in RANKS:
        answer = demand_named_numbers(ask(test, flat, factor="method"))
        assert all(row["note"] for row in answer.rows)
    assert "undefined" in ask("friedman", flat, factor="method").headline


@pytest.mark.parametrize("test", RANKS)
def test_a_wrong_name_is_answered_with_the_nearest(test):
    with pytest.raises(DataRefused, match="did you mean 'method'"):
        ask(test, rounding_times(), factor="metod")


def test_settings_that_ask_for_nothing_are_refused():
    for test in ("aligned_ranks", "ordinal_model"):
        with pytest.raises(ValidationError, match="name a"):
            TESTS[test].settings(name="x", test=test)
    with pytest.raises(BadOption, match="family=2"):
        ask("wilcoxon", rounding_times(), factor="method", family=2)
    with pytest.raises(DataRefused, match="scale is not known"):
        ask("likert", replace(forms(), scale=None))
    with pytest.raises(DataRefused, match="no form 'survy'; did you mean"):
        ask("likert", replace(forms(), table=forms().table.assign(form="survey")), form="survy")
