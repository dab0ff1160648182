"""Reliability as an analysis plan asks for it: plain rows, reasons for what is undefined, mistakes refused by name."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.plans import kinds
from palpate.analysis.plans.answers import Answer, Selected
from palpate.analysis.plans.families import reliability as asking
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.reliability.intraclass import iccs
from palpate.analysis.statistics.refusals import IncompleteCells

OWN = list(asking.KINDS)


def selected(meetings: int = 2, scale: tuple[float, float] | None = (0.0, 100.0)) -> Selected:
    """6 participants rate 5 stimuli twice on 3 attributes."""
    rng = np.random.default_rng(11)
    rows = []
    for person in range(6):
        for trial in range(5 * meetings):
            stimulus = trial % 5
            for place, attribute in enumerate(("rough", "hard", "sticky")):
                value = 15 * stimulus + 5 * place + rng.integers(0, 20)
                where = {"participant": f"P{person}", "session": f"s/P{person}/1", "trial": trial + 1}
                rows.append({**where, "stimulus": f"T{stimulus}", "attribute": attribute, "value": float(value)})
    table = pd.DataFrame(rows).assign(response_time_s=4.0)
    trials = table[["participant", "session", "trial", "stimulus"]].drop_duplicates()
    return Selected(table, trials, ("rough", "hard", "sticky"), {}, draws=200, seed=5, scale=scale)


def answer(test: str, given: Selected, **settings: Any) -> Answer:
    kind = kinds.TESTS[test]
    if kind.each == "outcome":
        rows = given.table[given.table["attribute"] == "rough"].reset_index(drop=True)
        given = Selected(rows, given.trials, ("rough",), {}, draws=given.draws, seed=given.seed, scale=given.scale)
    before = given.table.copy()
    if test == "krippendorff_alpha":
        settings = {"level": "interval"} | settings
    result = kind.answer(given, kind.settings.model_validate({"name": "x", "test": test, **settings}))
    pd.testing.assert_frame_equal(before, given.table)
    return result


@pytest.mark.parametrize("test", OWN)
def test_every_answer_is_plain_values_with_words_for_them(test: str) -> None:
    result = answer(test, selected())
    tables = [result.rows, *result.more.values()]
    for row in (row for rows in tables for row in rows):
        for value in row.values():
            assert value is None or type(value) in (float, int, str, bool)
            assert not isinstance(value, float) or math.isfinite(value)
        undefined = [key for key, value in row.items() if value is None and key != "threshold"]
        assert not undefined or row["note"]
    assert result.participants == 6
    assert result.values in (60, 180)
    assert result.headline.endswith(".")
    assert "nan" not in result.headline
    assert result.method.endswith(".")


def test_icc_averages_repetitions_and_says_so() -> None:
    given = selected()
    result = answer("icc", given)
    rough = given.table[given.table["attribute"] == "rough"]
    means = rough.pivot_table(index="stimulus", columns="participant", values="value", aggfunc="mean").to_numpy()
    assert [row["ICC"] for row in result.rows] == [estimate.icc for estimate in iccs(means)]
    assert result.notes == ("Each cell is the mean of 2 values.",)
    assert result.headline.startswith("ICC(A,1) = .")
    assert answer("krippendorff_alpha", given).notes == ("Each cell is the mean of 2 values.",)
    with pytest.raises(
        DataRefused, match="several values of one participant for one stimulus: .*'ordinal' have no mean"
    ):
        answer("krippendorff_alpha", given, level="ordinal")
    assert "5 × stimulus, 6 × participant" in result.headline


def test_one_participant_is_refused_by_those_who_compare_people() -> None:
    given = selected()
    alone = Selected(given.table[given.table["participant"] == "P0"], given.trials, given.outcomes, {}, draws=200)
    for test in ("icc", "kendall_w", "krippendorff_alpha", "raters"):
        with pytest.raises(ValueError, match=r"one rater|too few raters"):
            answer(test, alone)


def test_a_column_that_is_not_there_is_refused_with_the_nearest() -> None:
    for test, key in (("icc", "targets"), ("kendall_w", "raters"), ("cronbach_alpha", "items")):
        with pytest.raises(DataRefused, match="no column 'stimulis'; did you mean 'stimulus'"):
            answer(test, selected(), **{key: "stimulis"})


def test_gaps_are_refused_left_out_or_kept_as_each_statistic_can() -> None:
    given = selected(meetings=1)
    gap = Selected(given.table.iloc[1:], given.trials, given.outcomes, {}, draws=200)
    with pytest.raises(IncompleteCells, match="attribute='rough'"):
        answer("cronbach_alpha", gap)
    assert "1 case without a value" in answer("cronbach_alpha", gap, missing="listwise").notes[0]
    with pytest.raises(IncompleteCells, match="participant='P0'"):
        answer("icc", gap)
    assert answer("krippendorff_alpha", gap).rows[0]["missing"] == 1
    assert answer("raters", gap).rows[0]["missing"] == 1


def test_the_cells_that_must_be_filled_are_named_for_the_plan() -> None:
    settings = asking.IccSpec(name="x", test="icc", targets="texture")
    assert asking.KINDS["icc"].complete is not None
    assert asking.KINDS["icc"].complete(settings) == ("texture",)


def test_a_rater_who_reverses_the_scale_has_a_flag() -> None:
    given = selected()
    turned = given.table["participant"] == "P3"
    table = given.table.assign(value=given.table["value"].where(~turned, 100 - given.table["value"]))
    result = answer("raters", Selected(table, given.trials, given.outcomes, {}, scale=(0, 100)))
    flagged = {row["participant"] for row in result.rows if row["flagged"]}
    assert flagged == {"P3"}
    assert "P3" in result.headline
    assert {row["sign"] for row in result.more["signs"]} >= {"too fast", "retest r"}
    assert answer("raters", selected(scale=None)).more["signs"] == ()


def test_groups_that_share_no_stimulus_are_compared_within_themselves() -> None:
    table = selected().table
    second = table.assign(participant="Q" + table["participant"], stimulus="Q" + table["stimulus"], group="2")
    both = pd.concat([table.assign(group="1"), second], ignore_index=True)
    result = answer("raters", Selected(both, pd.DataFrame(), ("rough",), {}))
    alone = answer("raters", Selected(table, pd.DataFrame(), ("rough",), {}))
    assert result.rows[:6] == alone.rows
    assert {row["missing"] for row in result.rows} == {0}
    assert "Each cell is the mean of 2 values." in result.notes
    assert any("within their group" in note for note in result.notes)


def test_the_seed_of_the_plan_decides_the_draws() -> None:
    one, same = (answer("krippendorff_alpha", selected()) for _ in range(2))
    assert one == same
    other = answer("krippendorff_alpha", Selected(**{**selected().__dict__, "seed": 6}))
    assert other.rows[0]["ci_low"] != one.rows[0]["ci_low"]
    assert other.rows[0]["alpha"] == one.rows[0]["alpha"]
