"""Cochran's Q against statsmodels and pingouin, its exact p by counting, and as a plan asks for it."""

from itertools import permutations, product

import numpy as np
import pandas as pd
import pytest
from statsmodels.stats.contingency_tables import cochrans_q

from palpate.analysis.ordinal.friedman import NO_DIFFERENCE, cochran_q
from palpate.analysis.plans.answers import Selected
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.statistics.refusals import StatisticsError


def long(cells, **columns):
    cells = np.asarray(cells)
    n, k = cells.shape
    table = pd.DataFrame({
        "person": np.repeat([f"P{i:02}" for i in range(n)], k), "method": np.tile([f"m{j}" for j in range(k)], n),
        "y": cells.ravel().astype(float),
    })  # fmt: skip
    return table.assign(**columns)


def q_of(cells):
    """The textbook's formula (Cochran 1950, equation 2)."""
    cells = np.asarray(cells)
    k, columns, rows = cells.shape[1], cells.sum(axis=0), cells.sum(axis=1)
    return (k - 1) * (k * (columns**2).sum() - columns.sum() ** 2) / (k * rows.sum() - (rows**2).sum())


@pytest.mark.parametrize(("seed", "shape"), [(1, (12, 3)), (2, (40, 5)), (3, (7, 2)), (4, (200, 4))])
def test_it_is_that_of_statsmodels_and_pingouin(seed, shape):
    from pingouin import cochran

    cells = (np.random.Generator(np.random.PCG64(seed)).random(shape) < np.linspace(0.3, 0.7, shape[1])).astype(int)
    row = cochran_q(long(cells), "y", "method", "person").iloc[0]
    theirs, other = cochrans_q(cells), cochran(long(cells), "y", "method", "person").iloc[0]
    assert (row["Q"], row["p_unc"]) == pytest.approx((theirs.statistic, theirs.pvalue), rel=1e-12)
    assert row["Q"] == pytest.approx(other["Q"], abs=5e-4) and row["ddof1"] == theirs.df == shape[1] - 1
    assert row["Q"] == pytest.approx(q_of(cells), rel=1e-12)


def test_the_exact_p_counts_every_order_of_each_participants_answers():
    cells = np.array([[1, 0, 0], [1, 1, 0], [1, 0, 0], [0, 0, 0], [1, 0, 1]])
    orders = [sorted(set(permutations(row))) for row in cells.tolist()]
    qs = np.array([q_of(arrangement) for arrangement in product(*orders)])
    row = cochran_q(long(cells), "y", "method", "person").iloc[0]
    assert row["p_exact"] == pytest.approx(np.mean(qs >= q_of(cells) - 1e-9), rel=1e-12)
    assert row["decides"] == 4 and row["n"] == 5
    assert np.isnan(cochran_q(long(cells), "y", "method", "person", exact=False).iloc[0]["p_exact"])


def test_answers_that_are_all_alike_have_no_q_and_never_a_p():
    table = cochran_q(long([[1, 1, 1], [0, 0, 0]]), "y", "method", "person")
    assert table[["Q", "p_unc", "p_exact"]].isna().all(axis=None) and table["note"][0] == NO_DIFFERENCE


@pytest.mark.parametrize("value", [2, -1, 0.5])
def test_other_answers_than_yes_and_no_are_refused(value):
    with pytest.raises(StatisticsError, match=f"y: {value:g} found; .* 0 .no. or 1 .yes."):
        cochran_q(long([[1, 0], [value, 1]]), "y", "method", "person")


def answered(cells, **settings):
    table = long(cells).rename(columns={"person": "participant", "y": "value"}).assign(stimulus="s")
    kind = TESTS["cochran"]
    request = kind.settings(name="q", test="cochran", factor="method", **settings)
    return kind.answer(Selected(table, table, ("Rough",), {"method": ("m0", "m1", "m2")}), request)


def test_a_plan_asks_for_it_with_what_counts_as_yes():
    ratings = [[80, 20, 55], [70, 40, 10], [90, 60, 45], [20, 10, 5]]
    answer, dichotomous = answered(ratings, yes=50), answered((np.array(ratings) >= 50).astype(int))
    (row,) = answer.rows
    assert row == dichotomous.rows[0] and row["Q"] == pytest.approx(q_of(np.array(ratings) >= 50))
    assert answer.more["shares"] == ({"level": "m0", "yes": 3, "n": 4, "share": 0.75},
                                     {"level": "m1", "yes": 1, "n": 4, "share": 0.25},
                                     {"level": "m2", "yes": 1, "n": 4, "share": 0.25})  # fmt: skip
    assert (
        answer.headline.startswith("method: Q(2) = 2.67, p = .264") and "means of at least 50 are yes" in answer.method
    )
    assert answered([[1, 1, 1], [0, 0, 0]]).headline == f"Cochran's Q of method is undefined: {NO_DIFFERENCE}"
