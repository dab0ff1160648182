"""Choices as an analysis plan asks for them: plain rows, reasons for what is undefined, mistakes refused by name."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pydantic import ValidationError
from scipy.special import ndtr

from palpate.analysis.choices.bradley_terry import bradley_terry
from palpate.analysis.plans import kinds
from palpate.analysis.plans.answers import Answer, Selected
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.statistics.refusals import StatisticsError
from tests.analysis.choices.choices_for_tests import baseball, with_ties
from tests.analysis.choices.test_staircase import run


def answer(test: str, table: pd.DataFrame, **settings: Any) -> Answer:
    kind, before = kinds.TESTS[test], table.copy()
    given = Selected(table, pd.DataFrame(), (), {}, seed=3, draws=99)
    result = kind.answer(given, kind.settings.model_validate({"name": "x", "test": test, "table": "t", **settings}))
    pd.testing.assert_frame_equal(before, table)
    for row in (*result.rows, *(row for rows in result.more.values() for row in rows)):
        for name, value in row.items():
            assert value is None or type(value) in (float, int, str, bool), (name, value)
            assert not isinstance(value, float) or math.isfinite(value), (name, value)
    return result


def observers(people: int = 3) -> pd.DataFrame:
    rng = np.random.default_rng(2)
    levels = np.linspace(2, 10, 9)
    rows = [
        {"participant": f"P{i}", "level": level, "correct": int(rng.binomial(40, ndtr((level - 5 - i) / 1.5))), "n": 40}
        for i in range(people)
        for level in levels
    ]
    return pd.DataFrame(rows)


def test_worths_of_a_plans_own_table_of_texts() -> None:
    result = answer("bradley_terry", baseball().astype(str), count="count", first="home", reference="Baltimore")
    values = bradley_terry(baseball(), "winner", "loser", None, "home", "count", "Baltimore").values
    assert [row["value"] for row in result.rows] == values["value"].tolist()
    assert result.values == 273
    assert result.more["effects"][0]["effect"] == "position"
    assert len(result.more["differences"]) == 21
    assert result.headline.startswith("Most to least: Milwaukee")
    assert {"fit", "covariance", "pairs", "triads"} <= set(result.more)


def test_a_column_of_participants_is_found_by_its_name_and_consistency_reported_for_each() -> None:
    cycle = [("P1", "a", "b"), ("P1", "b", "c"), ("P1", "c", "a")]
    order = [("P2", "a", "b"), ("P2", "b", "c"), ("P2", "a", "c")]
    table = pd.DataFrame([*cycle, *order], columns=["participant", "winner", "loser"])
    for test in ("bradley_terry", "thurstone"):
        result = answer(test, table, confidence=0.9)
        assert result.participants == 2
        assert [(row["who"], row["circular"]) for row in result.more["triads"][1:]] == [("P1", 1), ("P2", 0)]
        assert result.kinds["ci_low"] == "90 % Student's t interval of the value, over 2 people"


def test_ties_and_refusals() -> None:
    assert {
        row["effect"] for row in answer("bradley_terry", with_ties(), tie="tie", count="count").more["effects"]
    } == {"tie"}
    with pytest.raises(DataRefused, match="did you mean 'winner'"):
        answer("bradley_terry", with_ties(), winner="winer")
    with pytest.raises(DataRefused, match="must hold numbers; found 'x'"):
        answer("thurstone", baseball().assign(count="x"), count="count")
    with pytest.raises(StatisticsError, match="never lost"):
        answer("thurstone", pd.DataFrame({"winner": ["a"], "loser": ["b"]}))


def test_the_probit_scale_and_the_classical_one() -> None:
    many = baseball().assign(count=baseball()["count"] + 1)
    likely = answer("thurstone", many, count="count")
    classical = answer("thurstone", many, count="count", method="least_squares")
    assert [r["value"] for r in likely.rows] == pytest.approx([r["value"] for r in classical.rows], abs=0.1)
    assert classical.rows[0]["se"] is None
    assert any("standard errors" in note for note in classical.notes)


def test_a_function_for_each_participant_and_their_mean() -> None:
    result = answer("psychometric", observers().astype(str), n="n", function="gaussian", task="symmetric", lapse=0.0)
    assert [row["participant"] for row in result.rows] == ["P0", "P1", "P2"]
    assert [row["threshold"] for row in result.rows] == pytest.approx([5, 6, 7], abs=0.5)
    for row in result.rows:
        assert row["threshold_low"] < row["threshold"] < row["threshold_high"]
        assert row["p_deviance"] > 0
    (mean, _) = result.more["summary"]
    assert (mean["quantity"], mean["n"], mean["without_estimate"]) == ("threshold", 3, 0)
    assert mean["ci_low"] < mean["mean"] < mean["ci_high"]
    assert len(result.more["levels"]) == 27
    assert result.values == 3 * 9 * 40
    assert f"Mean threshold {mean['mean']:.3g} (95% interval {mean['ci_low']:.3g} to" in result.headline
    assert "JND" in result.headline


@pytest.mark.parametrize("interval", ["profile", "bootstrap", "posterior", "none"])
def test_other_intervals(interval: str) -> None:
    result = answer("psychometric", observers(1), n="n", task="symmetric", interval=interval)
    (row,) = result.rows
    assert row["threshold"] == pytest.approx(5, abs=0.5)
    assert (row["threshold_low"] is None) == (interval == "none")
    assert result.more["summary"][0]["note"] == "one value: no spread"


def test_the_answer_says_what_the_task_made_of_the_rates_and_an_older_plan_is_read_with_a_note() -> None:
    result = answer("psychometric", observers(1), n="n", task="symmetric")
    assert "symmetric task, equal lapse rates on both sides" in result.method
    assert "Bartlett" in result.method
    assert result.rows[0]["guess"] == result.rows[0]["lapse"]
    assert not result.notes
    older = answer("psychometric", observers(1), n="n")
    plain = answer("psychometric", observers(1), n="n", guess=0, lapse=[0, 0.06], interval="profile")
    assert older.rows == plain.rows
    assert "guess rate fixed at 0, lapse rate estimated between 0 and 0.06" in older.method
    assert "declares no task" in older.notes[0]
    for wrong in ({"task": "forced_choice"}, {"task": "symmetric", "guess": 0.1}, {"alternatives": 2}):
        with pytest.raises(ValidationError, match="alternatives|no effect"):
            answer("psychometric", observers(1), n="n", **wrong)


def test_a_participant_without_an_estimate_keeps_the_row_and_the_reason() -> None:
    table = observers(2)
    table.loc[table["participant"] == "P1", "correct"] = 40
    result = answer("psychometric", table, n="n", task="symmetric")
    assert result.rows[1]["threshold"] is None
    assert "every answer was a hit" in result.rows[1]["note"]
    assert result.more["summary"][0]["without_estimate"] == 1
    assert "1 of 2 functions have no estimate" in result.notes[0]
    assert "n = 1 of 2" in result.headline
    with pytest.raises(StatisticsError, match="no threshold could be estimated"):
        answer("psychometric", table.assign(correct=40), n="n", task="symmetric")


def test_staircases_give_reversals_and_a_fit() -> None:
    rng = np.random.default_rng(4)
    table = pd.concat(
        [run(rng, 2, 1, 150).assign(participant=who, stair=stair) for who in ("P1", "P2") for stair in (1, 2)]
    ).reset_index(drop=True)
    settings = {
        "method": "staircase",
        "order": "trial",
        "staircase": ["stair"],
        "task": "forced_choice",
        "alternatives": 2,
        "last": 20,
    }
    result = answer("psychometric", table, **settings)
    assert [row["rule"] for row in result.rows] == ["2 down, 1 up"] * 2
    assert result.rows[0]["converges_at"] == pytest.approx(0.5**0.5)
    assert result.rows[0]["share_at"] == pytest.approx(0.5 + (0.5 - result.rows[0]["lapse"]) * 0.5)
    assert result.rows[0]["reversals_used"] == 40
    assert result.rows[0]["reversal_threshold"] == pytest.approx(result.rows[1]["reversal_threshold"], abs=1.5)
    assert {row["participant"] for row in result.more["reversals"]} == {"P1", "P2"}
    assert answer("psychometric", table.sample(frac=1, random_state=1), **settings).rows == result.rows


def test_means_are_over_participants_within_each_condition() -> None:
    table = pd.concat(
        [observers().assign(side="left"), observers().assign(side="right", level=observers()["level"] + 3)]
    )
    result = answer("psychometric", table, n="n", by=["participant", "side"], task="symmetric", interval="none")
    means = {(row["side"], row["quantity"]): row for row in result.more["summary"]}
    assert set(means) == {(side, name) for side in ("left", "right") for name in ("threshold", "jnd")}
    assert means["left", "threshold"]["n"] == 3
    assert means["right", "threshold"]["mean"] == pytest.approx(means["left", "threshold"]["mean"] + 3, abs=0.01)
    assert "side left: threshold" in result.headline
    alone = answer("psychometric", observers(), n="n", by=["participant"], task="symmetric", interval="none")
    assert alone.more["summary"][0]["mean"] == pytest.approx(means["left", "threshold"]["mean"], rel=1e-12)
