"""Each way onto a grid: its bound holds, its delay is what it says, and its stated error is its error."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.signals.aligning.aligned import align, grid_points
from palpate.signals.aligning.methods import METHODS, band, method_named
from palpate.signals.aligning.refusals import AlignError
from palpate.signals.aligning.sine_errors import leak, sine_error
from tests.examples import examples

BOUNDS = {  # of a sine at w, sampled every T
    "hold": lambda w, T: w * T,
    "nearest": lambda w, T: w * T / 2,
    "linear": lambda w, T: (w * T) ** 2 / 8,
    "pchip": lambda w, T: (w * T) ** 2 / 8,
    "cubic": lambda w, T: 5 / 384 * (w * T) ** 4,
}


def aligned(method, times_s, values, grid_s, rate_hz, grid_hz=1000.0, **more):
    return align(times_s, values, grid_s, METHODS[method], rate_hz=rate_hz, grid_hz=grid_hz, **more)


def sine(hz, times_s, phase=0.0):
    return np.sin(2 * np.pi * hz * times_s + phase)[:, None]


@given(st.sampled_from(sorted(BOUNDS)), st.floats(0.5, 8), st.floats(0, 6.3), st.sampled_from([80.0, 120.0, 3000.0]))
@settings(max_examples=examples(80), deadline=None)
def test_no_error_is_larger_than_the_stated_bound(name, hz, phase, rate_hz):
    """Bounds: Taylor's theorem; Hall and Meyer 1976 for the spline; pchip by the error of its slopes (methods.py)."""
    times_s = 3 + np.arange(int(3 * rate_hz)) / rate_hz
    grid_s = grid_points(3.5, times_s[-1] - 0.5, 1000.0)
    values = aligned(name, times_s, sine(hz, times_s, phase), grid_s, rate_hz).values
    worst = np.abs(values - sine(hz, grid_s, phase)).max()
    bound = BOUNDS[name](2 * np.pi * hz, 1 / rate_hz)
    # Leading order for pchip: where the sine is not yet a parabola, the next order adds to it.
    assert worst <= bound * (1 + (2 * np.pi * hz / rate_hz if name == "pchip" else 0)) + 1e-8


@pytest.mark.parametrize("rate_hz", [80.0, 120.0, 1000.0, 3000.0, 8000.0, 10000.0])
def test_a_band_limited_signal_comes_out_within_a_hundredth_of_a_percent(rate_hz):
    """Up to the edge of the pass band, at any phase and at a rate that no ratio of small numbers describes."""
    true_hz = rate_hz * (1 + 50e-6)
    within = band(true_hz, 1000.0)
    margin_s = 1.1 * within.reach / true_hz
    times_s = 2 + np.arange(int(4 * rate_hz)) / true_hz
    grid_s = grid_points(times_s[0] + margin_s, times_s[-1] - margin_s, 1000.0)
    for share in (0.02, 0.5, 0.95):
        hz = share * within.passes_hz
        values = aligned("bandlimited", times_s, sine(hz, times_s), grid_s, true_hz).values
        assert np.abs(values - sine(hz, grid_s)).max() < 2e-4


@pytest.mark.parametrize("rate_hz", [3000.0, 8000.0, 10000.0])
def test_what_the_grid_cannot_hold_is_removed_before_it_folds_down(rate_hz):
    times_s = np.arange(int(2 * rate_hz)) / rate_hz
    grid_s = grid_points(0.2, 1.8, 1000.0)
    for hz in (505.0, 640.0, 975.0, 1020.0, 1400.0):
        tone = sine(hz, times_s)
        assert np.abs(aligned("bandlimited", times_s, tone, grid_s, rate_hz).values).max() < 2e-4
        assert np.abs(aligned("cubic", times_s, tone, grid_s, rate_hz).values).max() > 0.5


