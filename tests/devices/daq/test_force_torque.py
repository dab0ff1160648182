"""The force/torque sensor: what a scene puts on it comes out; what no sound sensor gives is a fault by name."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from palpate.devices.daq.force_torque import SAMPLE, Settings, make
from palpate.devices.daq.sensor import DaqSensor
from palpate.devices.device import FAULTS, DeviceError, DeviceFault
from tests.devices.daq.scenes import Bent, Clock, Steady, rows, run

HERE = Path()


def sensor(bend=None, zero_s=0.0, clock=None, **settings) -> tuple[DaqSensor, Clock]:
    clock = clock or Clock()
    device = make("force", Settings(kind="force_torque", driver="twin", zero_s=zero_s, **settings), HERE)
    device.elapsed_s = clock
    if bend is not None:
        device.daq = Bent(device.daq, bend)
    return device, clock


def zeroed(bend=None, **settings) -> tuple[DaqSensor, Clock]:
    """One whose twin's offsets are known and taken as its zero; its clock stands at 0."""
    device, clock = sensor(bend, **settings)
    device.open()
    device.transducer.bias_V = np.linspace(-0.5, 0.5, 6)
    return device, clock


def test_the_wrench_of_a_scene_comes_out_at_its_rate_in_newtons_and_newton_metres() -> None:
    device, clock = zeroed(noise_V=0.0, stuck_s=0)
    load = (3.0, -2.0, 20.0, 0.05, -0.04, 0.03)
    device.expect(Steady(load))
    blocks = run(device, clock, 0.5)
    data = rows(device.signals[0], blocks)
    assert (len(data), blocks[0].first, blocks[1].first) == (5000, 0, 500)
    assert [block.at_ns for block in blocks[:2]] == [50_000_000, 100_000_000]
    step = np.abs(device.transducer.matrix).sum(axis=1) * 20 / 2**16 / 2  # half a step of every gauge at once
    assert (np.abs(data - load) <= step + 1e-6).all()
    assert device.signals[0].units == ("N", "N", "N", "N m", "N m", "N m")


def test_a_frame_moves_and_turns_the_wrench_of_one_and_the_same_gauges() -> None:
    plain, _clock = zeroed(noise_V=0.0)
    framed = make(
        "force", Settings(kind="force_torque", driver="twin", frame={"dz_mm": 100, "rz_deg": 90}, noise_V=0), HERE
    )
    volts = np.linspace(-0.5, 0.5, 6) + np.linalg.inv(plain.transducer.matrix) @ [2.0, 0, 0, 0, 0, 0]
    framed.transducer.bias_V = plain.transducer.bias_V
    framed.transducer.begin()
    assert framed.transducer.rows(volts[None])[0] == pytest.approx([0, -2, 0, -0.2, 0, 0], abs=1e-9)


def test_samples_nobody_read_are_counted_as_lost_and_reported() -> None:
    device, clock = zeroed(buffer_s=0.5)
    device.start(clock.ns)
    clock.now_s = 2.0
    (block,) = device.read(0.0)["wrench"]
    assert (block.first, block.lost, block.why) == (
        15_000,
        15_000,
        "not read in time: overwritten in the card's buffer",
    )
    clock.now_s = 2.1
    (after,) = device.read(0.0)["wrench"]
    assert (after.first, after.lost, after.why) == (20_000, 0, "")


def test_its_zero_is_taken_when_it_is_opened_and_again_when_asked() -> None:
    clock = Clock()

    def ticking() -> float:
        clock.now_s += 0.01
        return clock.now_s

    device, _ = sensor(zero_s=0.5, clock=clock)
    device.elapsed_s = ticking
    device.open()
    assert device.transducer.bias_V == pytest.approx(np.linspace(-0.5, 0.5, 6), abs=2e-4)
    assert device.describe()["bias_V"] == device.transducer.bias_V.tolist()
    device.transducer.bias_V = np.zeros(6)
    device.tare(0.2)
    assert device.transducer.bias_V == pytest.approx(np.linspace(-0.5, 0.5, 6), abs=4e-4)


@pytest.mark.parametrize("moves", [lambda n: 0.3 * np.sin(n / 800), lambda n: n * 1e-5])
def test_a_zero_is_not_taken_of_what_moves(moves) -> None:
    clock = Clock()

    def ticking() -> float:
        clock.now_s += 0.01
        return clock.now_s

    def bend(volts, first):
        volts[:, 1] += moves(np.arange(first, first + len(volts)))
        return volts

    device, _ = sensor(bend, zero_s=0.5, clock=clock)
    device.elapsed_s = ticking
    with pytest.raises(DeviceError, match="force: it moved while its zero was taken: .* let the tool rest and open it"):
        device.open()
    assert not device.daq.is_open


def test_a_zero_that_no_sample_comes_for_is_refused_and_not_waited_for() -> None:
    device, _ = sensor(zero_s=0.5)
    with pytest.raises(DeviceError, match="no sample came while its zero was taken"):
        device.open()


def nan(volts, first):
    if first >= 1000:
        volts[3, 2] = np.nan
    return volts


def infinite(volts, first):
    volts[0, 0] = np.inf
    return volts


