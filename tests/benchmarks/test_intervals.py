"""Coverage that is counted by the distribution itself."""

import numpy as np
import pytest
from scipy.stats import norm

from benchmarks import intervals as bench
from palpate.modeling.evaluate.intervals import half_widths


def test_conformal_intervals_hold_what_order_statistics_say_whatever_the_distribution():
    """Of n + 1 exchangeable sizes the new one is among the k smallest with the chance k / (n + 1): 19 of 21 here."""
    for _, draw, within in bench.distributions():
        residual = draw(np.random.default_rng(1), (20, 4000))
        assert within(half_widths(residual)).mean() == pytest.approx(19 / 21, abs=0.003)


def test_an_error_is_how_far_the_share_is_off():
    assert bench.coverage_error(lambda width: norm.cdf(width) - norm.cdf(-width), np.full(3, 1.0)) == pytest.approx(
        0.9 - 0.6826894921, abs=1e-9
    )


def test_normal_widths_are_wrong_on_heavy_tails():
    (error,) = [
        case.error(case.run()) for case in bench.cases(True) if case.input == "t(3), 90 stimuli" and "SD" in case.method
    ]
    assert error > 0.01
