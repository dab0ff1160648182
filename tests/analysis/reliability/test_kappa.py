"""Fleiss' kappa against a worked example and statsmodels."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.analysis.reliability.kappa import cohen_kappa, fleiss_kappa
from palpate.analysis.reliability.krippendorff import krippendorff
from palpate.analysis.statistics.refusals import BadValue, TooFew

WORKED = np.array(  # 10 things, 14 raters, 5 categories: kappa .210 (Wikipedia, "Fleiss' kappa", worked example)
    [
        *([0, 0, 0, 0, 14], [0, 2, 6, 4, 2], [0, 0, 3, 5, 6], [0, 3, 9, 2, 0], [2, 2, 8, 1, 1]),
        *([7, 7, 0, 0, 0], [3, 2, 6, 3, 0], [2, 5, 3, 2, 2], [6, 5, 2, 1, 0], [0, 2, 2, 3, 7]),
    ]
)


def test_the_worked_example_and_statsmodels() -> None:
    from statsmodels.stats import inter_rater as rater

    result = fleiss_kappa(WORKED)
    assert round(result.kappa, 3) == 0.210
    assert result.kappa == pytest.approx(rater.fleiss_kappa(WORKED), rel=1e-12)


def test_alpha_is_kappa_but_for_a_small_sample() -> None:
    """1 - alpha = (1 - kappa) (n - 1) / n for n values: exact, from the two definitions."""
    rows = np.array([np.repeat(np.arange(5), row) for row in WORKED], dtype=float)
    alpha = krippendorff(rows, "nominal").alpha
    assert 1 - alpha == pytest.approx((1 - fleiss_kappa(WORKED).kappa) * 139 / 140, rel=1e-13)


def test_undefined_and_refused() -> None:
    one_category = fleiss_kappa(np.array([[3, 0], [3, 0]]))
    assert np.isnan(one_category.kappa)
    assert "one category" in one_category.note
    with pytest.raises(BadValue, match="2 to 3 raters"):
        fleiss_kappa(np.array([[3, 0], [1, 1]]))
    with pytest.raises(TooFew, match="one rater"):
        fleiss_kappa(np.array([[1, 0], [0, 1]]))
    with pytest.raises(BadValue, match="whole numbers"):
        fleiss_kappa(np.array([[1.5, 0.5]]))


COHEN = np.array([[44, 5, 1], [7, 20, 3], [9, 5, 6]])  # 100 units, two raters, three categories


def test_cohen_s_kappa_its_error_and_interval_are_those_of_statsmodels() -> None:
    from statsmodels.stats import inter_rater as rater

    result, expected = cohen_kappa(COHEN), rater.cohens_kappa(COHEN)
    assert result.kappa == pytest.approx(expected.kappa, rel=1e-13)
    assert result.se == pytest.approx(expected.std_kappa, rel=1e-12)
    assert (result.low, result.high) == pytest.approx((expected.kappa_low, expected.kappa_upp), rel=1e-12)
    assert (result.agreement, result.units) == (0.7, 100)


def test_cohen_s_kappa_where_it_is_one_none_or_refused() -> None:
    alike = cohen_kappa(np.diag([3, 4]))
    assert alike.kappa == alike.low == alike.high == 1.0
    one = cohen_kappa(np.array([[5, 0], [0, 0]]))
    assert np.isnan(one.kappa) and one.agreement == 1.0 and "one and the same category" in one.note
    opposed = cohen_kappa(np.array([[0, 4], [4, 0]]))
    assert opposed.kappa == -1.0 and "less than by chance" in opposed.note and opposed.low >= -1.0
    for wrong, message in ((np.ones((2, 3)), "shape"), (np.full((2, 2), 0.5), "whole numbers")):
        with pytest.raises(BadValue, match=message):
            cohen_kappa(wrong)
    with pytest.raises(BadValue, match="confidence"):
        cohen_kappa(COHEN, confidence=1.0)
    with pytest.raises(TooFew, match="no units"):
        cohen_kappa(np.zeros((2, 2)))
