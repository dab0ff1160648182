"""The speed's stated noise, bias and delay against simulation; scipy's savgol_coeffs is the other software."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import savgol_coeffs

from benchmarks.speed_table import Stroke, table
from palpate.signals.aligning.refusals import AlignError
from palpate.signals.aligning.speed import floor_mm_s, slope, speed, velocity

RATE = 120.0
EVERY = [(3, 1), (3, 2), (7, 2), (9, 3), (13, 4), (31, 2), (101, 5), (1001, 4)]


# scipy's powers lose digits in long windows (3e-3 at 1001 samples, degree 4; 3e-8 at 101, degree 5, on
# some processors); there the polynomials below judge.
@pytest.mark.parametrize(("window", "degree"), EVERY[:-1])
def test_the_weights_are_those_of_scipy(window, degree):
    middle = savgol_coeffs(window, degree, deriv=1, delta=1 / RATE, use="dot")
    np.testing.assert_allclose(slope(window, degree, RATE).weights, middle, rtol=1e-6, atol=1e-7 * np.abs(middle).max())
    last = savgol_coeffs(window, degree, deriv=1, delta=1 / RATE, pos=window - 1, use="dot")
    ours = slope(window, degree, RATE, "end").weights
    np.testing.assert_allclose(ours, last, rtol=1e-6, atol=1e-7 * np.abs(last).max())


@pytest.mark.parametrize("place", ["middle", "end"])
@pytest.mark.parametrize(("window", "degree"), EVERY)
def test_a_polynomial_of_the_degree_has_no_error_and_the_next_one_the_stated(window, degree, place):
    estimate = slope(window, degree, RATE, place)
    t = np.arange(3 * window) / RATE
    t = t - t[len(t) // 2]
    reach = abs(t).max()
    exact = velocity((t / reach)[:, None] ** degree, estimate)[:, 0] - degree * (t / reach) ** (degree - 1) / reach
    assert np.nanmax(np.abs(exact)) < 1e-7 * degree / reach
    order = estimate.bias_order
    wrong = velocity((t / reach)[:, None] ** order, estimate)[:, 0] - order * (t / reach) ** (order - 1) / reach
    at = np.nanargmin(np.where(np.isnan(wrong), np.nan, np.abs(t)))
    stated = estimate.bias * math.factorial(order) / reach**order
    # The instant nearest to 0: there the derivative of the stated order is all that is wrong, and it is constant.
    assert wrong[at] == pytest.approx(stated, rel=1e-6)


@pytest.mark.parametrize("place", ["middle", "end"])
@pytest.mark.parametrize(("window", "degree"), EVERY[:6])
def test_noise_comes_through_as_stated(window, degree, place):
    estimate = slope(window, degree, RATE, place)
    noise = np.random.default_rng(5).standard_normal((200_000, 3))
    velocities = velocity(noise, estimate)
    known = velocities[~np.isnan(velocities).any(axis=1)]
    # Neighbouring windows overlap: n / window of them are independent.
    assert known.std() == pytest.approx(estimate.noise_gain_per_s, rel=5 / math.sqrt(2 * known.size / window))
    rest = np.linalg.norm(known, axis=1).mean()
    assert rest == pytest.approx(floor_mm_s(1.0, estimate), rel=0.03)


def test_the_noise_gain_is_the_textbooks():
    """Line and parabola over n samples: sqrt(12 / (n (n^2 - 1))) x rate (e.g. Orfanidis, section 8.3)."""
    for window in (3, 5, 21):
        gain = math.sqrt(12 / (window * (window**2 - 1))) * RATE
        assert slope(window, 1, RATE).noise_gain_per_s == pytest.approx(gain, rel=1e-12)
        assert slope(window, 2, RATE).noise_gain_per_s == pytest.approx(gain, rel=1e-12)


@pytest.mark.parametrize("window", [3, 9, 15])
def test_a_causal_line_lags_by_half_its_window_and_a_parabola_does_not(window):
    line, parabola = slope(window, 1, RATE, "end"), slope(window, 2, RATE, "end")
    assert line.lag_s == pytest.approx((window - 1) / 2 / RATE, rel=1e-9)
    assert parabola.lag_s == pytest.approx(0, abs=1e-9)
    assert slope(window, 2, RATE).wait_s == (window - 1) / 2 / RATE
    t = np.arange(200) / RATE
    velocities = velocity((300 * t**2)[:, None], line)[:, 0]
    np.testing.assert_allclose(velocities[window:], 600 * (t[window:] - line.lag_s), rtol=1e-9)


def test_a_window_that_holds_a_hidden_sample_gives_nan():
    positions = np.cumsum(np.ones((50, 3)), axis=0)
    positions[20] = np.nan
    speeds = speed(positions, slope(7, 2, RATE))
    assert np.isnan(speeds[[0, 1, 2, 47, 48, 49]]).all()
    assert np.isnan(speeds[17:24]).all()
    np.testing.assert_allclose(speeds[[3, 16, 24, 46]], math.sqrt(3) * RATE)
    causal = speed(positions, slope(7, 2, RATE, "end"))
    assert np.isnan(causal[:6]).all()
    assert np.isnan(causal[20:27]).all()
    assert np.isfinite(causal[[6, 19, 27, 49]]).all()


def test_far_from_the_origin_no_digits_are_lost():
    t = np.arange(200) / RATE
    velocities = velocity(1e9 + (50 * t)[:, None], slope(21, 2, RATE))
    np.testing.assert_allclose(velocities[30:170], 50, rtol=1e-4)
    assert np.isnan(velocity(np.zeros((5, 3)), slope(7, 2, RATE))).all()


def test_speed_in_a_surface_leaves_out_what_goes_along_its_normal():
    t = np.arange(60)[:, None] / RATE
    positions = t * np.array([[30.0, 40.0, 99.0]])
    speeds = speed(positions, slope(5, 2, RATE), normal=(0, 0, 2))
    np.testing.assert_allclose(speeds[5:-5], 50, rtol=1e-9)
    with pytest.raises(AlignError, match="no direction"), np.errstate(invalid="ignore"):
        speed(positions, slope(5, 2, RATE), normal=(0, 0, 0))


@pytest.mark.parametrize("place", ["middle", "end"])
def test_the_tables_theory_is_what_a_simulated_stroke_shows(place):
    for line in table(Stroke(), (5, 9, 15, 25), place=place):
        assert line.measured_mm_s == pytest.approx(line.expected_mm_s, rel=0.02)


@pytest.mark.parametrize(("window", "degree", "place"), [(4, 2, "middle"), (3, 3, "end"), (5, 0, "end"), (1, 1, "end")])
def test_a_window_that_cannot_be_is_refused(window, degree, place):
    with pytest.raises(AlignError, match="window"):
        slope(window, degree, RATE, place)
    with pytest.raises(AlignError, match="rate above 0"):
        slope(5, 2, math.nan)
