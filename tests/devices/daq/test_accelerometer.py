"""The accelerometer: volts to m/s^2, its calibration in six positions, clipping, and one g at rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from palpate.devices.daq.accelerometer import Settings, make
from palpate.devices.daq.adxl335 import POSITIONS, Scaling, acceleration, calibrate
from palpate.devices.device import DeviceError, DeviceFault
from tests.devices.daq.scenes import Bent, Clock, Steady, rows, run
from tests.examples import examples

G = 9.80665
TYPICAL = Scaling(np.full(3, 0.3), np.full(3, 1.5), 3.0)
TILTED = np.array([np.cos(np.radians(10)), np.sin(np.radians(10)), 0])
UP = {name: np.eye(3)["xyz".index(name[1])] * (1 if name[0] == "+" else -1) for name in POSITIONS}


def sensor(bend=None, **settings):
    clock = Clock()
    device = make("vibration", Settings(kind="accelerometer", driver="twin", **settings), Path())
    device.elapsed_s = clock
    if bend is not None:
        device.daq = Bent(device.daq, bend)
    device.open()
    return device, clock


def test_volts_are_metres_per_second_squared_by_each_axis_own_scaling() -> None:
    scaling = Scaling(np.array([0.3, 0.33, 0.27]), np.array([1.5, 1.4, 1.6]), 3.0)
    volts = np.array([[1.5, 1.4, 1.6], [1.8, 1.73, 1.33], [1.2, 1.07, 1.87]])
    assert acceleration(volts, scaling) == pytest.approx(np.array([[0, 0, 0], [G, G, -G], [-G, -G, G]]))


def test_at_another_supply_both_voltages_are_in_proportion() -> None:
    """The data sheet's own pair: 300 mV/g at 3 V are 360 mV/g at 3.6 V, and zero g stays half of the supply."""
    other = TYPICAL.at(3.6)
    assert other.sensitivity_V == pytest.approx([0.36] * 3)
    assert other.zero_V == pytest.approx([1.8] * 3)


@given(
    st.lists(st.floats(0.27, 0.33), min_size=3, max_size=3),
    st.lists(st.floats(1.2, 1.8), min_size=3, max_size=3),
)
@settings(max_examples=examples(50), deadline=None)
def test_six_positions_give_the_scaling_back(sensitivity, zero) -> None:
    readings = {name: np.array(zero) + up * sensitivity for name, up in UP.items()}
    scaling = calibrate(readings, 3.0)
    assert scaling.scaling.sensitivity_V == pytest.approx(sensitivity, abs=1e-12)
    assert scaling.scaling.zero_V == pytest.approx(zero, abs=1e-12)
    assert scaling.worst_g < 1e-12


def test_a_tilted_stand_shows_in_the_residual_of_its_position() -> None:
    """Two degrees off: the other axes feel sin 2 deg = 0.035 g; over three axes that is 0.02 g RMS."""
    tilt = np.array([np.cos(np.radians(2)), np.sin(np.radians(2)), 0])
    readings = {name: 1.5 + 0.3 * (tilt if name == "+x" else up) for name, up in UP.items()}
    scaling = calibrate(readings, 3.0)
    assert max(scaling.residual_g, key=scaling.residual_g.get) == "+x"
    assert scaling.residual_g["+x"] == pytest.approx(0.0168, abs=5e-4)
    assert scaling.residual_g["-z"] < 0.004


def test_readings_may_hold_many_rows_and_their_noise_averages_out() -> None:
    rng = np.random.default_rng(2)
    readings = {name: 1.5 + 0.3 * up + rng.normal(0, 0.003, (3000, 3)) for name, up in UP.items()}
    assert calibrate(readings, 3.0).scaling.sensitivity_V == pytest.approx([0.3] * 3, abs=2e-4)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda r: r.pop("-y"), "-y is missing"),
        (lambda r: r.update({"+x": r["-x"], "-x": r["+x"]}), "x gives -0.300 V per g"),
        (lambda r: r.update({"+x": r["+y"], "+y": r["+x"]}), "x gives 0.150 V per g"),
        (lambda r: r.update({"+x": 1.5 + 0.3 * TILTED}), "[+]x is off by 0.0.. g .RMS.; were two positions swapped"),
        (lambda r: r.update({"+z": np.full(3, np.nan)}), "[+]z holds a value that is not a number"),
        (lambda r: r.update({"+z": np.zeros((2, 2))}), r"[+]z has volts of shape \(2, 2\)"),
        (
            lambda r: r.update({name: np.full(3, 1.5) for name in POSITIONS}),
            "x gives 0.000 V per g .* 0.21 to 0.39 are",
        ),
    ],
)
def test_six_positions_that_cannot_be_right_are_refused(change, words) -> None:
    readings = {name: 1.5 + 0.3 * up for name, up in UP.items()}
    change(readings)
    with pytest.raises(DeviceError, match=f"six positions: {words}"):
        calibrate(readings, 3.0)


