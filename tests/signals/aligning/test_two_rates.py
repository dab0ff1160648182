"""A real run recorded at two rates: an inertial unit at 100 Hz, wheels at 6.5 Hz (data in terrain/, see its NOTICE)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import firwin

from palpate.signals.aligning.aligned import align, grid_points
from palpate.signals.aligning.methods import METHODS

DATA = Path(__file__).parent / "terrain"


def run(name):
    table = np.genfromtxt(DATA / f"{name}.csv", delimiter=",", skip_header=1)
    return table[:, 0], table[:, 1:]


@pytest.mark.parametrize("name", METHODS)
def test_both_rates_come_onto_one_grid_over_what_they_share(name):
    (imu_s, imu), (wheel_s, wheel) = run("imu_01"), run("pro_01")
    grid_s = grid_points(max(imu_s[0], wheel_s[0]), min(imu_s[-1], wheel_s[-1]), 1000.0)
    for times_s, values, rate_hz in ((imu_s, imu, 100.0), (wheel_s, wheel, 6.5)):
        aligned_values = align(times_s, values, grid_s, METHODS[name], rate_hz=rate_hz, grid_hz=1000.0)
        assert aligned_values.empty == 0
        assert not aligned_values.holes
        assert aligned_values.values.shape == (len(grid_s), values.shape[1])
        # Where a sample lies on a grid point it is that point's value.
        at = np.flatnonzero([np.abs(times_s - grid_time_s).min() < 1e-9 for grid_time_s in grid_s])
        assert len(at) > 2
        nearest = np.abs(times_s[:, None] - grid_s[at]).argmin(axis=0)
        assert aligned_values.values[at] == pytest.approx(values[nearest], abs=2e-5 * np.abs(values).max())


def test_wheel_speeds_never_leave_the_range_of_their_samples_by_pchip_and_do_by_spline():
    wheel_s, wheel = run("pro_01")
    grid_s = grid_points(wheel_s[0], wheel_s[-1], 1000.0)
    by_method = {
        name: align(wheel_s, wheel, grid_s, METHODS[name], rate_hz=6.5, grid_hz=1000.0).values
        for name in ("pchip", "cubic")
    }
    inside = [
        ((wheel.min(0) - 1e-12 <= values) & (values <= wheel.max(0) + 1e-12)).all() for values in by_method.values()
    ]
    assert inside == [True, False]


def test_real_vibration_taken_at_half_its_rate_comes_back():
    """Acceleration up to 15 Hz, every second sample left out, aligned onto all: each method against what was measured.

    Measured: hold 39.9 %, nearest 39.5 %, linear 13.8 %, pchip 9.0 %, cubic 1.4 %, band-limited 0.01 %.
    """
    times_s, imu = run("imu_01")
    low = np.stack([np.convolve(channel, firwin(161, 15, fs=100), mode="valid") for channel in imu[:, 3:].T], axis=1)
    low -= low.mean(axis=0)
    times_s = times_s[80:-80]
    inside = slice(60, -60)
    wrong = {}
    for name, method in METHODS.items():
        restored = align(times_s[::2], low[::2], times_s[:-1], method, rate_hz=50.0, grid_hz=100.0).values
        wrong[name] = np.sqrt(((restored - low[:-1])[inside] ** 2).mean() / (low[inside] ** 2).mean())
    assert list(wrong.values()) == sorted(wrong.values(), reverse=True)
    assert wrong["bandlimited"] < 0.005
