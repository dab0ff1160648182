"""What must not matter does not: order of rows and columns, types of labels, units, added constants, who is A."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from palpate.analysis.ordinal.aligned import aligned_ranks, aligned_table
from palpate.analysis.ordinal.friedman import friedman
from palpate.analysis.ordinal.nemenyi import nemenyi
from palpate.analysis.ordinal.wilcoxon import wilcoxon_tests
from tests.analysis.ordinal.r_values import long
from tests.examples import examples

SHAPES = st.tuples(st.integers(2, 8), st.integers(2, 5))
TENTHS = hnp.arrays(np.int64, SHAPES, elements=st.integers(-20, 20))
SEEDS = st.integers(0, 2**32 - 1)


def rank_results(table, **columns):
    names = {"within": "condition", "subject": "subject"} | columns
    return [
        friedman(table, "y", names["within"], names["subject"], draws=100),
        nemenyi(table, "y", names["within"], names["subject"]),
        wilcoxon_tests(table, "y", **names, padjust="holm"),
        wilcoxon_tests(table, "y", **names, zeros="pratt"),
    ]


def same(ours, theirs, **tolerance):
    for a, b in zip(ours, theirs, strict=True):
        pd.testing.assert_frame_equal(a, b, check_dtype=False, **({"check_exact": True} | tolerance))


@settings(max_examples=examples(12), deadline=None)
@given(TENTHS, SEEDS)
def test_order_of_rows_and_columns_changes_no_bit(cells, seed):
    table = long(cells / 10)
    same(rank_results(table.sample(frac=1, random_state=seed)[["y", "condition", "subject"]]), rank_results(table))


@settings(max_examples=examples(8), deadline=None)
@given(TENTHS)
def test_types_of_labels_change_no_bit(cells):
    result = rank_results(long(cells / 10, int))
    for table in (long(cells / 10), long(cells / 10).astype({"condition": "category", "subject": "category"})):
        for a, b in zip(result, rank_results(table), strict=True):
            labels = [name for name in ("A", "B") if name in a]
            same([a.drop(columns=labels)], [b.drop(columns=labels)])


@settings(max_examples=examples(12), deadline=None)
@given(TENTHS, st.sampled_from([0.1, 3.0, 1e-9, 1e9, 1 / 3]), st.sampled_from([0, 1, 7.7, 7.75, 1e6]))
@example(np.array([[-10, -11], [-11, -11], [-16, -17]]), 1e9, 7.7)
@example(np.array([[-8, 0, -9], [0, 0, 0], [16, 0, 17]]), 1e-9, 7.75)
def test_units_and_offsets_change_no_rank(cells, unit, offset):
    plain = rank_results(long(cells))
    moved = rank_results(long((cells + offset) * unit))
    for a, b in zip(plain, moved, strict=True):
        scaled = [name for name in ("shift", "ci_low", "ci_high") if name in a]
        same([a.drop(columns=scaled)], [b.drop(columns=scaled)])
        for name in scaled:
            room = 1e-9 * unit * (1 + offset)
            assert (a[name] * unit).tolist() == pytest.approx(b[name].tolist(), rel=1e-9, abs=room, nan_ok=True)


@settings(max_examples=examples(12), deadline=None)
@given(TENTHS)
def test_friedman_takes_any_rising_change_of_each_participants_answers(cells):
    bent = np.array([np.exp(row / 10) * (3**i) - i * 1e3 for i, row in enumerate(cells)])
    same(rank_results(long(bent))[:2], rank_results(long(cells))[:2])


@settings(max_examples=examples(12), deadline=None)
@given(TENTHS)
def test_turning_the_scale_round_turns_signs_round(cells):
    plain, turned = (rank_results(long(values)) for values in (cells, -cells))
    drawn = ["W_low", "W_high", "note"]  # participants sorted by ranks stand in another order: other draws
    same([plain[0].drop(columns=drawn)], [turned[0].drop(columns=drawn)], check_exact=False, rtol=1e-14)
    for name in ("diff", "p", "p_exact"):
        sign = -1 if name == "diff" else 1
        assert plain[1][name].tolist() == pytest.approx((sign * turned[1][name]).tolist(), rel=1e-14, nan_ok=True)
    for name, sign in (("p_unc", 1), ("rank_biserial", -1), ("z", -1), ("shift", -1)):
        assert plain[2][name].tolist() == pytest.approx((sign * turned[2][name]).tolist(), rel=1e-14, nan_ok=True)


@settings(max_examples=examples(12), deadline=None)
@given(
    hnp.arrays(
        np.int64, st.tuples(st.integers(2, 6), st.integers(2, 3), st.integers(2, 3)), elements=st.integers(0, 9)
    ),
    SEEDS,
    st.sampled_from([0.1, 1 / 3, 1e6]),
)
def test_aligned_ranks_know_no_order_and_no_unit(cells, seed, unit):
    where = np.indices(cells.shape).reshape(3, -1)
    table = pd.DataFrame({**dict(zip(("subject", "a", "b"), where, strict=True)), "y": cells.ravel()})
    names = {"within": ["a", "b"], "subject": "subject"}
    plain = aligned_ranks(table, "y", **names)
    checks = ["aligned_sum", "other_F"]
    mixed = aligned_ranks(table.sample(frac=1, random_state=seed)[["b", "y", "subject", "a"]], "y", **names)
    same([mixed], [plain])
    moved = table.assign(y=(table["y"] + 100) * unit)
    same([aligned_ranks(moved, "y", **names).drop(columns=checks)], [plain.drop(columns=checks)])
    assert (plain["aligned_sum"] < 1e-13).all()
    assert (plain["other_F"] < 1e-9).all()
    ranks = aligned_table(table, "y", **names)
    assert (ranks.filter(like="rank ").sum() == cells.size * (cells.size + 1) / 2).all()


def test_aligned_ranks_of_whole_numbers_know_no_offset_however_large():
    cells = np.random.Generator(np.random.PCG64(5)).integers(0, 9, (5, 4)).astype(float)
    plain, moved = (
        aligned_ranks(long(values), "y", within="condition", subject="subject") for values in (cells, cells + 1e15)
    )
    assert moved["F"].tolist() == plain["F"].tolist()
    assert math.isfinite(plain["F"].iloc[0])


def test_between_groups_a_and_b_may_change_places():
    rng = np.random.Generator(np.random.PCG64(8))
    table = pd.DataFrame({"g": np.repeat(["u", "v", "w"], [5, 6, 7]), "y": rng.integers(1, 8, 18)})
    turned = table.assign(g=table["g"].map({"u": "w", "v": "v", "w": "u"}))
    plain, other = (wilcoxon_tests(data, "y", between="g") for data in (table, turned))
    assert plain["p_unc"].tolist() == pytest.approx(other["p_unc"].tolist()[::-1], rel=1e-12)
    assert plain["rank_biserial"].tolist() == (-other["rank_biserial"]).tolist()[::-1]
    assert (plain["n_A"].tolist(), plain["n_B"].tolist()) == ([5, 5, 6], [6, 7, 7])
