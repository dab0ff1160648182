"""d' is that of published tables and of independent integrals, its intervals are of their size, extremes are named."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ndtri
from scipy.stats import multivariate_normal, norm

from palpate.analysis.choices.detection import (
    PAIRS,
    corrected_rate,
    detection_of_pairs,
    detection_of_share,
    dprime_of_share,
    same_different_rates,
    share_correct,
    share_odd,
)
from palpate.analysis.statistics.refusals import BadOption, BadValue, NoEstimate, TooFew


@pytest.mark.parametrize("alternatives", [2, 3, 4, 8, 32])
@pytest.mark.parametrize("dprime", [0.0, 0.31, 1.0, 2.5, 4.8])
def test_a_forced_choice_is_the_integral_of_hacker_and_ratcliff(alternatives: int, dprime: float) -> None:
    """Their table 1 is this integral; here by adaptive quadrature over the signal's own distribution."""
    expected = quad(
        lambda x: norm.pdf(x - dprime) * norm.cdf(x) ** (alternatives - 1), -12, 12 + dprime, epsabs=1e-12, limit=400
    )[0]
    assert share_correct(dprime, alternatives) == pytest.approx(expected, abs=1e-10)
    if dprime:
        share = share_correct(dprime, alternatives)
        assert dprime_of_share(share, "forced_choice", alternatives) == pytest.approx(dprime, abs=1e-6)


def test_two_alternatives_have_a_closed_form() -> None:
    """P = Phi(d' / root 2) (Green & Swets 1966)."""
    for dprime in (0.2, 1.0, 3.0):
        assert share_correct(dprime, 2) == pytest.approx(norm.cdf(dprime / math.sqrt(2)), abs=1e-12)


@pytest.mark.parametrize("dprime", [0.0, 0.5, 1.0, 2.0, 4.0])
def test_the_triangle_is_a_probability_of_a_bivariate_normal(dprime: float) -> None:
    """The odd one Z is chosen if |X - Y| is the smallest difference: 2 P(A > 0, B > 0) + the mirrored case.

    With U = X - Y and V = 2 Z - X - Y, independent, Z is odd where |V| > 3 |U| ... as |Z - X|, |Z - Y| > |X - Y|:
    that is |V| / 2 > 3 |U| / 2. U has variance 2, V variance 6 and mean 2 d'.
    """
    total = 0.0
    for sign in (1, -1):
        # P(V s > 3 U, V s > -3 U) of (V s - 3 U, V s + 3 U)
        mean = [2 * dprime * sign] * 2
        total += float(multivariate_normal.cdf(mean, mean=[0, 0], cov=[[24, -12], [-12, 24]]))
    assert share_odd(dprime) == pytest.approx(total, abs=1e-6)


def test_published_values() -> None:
    """Ennis 1993, table of the triangular method: d' 1 gives .418, d' 2 .605. Macmillan & Creelman 2005, tables A5.3,
    A5.4: H .9, F .2 (z difference 2.12) gives d' 2.83 by independent observation.
    """
    assert share_odd(1.0) == pytest.approx(0.418, abs=5e-4)
    assert share_odd(2.0) == pytest.approx(0.605, abs=5e-4)
    assert share_odd(0.0) == pytest.approx(1 / 3, abs=1e-12)
    assert PAIRS["independent_observation"](0.9, 0.2)[0] == pytest.approx(2.83, abs=5e-3)


@pytest.mark.parametrize("dprime", [0.5, 1.3, 3.0])
@pytest.mark.parametrize("criterion", [0.7, 1.8])
def test_same_different_by_differencing_is_an_integral_over_differences(dprime: float, criterion: float) -> None:
    """The difference of two percepts has variance 2 (Kaplan, Macmillan & Creelman 1978)."""
    rates = [
        1 - quad(lambda x, m=mean: norm.pdf(x, m, math.sqrt(2)), -criterion, criterion, epsabs=1e-13)[0]
        for mean in (dprime, 0.0)
    ]
    assert same_different_rates(dprime, criterion) == pytest.approx(rates, abs=1e-10)
    assert PAIRS["differencing"](*rates) == pytest.approx((dprime, criterion), abs=1e-6)