def test_a_calibrated_twin_measures_what_a_scene_holds() -> None:
    own = {
        "sensitivity_V_per_g": (0.31, 0.29, 0.305),
        "zero_g_V": (1.52, 1.47, 1.55),
        "supply_V": 3.3,
        "noise_V": 0.0,
        "stuck_s": 0,
    }
    device, clock = sensor(**own)
    device.expect(Steady(acceleration_is=(2.0, -3.0, 9.0)))
    data = rows(device.signals[0], run(device, clock, 0.5))
    assert len(data) == 1500
    assert np.abs(data - [2, -3, 9]).max() < 10 / 2**16 / 2 / 0.3 * G
    assert "six positions" in device.signals[0].calibration


def test_the_twin_has_the_sensors_bandwidth() -> None:
    """The data sheet's Z axis ends at 550 Hz: there a first-order low-pass passes 1 / sqrt 2 (here as sampled)."""
    device, clock = sensor(noise_V=0.0, rate_hz=10_000)
    device.expect(Steady(acceleration_is=(0.0, 0.0, 0.0), hz=550.0, swing=(10.0, 10.0, 10.0)))
    data = rows(device.signals[0], run(device, clock, 0.5))[1000:]
    passed = np.sqrt(2) * data.std(axis=0) / 10
    hold = np.exp(-2 * np.pi * np.array([1600, 1600, 550]) / 10_000)
    expected = (1 - hold) / np.abs(1 - hold * np.exp(-2j * np.pi * 550 / 10_000))
    assert passed == pytest.approx(expected, abs=0.005)
    assert passed[2] == pytest.approx(1 / np.sqrt(2), abs=0.03)


def test_clipping_is_counted_and_a_long_one_is_a_fault() -> None:
    device, clock = sensor(noise_V=0.0005, bandwidth_hz=(1e5, 1e5, 1e5))
    device.expect(Steady(acceleration_is=(0.0, 0.0, 0.0), hz=30.0, swing=(4 * G, 0.0, 0.0)))
    data = rows(device.signals[0], run(device, clock, 1.0))
    share = 2 * np.arccos(3 / 4) / np.pi
    assert device.transducer.clipped == pytest.approx(3000 * share, rel=0.02)
    assert device.transducer.longest == pytest.approx(3000 / 30 * share / 2, abs=1.5)
    assert data[:, 0].max() > 3 * G
    device.expect(Steady(acceleration_is=(-3.5 * G, 0.0, 0.0), hz=1.0, swing=(0.01, 0.01, 0.01)))
    with pytest.raises(DeviceFault, match="x is clipped at 0.45.* V for 0.1 s") as caught:
        run(device, clock, 1.0)
    assert caught.value.what == "over_range"


@pytest.mark.parametrize("cut", [1, 7, 100, 3000])
def test_the_longest_clipping_does_not_depend_on_how_samples_are_read(cut) -> None:
    device, _ = sensor()
    sharp = device.transducer
    sharp.begin()
    volts = np.random.default_rng(3).normal(1.5, 0.01, (3000, 3))
    volts[500:600, 1] = 2.9 + 0.001 * np.arange(100) % 0.003
    for first in range(0, 3000, cut):
        sharp.rows(volts[first : first + cut])
    assert (sharp.clipped, sharp.longest) == (100, 100)


@pytest.mark.parametrize(
    ("bend", "what", "words"),
    [
        (lambda volts, first: np.full_like(volts, np.nan), "not_a_number", "Dev1/ai0 gave nan V"),
        (lambda volts, first: np.full_like(volts, 1.5), "stuck", "has stood at 1.5 V"),
        (lambda volts, first: volts * [1, 1, 0], "over_range", "z is clipped at 0 V for 0.1 s"),
    ],
)
def test_what_no_sound_sensor_gives_is_a_fault_by_name(bend, what, words) -> None:
    device, clock = sensor(bend)
    with pytest.raises(DeviceFault, match=f"vibration: .*{words}") as caught:
        run(device, clock, 1.0)
    assert caught.value.what == what


def test_gravity_is_not_taken_as_nothing() -> None:
    device, _clock = sensor()
    with pytest.raises(DeviceError, match="an accelerometer has no zero to take; calibrate it in six positions"):
        device.transducer.zero(np.zeros((10, 3)))


@pytest.mark.parametrize(
    "wrong",
    [{"range_V": (1, 1)}, {"range_V": (0, 2.5)}, {"supply_V": 5.0}, {"sensitivity_V_per_g": (0.3, 0.3)},
     {"sensitivity_V_per_g": (0.3, 0.3, 0.0)}, {"bandwidth_hz": (0.1, 1, 1)}],
)  # fmt: skip
def test_settings_that_cannot_be_meant_are_refused(wrong) -> None:
    with pytest.raises(ValidationError):
        Settings(kind="accelerometer", driver="twin", **wrong)
