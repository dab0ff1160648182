"""Constant answers, gaps, repetitions and wrong requests: the right number, or a refusal that says why."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.ordinal.aligned import aligned_ranks
from palpate.analysis.ordinal.friedman import friedman, rank_test
from palpate.analysis.ordinal.nemenyi import nemenyi
from palpate.analysis.ordinal.ranks import doubled_ranks, row_rounding
from palpate.analysis.ordinal.resampling import Interval, w_interval
from palpate.analysis.ordinal.wilcoxon import adjust_in_family, signed_ranks, wilcoxon_tests
from palpate.analysis.statistics.refusals import (
    BadOption,
    BadValue,
    DuplicatedCells,
    IncompleteCells,
    StatisticsError,
    TooFew,
    UnknownColumn,
)
from tests.analysis.ordinal.r_values import long

CELLS = np.random.Generator(np.random.PCG64(2)).integers(1, 8, (6, 3))
CALLS = {
    "friedman": lambda table, **options: friedman(table, "y", "condition", "subject", **options),
    "nemenyi": lambda table, **options: nemenyi(table, "y", "condition", "subject", **options),
    "wilcoxon": lambda table, **o: wilcoxon_tests(table, "y", within="condition", subject="subject", **o),
    "aligned": lambda table, **o: aligned_ranks(table, "y", within="condition", subject="subject", **o),
}


@pytest.mark.parametrize("value", [0.1, 0.3, 100.0, 1e9])
def test_constant_answers_have_no_statistic_and_say_so(value):
    table = long(np.full((6, 3), value))
    row = CALLS["friedman"](table).iloc[0]
    assert all(math.isnan(row[name]) for name in ("chi2", "p_unc", "p_exact", "W", "W_low", "W_high", "F", "p_F"))
    assert "one and the same value" in row["note"]
    pairs = CALLS["nemenyi"](table)
    assert pairs[["q", "p", "p_exact", "critical"]].isna().all(axis=None)
    assert pairs["note"].str.contains("undefined").all()
    pairs = CALLS["wilcoxon"](table)
    assert pairs[["W", "z", "p_unc", "p_corr", "rank_biserial"]].isna().all(axis=None)
    assert (pairs["shift"] == 0).all()
    assert pairs["note"].str.contains("every difference is zero").all()
    row = CALLS["aligned"](table).iloc[0]
    assert math.isnan(row["F"])
    assert row["note"]
    groups = wilcoxon_tests(table, "y", between="condition")
    assert groups["W"].isna().all()
    assert groups["note"].str.contains("all values are the same").all()


def test_two_participants_have_a_w_and_no_interval():
    row = CALLS["friedman"](long(CELLS[:2] + np.arange(3))).iloc[0]
    assert row["W"] >= 0
    assert math.isnan(row["W_low"])
    assert math.isnan(row["W_high"])
    assert "two participants are one pair" in row["note"]


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_every_test_refuses_what_it_cannot_answer(call):
    table = long(CELLS)
    for broken, error in (
        (table.iloc[1:], IncompleteCells),
        (pd.concat([table, table.iloc[:1]]), DuplicatedCells),
        (table.assign(y=table["y"].where(table.index > 0, np.nan)), IncompleteCells),
        (table.assign(y=table["y"].where(table.index > 0, np.inf)), BadValue),
        (table.assign(y=table["y"] * 1e308 / 7), BadValue),
        (table[table["subject"] == "0"], TooFew),
        (table[table["condition"] == "0"], TooFew),
        (table.drop(columns="condition"), UnknownColumn),
        (table.assign(condition=[1, "1", None] * 6), BadValue),
        (table.iloc[:0], BadValue),
    ):
        with pytest.raises(error) as caught:
            call(broken)
        assert isinstance(caught.value, StatisticsError)
    result = call(table.iloc[1:], missing="listwise")
    assert result.attrs["dropped"] == ["0"]
    twice = pd.concat([table, table])
    pd.testing.assert_frame_equal(call(twice, aggregate="mean"), call(table))


@pytest.mark.parametrize("label", ["None", "nan", "NA", "1"])
def test_labels_that_read_like_nothing_are_labels(label):
    table = long(CELLS).replace({"condition": {"1": label}})
    assert CALLS["friedman"](table)["k"].iloc[0] == 3
    assert label in CALLS["wilcoxon"](table)[["A", "B"]].to_numpy()


def test_a_level_that_only_some_participants_felt_is_a_gap():
    table = pd.concat([long(CELLS), pd.DataFrame({"subject": ["0"], "condition": ["3"], "y": [1.0]})])
    for call in CALLS.values():
        with pytest.raises(IncompleteCells, match="condition='3'"):
            call(table)


@pytest.mark.parametrize(
    ("call", "options", "words"),
    [
        ("friedman", {"draws": 10}, "draws=10"),
        ("friedman", {"confidence": 95}, "confidence=95"),
        ("friedman", {"missing": "drop"}, "missing"),
        ("nemenyi", {"alpha": 1.5}, "alpha=1.5"),
        ("wilcoxon", {"padjust": "tukey"}, "padjust='tukey'"),
        ("wilcoxon", {"zeros": "split"}, "zeros='split'"),
        ("wilcoxon", {"family": 2}, "family=2"),
        ("wilcoxon", {"family": True}, "family=True"),
        ("aligned", {"sum_of_squares": "I"}, "sum_of_squares"),
    ],
)
def test_unknown_options_are_refused(call, options, words):
    with pytest.raises(BadOption, match=words):
        CALLS[call](long(CELLS), **options)


def test_one_factor_is_requested_one_way():
    table = long(CELLS)
    for options in ({}, {"within": "condition", "between": "subject", "subject": "subject"}, {"within": "condition"}):
        with pytest.raises(BadOption):
            wilcoxon_tests(table, "y", **options)
    with pytest.raises(BadOption, match="2 factors"):
        friedman(table.assign(other="a"), "y", ["condition", "other"], "subject")


def test_a_family_fixed_beforehand_keeps_its_size():
    assert adjust_in_family([0.01, 0.04], "bonf", 6) == [0.06, 0.24]
    assert adjust_in_family([0.01, 0.04], "holm", 6) == pytest.approx([0.06, 0.20])
    assert adjust_in_family([0.01, math.nan], "holm", None)[0] == 0.02
    result = CALLS["wilcoxon"](long(CELLS), padjust="bonferroni", family=10)
    assert result["p_corr"].tolist() == pytest.approx([min(1, 10 * p) for p in result["p_unc"]])
    assert (result["family"] == 10).all()


def test_p_is_never_zero_and_far_tails_keep_digits():
    sure = long(np.arange(3) + 100.0 * np.arange(400)[:, None])
    row = CALLS["friedman"](sure).iloc[0]
    assert 0 < row["p_unc"] < 1e-170
    assert row["W"] == row["W_low"] == row["W_high"] == 1.0
    assert math.isnan(row["F"])
    pairs = CALLS["wilcoxon"](sure)
    assert (pairs["p_unc"] > 0).all()
    assert pairs["note"].str.contains("too many values").all()
    assert (CALLS["nemenyi"](sure)["p_exact"] > 0).all()


def test_few_pairs_have_no_interval_and_say_so():
    result = signed_ranks(np.array([1.0, 2.0, 4.0]), np.array([0.5, 0.25, 0.125]))
    assert result.p_exact == 0.25
    assert math.isnan(result.shift.low)
    assert "too few values" in result.note
    assert result.shift.estimate == 1.96875  # (1.75 + 2.1875) / 2, the middle of six means of pairs


def test_more_conditions_than_participants_and_two_of_each():
    cells = np.random.Generator(np.random.PCG64(5)).integers(0, 101, (5, 40))
    row = CALLS["friedman"](long(cells)).iloc[0]
    assert row["ddof1"] == 39
    assert 0 <= row["W"] <= 1
    smallest = CALLS["friedman"](long([[1, 2], [2, 3]])).iloc[0]
    assert (smallest["chi2"], smallest["p_exact"]) == (2.0, 0.5)
    assert len(CALLS["nemenyi"](long(cells))) == 780


def test_the_interval_of_w_comes_from_its_seed_alone():
    table = long(np.random.Generator(np.random.PCG64(9)).normal(size=(15, 4)) + np.arange(4))
    one, again, other = (CALLS["friedman"](table, seed=seed).iloc[0] for seed in (1, 1, 2))
    assert (one["W_low"], one["W_high"]) == (again["W_low"], again["W_high"])
    assert (one["W_low"], one["W_high"]) != (other["W_low"], other["W_high"])
    assert one["W_low"] <= one["W"] <= one["W_high"]


def test_the_interval_of_w_holds_what_it_estimates():
    """100 tables of 12 participants, against the W expected for 12 of very many."""
    rng = np.random.Generator(np.random.PCG64(10))

    def ranks_of(n):
        cells = rng.normal(size=(n, 4)) + 0.75 * np.arange(4)
        return doubled_ranks(cells, row_rounding(cells))

    agreement = rank_test(ranks_of(20_000)).w  # of many participants: the mean agreement of two
    expected = (1 + 11 * agreement) / 12
    bounds = [w_interval(ranks_of(12), Interval(300, 1, 0.95))[:2] for _ in range(100)]
    assert 86 <= sum(low <= expected <= high for low, high in bounds) <= 100
