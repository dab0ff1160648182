"""From reports to speed and force at 1 kHz: delay, error, thresholds, and what a stylus does that breaks pipelines."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import butter, lfilter, lfilter_zi

from benchmarks.tablet_errors import Stroke, convert_reports, errors
from palpate.devices.device import DeviceError
from palpate.devices.tablet.force import Force
from palpate.devices.tablet.pipeline import Lowpass, Shape, Stylus, delay_s
from palpate.devices.tablet.reports import Report

T = 0.0075


def stroke(speed_mm_s, pressure=0.5, seconds=0.5, first=0.0):
    """Reports of a straight stroke at 133 Hz."""
    return [Report(first + k * T, speed_mm_s * k * T, 0.0, pressure, True) for k in range(round(seconds / T))]


def at(reports, seconds, shape=None):
    return np.array(convert_reports(shape or Shape(report_hz=1 / T), reports, seconds))


@pytest.mark.parametrize(("cutoff", "rate"), [(20, 1000), (5, 1000), (200, 1000), (0.1, 1000)])
def test_the_low_pass_is_scipys_butterworth(cutoff, rate):
    b, a = butter(2, cutoff, fs=rate)
    noise = 3 + np.random.default_rng(1).standard_normal(2000)
    expected, _ = lfilter(b, a, noise, zi=lfilter_zi(b, a) * noise[0])
    low = Lowpass(cutoff, rate)
    low.settle(noise[0])
    np.testing.assert_allclose([low.step(value) for value in noise], expected, rtol=1e-9)


def test_the_low_pass_stays_at_rest_for_hours_and_lets_go_of_a_burst():
    low = Lowpass(20, 1000)
    low.settle(0.7)
    for _ in range(1_000_000):
        out = low.step(0.7)
    assert out == pytest.approx(0.7, rel=1e-12)
    for _ in range(10_000):
        out = low.step(0.0)
    assert abs(out) < 1e-200
    for cutoff in (0, 500, math.nan, math.inf):
        with pytest.raises(DeviceError, match="half the rate"):
            Lowpass(cutoff, 1000)


def test_the_low_passes_delay_is_the_stated():
    low, slope = Lowpass(20, 1000), 0.01
    for k in range(3000):
        out = low.step(slope * k)
    assert (slope * 2999 - out) / slope / 1000 == pytest.approx(delay_s(20), rel=0.002)


@pytest.mark.parametrize("upsampling", ["hold", "line"])
def test_delay_and_error_are_as_stated(upsampling):
    shape, round_ = Shape(upsampling=upsampling), Stroke(frequency_hz=0.8)
    out = convert_reports(shape, round_.reports(shape, 11.0), 11.0)
    speed, force = errors(out, 1, round_.speed_mm_s), errors(out, 2, round_.pressed_N)
    assert speed.delay_s == pytest.approx(shape.speed_delay_s, abs=0.0004)
    assert force.delay_s == pytest.approx(shape.force_delay_s, abs=0.0004)
    assert speed.left < 0.0025 * 125
    assert force.left < 0.002


def test_speed_and_force_of_a_steady_stroke_are_right_from_the_first_reports_on():
    out = at(stroke(100.0), 0.5)
    assert out[:8, 1:].tolist() == [[0, 0]] * 8
    np.testing.assert_allclose(out[9:, 1], 100, rtol=1e-9)
    np.testing.assert_allclose(out[9:, 2], 0.13 * math.exp(1.66), rtol=1e-9)


@pytest.mark.parametrize(
    ("speed", "pressure", "expected"),
    [
        (9.9, 0.5, (0, 0)),
        (10.1, 0.5, (10.1, 0.13 * math.exp(1.66))),
        (299, 0.5, (299, 0.13 * math.exp(1.66))),
        (5000, 0.5, (300, 0.13 * math.exp(1.66))),
        (100, 0.03, (0, 0)),
        (100, 0.05, (100, 0.13 * math.exp(0.166))),
        (100, 1.0, (100, 0.13 * math.exp(3.32))),
        (100, 0.0, (0, 0)),
    ],
)
def test_below_the_minimum_all_is_zero_and_above_the_maximum_the_maximum(speed, pressure, expected):
    assert at(stroke(speed, pressure), 0.45)[-1, 1:] == pytest.approx(expected, rel=1e-4)
    strong = Shape(force=Force(1.0, 3.32), report_hz=1 / T)
    assert at(stroke(100, 0.9), 0.45, strong)[-1, 2] == 3.6


def test_no_overshoot_goes_beyond_the_maximum():
    fast = [*stroke(20, seconds=0.2), *[Report(0.2 + k * T, 4 + 1000 * k * T, 0, 0.5, True) for k in range(1, 40)]]
    assert at(fast, 0.45)[:, 1].max() == 300


def test_lifting_off_ends_both_at_once_and_the_next_touch_starts_without_a_trace():
    reports = [*stroke(200, 1.0, 0.3), Report(0.3, 60, 0, 0, False), *stroke(50, 0.4, 0.3, first=0.4)]
    out = at(reports, 0.7)
    assert out[299, 1] == pytest.approx(200, rel=1e-6)
    assert out[300:408, 1:].tolist() == [[0, 0]] * 108
    np.testing.assert_allclose(out[409:690, 1], 50, rtol=1e-9)
    np.testing.assert_allclose(out[409:690, 2], 0.13 * math.exp(3.32 * 0.4), rtol=1e-9)


def test_a_tablet_that_is_silent_as_nothing_changes_means_a_stylus_at_rest():
    moving, rest = stroke(100, seconds=0.3), 0.5
    away = moving[-1]
    again = [Report(away.t_s + rest + k * T, away.x_mm + 100 * (k + 1) * T, 0, 0.5, True) for k in range(40)]
    out = at([*moving, *again], 1.0)
    resting = out[(out[:, 0] > away.t_s + 0.1) & (out[:, 0] < again[0].t_s)]
    assert (resting[:, 1:] == 0).all()
    after = out[(out[:, 0] > again[0].t_s + 0.06) & (out[:, 0] < again[-1].t_s)]
    np.testing.assert_allclose(after[:, 1], 100, rtol=0.02)


@pytest.mark.parametrize("upsampling", ["hold", "line"])
def test_reports_that_come_bunched_by_a_frame_give_no_nonsense(upsampling):
    shape = Shape(report_hz=133, upsampling=upsampling)
    bunched = [
        Report(frame / 60 + 1e-5 * k, 100 * (frame + k / 3) / 60, 0, 0.5, True)
        for frame in range(120)
        for k in range(3)
    ]
    out = np.array(convert_reports(shape, bunched, 1.9))
    assert out[200:, 1].min() > 90
    assert out[200:, 1].max() < 110


def test_a_held_stylus_that_trembles_by_a_step_gives_nothing():
    still = [Report(k * T, 10 + 0.01 * (k % 2), 10, 0.6, True) for k in range(100)]
    assert (at(still, 0.7)[:, 1:] == 0).all()


def test_times_that_are_equal_divide_nothing_by_zero():
    out = at([Report(0.1, x, 0, 0.5, True) for x in range(5)], 0.3)
    assert np.isfinite(out).all()
    assert (out[:, 1] == 0).all()


def test_an_hour_of_touching_stays_bounded_and_exact():
    stylus = Stylus(Shape(report_hz=100))
    for tick in range(36_000):
        t_s = tick / 10
        stylus.report(Report(t_s, math.sin(tick), 0, 0.7, True))
        speed, force = stylus.step(t_s)
        assert 0 <= speed <= 300
        assert force == 0 or force == pytest.approx(0.13 * math.exp(3.32 * 0.7))


@pytest.mark.parametrize(
    "wrong",
    [
        {"report_hz": 0}, {"rate_hz": math.nan}, {"slowest_mm_s": 400}, {"faintest_N": -1}, {"firmest_N": math.inf},
        {"force": Force(0.0, 3)}, {"cutoff_hz": -2},
    ],
)  # fmt: skip
def test_limits_that_cannot_be_are_refused(wrong):
    with pytest.raises(DeviceError, match="rise from lowest to highest"):
        Shape(**wrong)