def at_the_rail(volts, first):
    volts[:, 4] = 10.0 - 20 / 2**16
    return volts


def frozen(volts, first):
    volts[:, 3] = 0.25
    return volts


def saturated(volts, first):
    if first >= 1000:
        volts[7, 4] = -10.0
    return volts


@pytest.mark.parametrize(
    ("bend", "what", "words"),
    [
        (nan, "not_a_number", "Dev1/ai2 gave nan V"),
        (infinite, "not_a_number", "Dev1/ai0 gave inf V"),
        (at_the_rail, "stuck", "Dev1/ai4 stands at the end of its range .10 V. since the start: a broken gauge"),
        (frozen, "stuck", "Dev1/ai3 has stood at 0.25 V for 0.5 s without any noise: no live sensor does so"),
        (saturated, "overload", "Dev1/ai4 stands at the end of its range .-10 V.: the load is beyond"),
    ],
)
def test_what_no_sound_sensor_gives_is_a_fault_by_name(bend, what, words) -> None:
    device, clock = zeroed(bend)
    with pytest.raises(DeviceFault, match=f"force: {words}") as caught:
        run(device, clock, 1.0)
    assert (caught.value.what, caught.value.device) == (what, "force")
    assert what in FAULTS
    device.close()


def test_loads_beyond_the_rated_are_counted_and_far_beyond_are_a_fault() -> None:
    device, clock = zeroed(noise_V=0.0005)
    device.expect(Steady(wrench_is=(0, 0, 60.0, 0, 0, 0), hz=10.0, swing=(0, 0, 15.0, 0, 0, 0)))
    run(device, clock, 0.5)
    share = np.arccos(10 / 15) / np.pi  # of a sine above 2/3 of its height
    assert device.transducer.beyond == pytest.approx(5000 * share, rel=0.02)
    device.expect(Steady(wrench_is=(0, 0, 85.0, 0, 0, 0)))
    with pytest.raises(DeviceFault, match="Fz is 121 % of its rated load .120 % is let pass.; unload") as caught:
        run(device, clock, 0.1)
    assert caught.value.what == "overload"


def test_a_sensor_that_falls_silent_is_a_fault_after_half_a_second() -> None:
    device, clock = zeroed()
    device.start(clock.ns)
    clock.now_s = 0.1
    assert device.read(0.0)["wrench"]
    device.daq.daq = None
    device.daq.pace = None
    clock.now_s = 0.5
    assert device.read(0.0)["wrench"] == ()
    clock.now_s = 0.7
    with pytest.raises(DeviceFault, match="no sample for 0.6 s") as caught:
        device.read(0.0)
    assert caught.value.what == "silent"


def test_temperature_is_compensated_where_a_thermistor_is_wired(tmp_path) -> None:
    wired = {"channel": "Dev1/ai6", "bias_slopes": [0.1] * 6, "gain_slopes": [0.05] * 6, "reference_V": 1.0}
    device, clock = zeroed(thermistor=wired, noise_V=0.0)
    assert len(device.daq.wiring.channels) == 7
    device.daq = Bent(device.daq, lambda volts, first: volts + np.r_[np.zeros(6), first * 1e-9])
    device.expect(Steady((1.0, 2.0, 3.0, 0.01, 0.02, 0.03)))
    data = rows(device.signals[0], run(device, clock, 0.2))
    assert np.abs(data - [1, 2, 3, 0.01, 0.02, 0.03]).max() < 0.01


def test_a_thermistor_without_slopes_and_a_sensor_without_a_file_are_refused() -> None:
    with pytest.raises(DeviceError, match="neither .*sample.cal nor the rig file has slopes"):
        sensor(thermistor={"channel": "Dev1/ai6"})
    with pytest.raises(DeviceError, match="force: `calibration` is missing; name the .cal file"):
        make("force", Settings(kind="force_torque", driver="nidaqmx"), HERE)


def test_a_calibration_file_lies_beside_the_rig_file(tmp_path) -> None:
    (tmp_path / "FT1.cal").write_bytes(SAMPLE.read_bytes())
    device = make("force", Settings(kind="force_torque", driver="nidaqmx", calibration="FT1.cal"), tmp_path)
    description = device.describe()
    assert description["calibration"]["serial"] == "FT00000"
    assert description["driver"] == "nidaqmx"
    assert device.transducer.calibrated == "2026-11-21"


@pytest.mark.parametrize(
    "wrong",
    [{"rate_hz": 0}, {"rate_hz": float("nan")}, {"overload": 0.5}, {"frame": {"dz": 1}}, {"colour": "red"},
     {"thermistor": {"channel": "Dev1/ai6", "bias_slopes": [1]}}, {"calibrated": "yesterday"}],
)  # fmt: skip
def test_settings_that_cannot_be_meant_are_refused(wrong) -> None:
    with pytest.raises(ValidationError):
        Settings(kind="force_torque", driver="twin", **wrong)


def test_the_kinds_are_named_without_numpy_or_a_card() -> None:
    code = (
        "import sys, palpate.devices.daq.force_torque, palpate.devices.daq.accelerometer;"
        "print([name for name in ('numpy', 'scipy', 'nidaqmx') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.strip() == "[]"