@pytest.mark.parametrize("dprime", [0.4, 1.0, 2.2])
def test_same_different_by_independent_observation_is_that_of_two_decisions(dprime: float) -> None:
    """Unbiased, each interval is decided by itself: p = Phi(d'/2)^2 + Phi(-d'/2)^2 (Macmillan & Creelman 2005, 9.3)."""
    right = norm.cdf(dprime / 2)
    share = right**2 + (1 - right) ** 2
    assert PAIRS["independent_observation"](share, 1 - share)[0] == pytest.approx(dprime, abs=1e-9)


def test_rates_of_0_and_1_are_corrected_by_name_or_refused() -> None:
    """Hautus 1995: (20 + 0.5) / (20 + 1) and 0.5 / 21."""
    result = detection_of_pairs(20, 20, 0, 20, model="yes_no")
    assert result.dprime == pytest.approx(ndtri(20.5 / 21) - ndtri(0.5 / 21), abs=1e-12)
    assert (result.corrected, result.criterion) == (True, pytest.approx(0, abs=1e-12))
    moved = detection_of_pairs(20, 20, 0, 20, model="yes_no", correction="when_extreme")
    assert moved.dprime == pytest.approx(ndtri(19.5 / 20) - ndtri(0.5 / 20), abs=1e-12)
    with pytest.raises(NoEstimate, match="20 of 20 answers: a rate of 0 or 1 has no d'"):
        detection_of_pairs(20, 20, 3, 20, model="yes_no", correction="none")
    assert corrected_rate(5, 10, 0.25, "when_extreme") == (0.5, False)


def test_the_delta_method_is_that_of_gourevitch_and_galanter() -> None:
    """var d' = H (1 - H) / (n phi(z(H))^2) + F (1 - F) / (m phi(z(F))^2) (Gourevitch & Galanter 1967)."""
    result = detection_of_pairs(40, 50, 12, 60, model="yes_no", correction="none")
    parts = [rate * (1 - rate) / (n * norm.pdf(ndtri(rate)) ** 2) for rate, n in ((0.8, 50), (0.2, 60))]
    assert result.se == pytest.approx(math.sqrt(sum(parts)), rel=1e-6)
    assert (result.low, result.high) == pytest.approx(
        (result.dprime - 1.959964 * math.sqrt(sum(parts)), result.dprime + 1.959964 * math.sqrt(sum(parts))), abs=1e-5
    )


def test_intervals_hold_the_truth_as_often_as_they_say(full_run: bool) -> None:
    rng = np.random.default_rng(4)
    held = 0
    count = 2000 if full_run else 300
    share = share_odd(1.5)
    for correct in rng.binomial(120, share, count):
        one = detection_of_share(float(correct), 120, design="oddity", alternatives=3, correction="none")
        held += one.low is not None and one.high is not None and one.low <= 1.5 <= one.high
    assert 0.92 <= held / count <= 0.975


def test_chance_is_said_and_mistakes_are_refused() -> None:
    assert detection_of_share(5, 20, design="oddity", alternatives=3).chance
    assert detection_of_share(5, 20, design="oddity", alternatives=3).dprime == 0.0
    assert detection_of_pairs(3, 10, 5, 10, model="differencing").se is None
    assert detection_of_pairs(3, 10, 5, 10, model="yes_no").dprime < 0
    with pytest.raises(TooFew, match="no noise trial"):
        detection_of_pairs(3, 10, 0, 0, model="yes_no")
    with pytest.raises(BadValue, match="12 answers in 10 signal trials"):
        detection_of_pairs(12, 10, 0, 5, model="yes_no")
    with pytest.raises(BadOption, match="known for three"):
        detection_of_share(5, 20, design="oddity", alternatives=4)
    with pytest.raises(BadOption, match="is unknown"):
        detection_of_pairs(3, 10, 1, 5, model="guess")
    with pytest.raises(NoEstimate, match="above 12"):
        dprime_of_share(1.0, "forced_choice", 4)
