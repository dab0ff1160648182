"""Fleiss' kappa against a worked example and statsmodels."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.reliability.coincidence import krippendorff
from analysis.reliability.kappa import fleiss_kappa
from analysis.statistics.refusals import BadValue, TooFew

WORKED = np.array(  # 10 things, 14 raters, 5 categories: kappa .210 (Wikipedia, "Fleiss' kappa", worked example)
    [
        *([0, 0, 0, 0, 14], [0, 2, 6, 4, 2], [0, 0, 3, 5, 6], [0, 3, 9, 2, 0], [2, 2, 8, 1, 1]),
        *([7, 7, 0, 0, 0], [3, 2, 6, 3, 0], [2, 5, 3, 2, 2], [6, 5, 2, 1, 0], [0, 2, 2, 3, 7]),
    ]
)


def test_the_worked_example_and_statsmodels() -> None:
    from statsmodels.stats import inter_rater as rater

    found = fleiss_kappa(WORKED)
    assert round(found.kappa, 3) == 0.210
    assert found.kappa == pytest.approx(rater.fleiss_kappa(WORKED), rel=1e-12)


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
