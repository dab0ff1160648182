"""Exact p values against every arrangement, counted one by one in fractions."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import combinations, permutations, product

import numpy as np
import pytest

from palpate.analysis.ordinal.friedman import exact_tail, friedman, rank_test
from palpate.analysis.ordinal.nemenyi import nemenyi, range_tail
from palpate.analysis.ordinal.ranks import doubled_ranks, row_rounding
from palpate.analysis.ordinal.wilcoxon import rank_sum_chances, signed_rank_chances, two_sided
from tests.analysis.ordinal.r_values import long

TABLES = [
    [[1, 2, 3], [1, 3, 2], [2, 1, 3], [1, 2, 3]],
    [[1, 1, 2], [3, 1, 2], [2, 2, 5], [1, 4, 4]],
    [[4, 1, 3, 2], [4, 2, 3, 1], [3, 1, 4, 2]],
    [[5, 5, 5, 1], [1, 2, 2, 1], [4, 3, 2, 1]],
    [[1, 1, 1], [1, 2, 3], [3, 3, 1]],
]


def doubled(cells):
    rows = np.array(cells, dtype=float)
    return doubled_ranks(rows, row_rounding(rows))


def arrangements(ranks):
    return product(*(list(permutations(row)) for row in ranks.tolist()))


@pytest.mark.parametrize("cells", TABLES)
def test_friedman_over_all_orders_of_every_participant(cells):
    ranks = doubled(cells)
    n, k = ranks.shape
    result = ((ranks.sum(axis=0) - n * (k + 1)) ** 2).sum()
    values = [
        sum((sum(column) - n * (k + 1)) ** 2 for column in zip(*rows, strict=True)) for rows in arrangements(ranks)
    ]
    share = Fraction(sum(value >= result for value in values), len(values))
    assert exact_tail(ranks) == pytest.approx(float(share), rel=1e-14)


@pytest.mark.parametrize("cells", TABLES)
def test_each_pair_after_friedman_over_all_orders(cells):
    ranks = doubled(cells)
    table = nemenyi(long(cells), "y", "condition", "subject")
    sums = [tuple(map(sum, zip(*rows, strict=True))) for rows in arrangements(ranks)]
    for (i, j), p in zip(combinations(range(ranks.shape[1]), 2), table["p_exact"], strict=True):
        result = abs(int(ranks[:, i].sum() - ranks[:, j].sum()))
        share = Fraction(sum(abs(rank_sums[i] - rank_sums[j]) >= result for rank_sums in sums), len(sums))
        assert p == pytest.approx(float(share), rel=1e-14)


def test_friedman_exact_has_published_values():
    # Hollander & Wolfe 1973, table A.15 (their S): .042 at 6.5 for k = 3, n = 4 and .033 at 7.4 for k = 4, n = 3
    four = doubled([[1, 2, 3], [1, 2, 3], [1, 2, 3], [1, 3, 2]])
    assert (rank_test(four).chi2, round(exact_tail(four), 3)) == (6.5, 0.042)
    three = doubled([[1, 2, 3, 4], [1, 2, 3, 4], [2, 1, 4, 3]])
    assert (rank_test(three).chi2, round(exact_tail(three), 3)) == (pytest.approx(7.4), 0.033)


def test_exact_tails_beyond_double_sums_keep_their_digits():
    agree = doubled([[1, 2, 3]] * 60)
    assert exact_tail(agree) == pytest.approx(6.0**-59, rel=1e-12)
    assert rank_test(agree).w == 1.0
    assert "rank the conditions alike" in rank_test(agree).note


def test_too_many_arrangements_are_reported_not_guessed():
    cells = np.random.Generator(np.random.PCG64(3)).random((30, 9))
    row = friedman(long(cells), "y", "condition", "subject").iloc[0]
    assert math.isnan(row["p_exact"])
    assert "too many arrangements" in row["note"]
    assert 0 < row["p_unc"] < 1


def test_signed_ranks_over_all_signs():
    ranks = np.array([2, 5, 5, 8, 11, 11, 14, 17, 17])
    chances = signed_rank_chances(ranks)
    sums = [
        sum(r for r, sign in zip(ranks.tolist(), signs, strict=True) if sign) for signs in product((0, 1), repeat=9)
    ]
    assert chances.tolist() == (np.bincount(sums, minlength=len(chances)) / 2**9).tolist()
    assert signed_rank_chances(np.arange(1, 301))[0] == 2.0**-300


def test_rank_sums_over_all_splits():
    ranks = np.array([2, 5, 5, 8, 13, 13, 13, 13, 18])
    sums = [sum(split) for split in combinations(ranks.tolist(), 4)]
    chances = rank_sum_chances(ranks, 4)
    assert chances == pytest.approx(np.bincount(sums, minlength=len(chances)) / math.comb(9, 4), rel=1e-14)
    p = sum(abs(2 * rank_sum - 80) >= abs(2 * 60 - 80) for rank_sum in sums) / math.comb(9, 4)
    assert two_sided(chances, 60, 80) == pytest.approx(p, rel=1e-14)


def test_the_range_of_two_values_is_a_normal_difference():
    for q in (0.01, 1, 5, 20, 50):
        assert range_tail(q, 2) == pytest.approx(math.erfc(q / 2), rel=2e-13)