@pytest.mark.parametrize("name", METHODS)
def test_the_delay_is_the_stated_one(name):
    """The phase of a slow sine, against the method's own statement."""
    rate_hz, hz = 80 * 1.0061, 1.0
    times_s = np.arange(1600) / rate_hz
    grid_s = grid_points(1.0, 18.999, 1000.0)
    values = aligned(name, times_s, sine(hz, times_s), grid_s, rate_hz).values[:, 0]
    turned = np.angle(np.sum(values * np.exp(-2j * np.pi * hz * grid_s)) * 2j)
    late_s = -turned / (2 * np.pi * hz)
    assert late_s == pytest.approx(METHODS[name].delay_s(rate_hz, 1000.0), abs=3e-5)


@pytest.mark.parametrize("name", METHODS)
def test_it_takes_no_more_of_the_future_than_it_says(name):
    """A step in the samples shows on the grid not before its time less the look-ahead."""
    times_s = np.arange(400) / 80.0
    grid_s = grid_points(0.0, times_s[-1], 1000.0)
    at = 200
    stepped = np.where(np.arange(400) >= at, 1.0, 0.0)[:, None]
    values = aligned(name, times_s, stepped, grid_s, 80.0).values[:, 0]
    first = grid_s[np.flatnonzero(np.abs(values) > 1e-12)[0]]
    assert first >= times_s[at] - METHODS[name].ahead_s(80.0, 1000.0) - 1e-9
    assert METHODS[name].causal == (first >= times_s[at])


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("value", [0.0, 0.1, -3e5])
def test_a_constant_stays_what_it_is(name, value):
    times_s = 7 + np.arange(200) / 83.1
    result = aligned(name, times_s, np.full((200, 2), value), grid_points(7, 9, 1000.0), 83.1)
    assert result.values == pytest.approx(np.full(result.values.shape, value), rel=1e-12)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("rate_hz", [1000.0, 500.0, 125.0])
def test_samples_that_lie_on_the_grid_are_not_changed(name, rate_hz):
    times_s = 1234.0 + np.arange(300) / rate_hz
    values = np.random.default_rng(2).normal(size=(300, 3))
    grid_s = grid_points(times_s[0], times_s[-1], rate_hz)
    if name == "bandlimited":
        grid_s = grid_s[60:-60]
    result = aligned(name, times_s, values, grid_s, rate_hz, grid_hz=rate_hz)
    expected = values[60:-60] if name == "bandlimited" else values
    assert result.values == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("name", ["nearest", "hold", "linear", "pchip"])
def test_these_never_overshoot(name):
    values = np.random.default_rng(4).normal(size=(500, 1)).round()
    times_s = np.arange(500) / 80.0
    on_grid = aligned(name, times_s, values, grid_points(0, times_s[-1], 1000.0), 80.0).values
    assert values.min() - 1e-12 <= on_grid.min() and on_grid.max() <= values.max() + 1e-12


@pytest.mark.parametrize("name", ["hold", "linear"])
@pytest.mark.parametrize("rate_hz", [80.0, 120.0])
def test_the_stated_error_of_a_sine_is_that_of_theory(name, rate_hz):
    """RMS over all phases in closed form: |1 - e^(-jtu)|^2 and |1 - (1-u)e^(-jtu) - u e^(jt(1-u))|^2, u in 0..1."""
    t, u = 2 * np.pi * 25 / rate_hz, (np.arange(100_000) + 0.5) / 100_000
    left, right = np.exp(-1j * t * u), np.exp(1j * t * (1 - u))
    estimate = left if name == "hold" else (1 - u) * left + u * right
    expected = np.sqrt(np.mean(np.abs(1 - estimate) ** 2))
    assert sine_error(name, rate_hz, 1000.0) == pytest.approx(expected, rel=0.02)


def test_only_the_filtering_method_states_no_leak():
    assert {name for name in METHODS if (leak(name, 8000.0, 1000.0) or 0) < 1e-3} == {"bandlimited"}
    assert leak("hold", 80.0, 1000.0) is None and sine_error("cubic", 40.0, 1000.0) == 1.0


def test_an_unknown_method_is_refused_with_the_nearest():
    with pytest.raises(AlignError, match="no method 'bandlimit'; did you mean 'bandlimited'"):
        method_named("bandlimit")
