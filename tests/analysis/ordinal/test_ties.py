"""What was written is exact, what was computed carries rounding: one rule for ties everywhere."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from benchmarks.statistics.ordinal_truth import FRIEDMAN, SIGNED, exact_friedman, exact_signed_p
from palpate.analysis.ordinal.friedman import friedman
from palpate.analysis.ordinal.likert import likert
from palpate.analysis.ordinal.ordinal_model import ordinal_model
from palpate.analysis.ordinal.ranks import doubled_ranks, rounding, row_rounding
from palpate.analysis.ordinal.wilcoxon import rank_sums, signed_ranks
from tests.analysis.ordinal.r_values import long

BLURRED = "0.1 + 0.2 against 0.3, 12 x 3"


def ranks(*values):
    row = np.array([values], dtype=float)
    return doubled_ranks(row, row_rounding(row))[0].tolist()


def test_a_sum_of_tenths_ties_with_the_tenth():
    assert ranks(0.1 + 0.2, 0.3, 0.4) == [3, 3, 6]
    assert ranks(1 / 3 + 1 / 3, 2 / 3, 1 - 1 / 3) == [4, 4, 4]
    assert ranks(0.3 - 0.1 - 0.2, 0.0, 0.3) == [3, 3, 6]  # -2.8e-17: rounding of a sum of tenths


def test_what_was_written_apart_stays_apart_however_close():
    assert ranks(1e-20, 2e-20, 1.0) == [2, 4, 6]
    assert ranks(2**52 + 1, 2**52 + 2, 2**52 + 2) == [2, 5, 5]
    assert ranks(1e9 + 0.25, 1e9 + 0.5) == [2, 4]
    assert ranks(0.123456789012345, 0.123456789012346) == [2, 4]


def test_one_participant_does_not_blur_another():
    cells = np.array([[1e12, 2e12, 3e12], [1e-6, 2e-6, 3e-6]])
    assert doubled_ranks(cells, row_rounding(cells)).tolist() == [[2, 4, 6], [2, 4, 6]]


def test_sign_reversal_reverses_ranks_exactly():
    rng = np.random.Generator(np.random.PCG64(1))
    rows = rng.integers(-3, 4, (50, 9)) * 0.1
    forward, back = doubled_ranks(rows, row_rounding(rows)), doubled_ranks(-rows, row_rounding(rows))
    assert (forward + back == 2 * 10).all()


def test_friedman_on_blurred_decimals_is_friedman_on_what_was_written():
    cells = FRIEDMAN[BLURRED]
    result = friedman(long(cells), "y", "condition", "subject").iloc[0]
    clean = friedman(long(np.round(cells, 9)), "y", "condition", "subject").iloc[0]
    assert result.equals(clean)
    assert result["chi2"] == pytest.approx(exact_friedman(cells)["chi2"], rel=1e-15)
    assert result["tied"] == 12


def test_libraries_break_there():
    import pingouin
    from scipy import stats as scipy_stats

    cells = FRIEDMAN[BLURRED]
    theirs = [
        scipy_stats.friedmanchisquare(*cells.T).statistic,
        pingouin.friedman(long(cells), dv="y", within="condition", subject="subject")["Q"].iloc[0],
    ]
    assert theirs == pytest.approx([14.0, 14.0])
    assert exact_friedman(cells)["chi2"] == pytest.approx(32 / 3)


@pytest.mark.parametrize("name", SIGNED)
def test_signed_ranks_of_decimals_are_exact(name):
    a, b = SIGNED[name]
    result = signed_ranks(a, b)
    assert result.p_exact == pytest.approx(exact_signed_p(a, b), rel=1e-15)
    assert result.zeros == int(np.isclose(a, b, rtol=1e-12).sum())


def test_rank_sums_models_and_items_take_the_same_rule():
    a, b = np.array([0.1 + 0.2, 0.7]), np.array([0.3, 0.5])
    assert rank_sums(a, b).statistic == rank_sums(np.array([0.3, 0.7]), b).statistic == 2.5
    assert doubled_ranks(a[None], rounding(a)[None]).tolist() == [[2, 4]]
    table = pd.DataFrame({"g": list("aabbaabb"), "y": [0.1, 0.3, 0.2, 0.1 + 0.2, 0.3, 0.1, 0.2, 0.3]})
    assert ordinal_model(table, "y", fixed="g").levels == ("0.1", "0.2", "0.3")
    counts = likert(table, "y", "g", [0.1, 0.2, 0.3])
    assert counts["n_0.3"].tolist() == [2, 2]
