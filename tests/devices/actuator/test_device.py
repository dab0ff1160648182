"""The voice coil: fed ahead, within bounds, silent after anything goes wrong, and flat with a calibration."""

import numpy as np
import pytest
from pydantic import ValidationError

from palpate.devices.actuator.calibration import save
from palpate.devices.actuator.identify import identify
from palpate.devices.actuator.outputs import Shaken
from palpate.devices.actuator.settings import Settings
from palpate.devices.device import DeviceFault
from tests.devices.actuator.benches import Clock, coil


def play(device, clock, samples):
    """Feed the coil as its room allows, 5 ms at a time; what was played and felt."""
    device.start()
    rest = np.asarray(samples, dtype=float)
    while len(rest):
        part, rest = rest[: device.room], rest[device.room :]
        device.write(part)
        clock.s += 0.005
        device.output.advance()
    device.rest()
    clock.s += 0.1
    device.output.advance()
    return device.output.whole()


def test_what_is_written_is_played_to_the_sample_while_it_is_fed_ahead():
    clock = Clock()
    device = coil(clock)
    sent = 0.3 * np.sin(np.arange(2000) / 4)
    played, _ = play(device, clock, sent)
    first = int(np.flatnonzero(played)[0])
    assert np.allclose(played[first : first + 1999], sent[1:])
    assert device.record() == {"underruns": 0, "missing": 0, "limited": 0, "faults": []}


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), float("-inf")])
def test_what_is_no_number_silences_the_coil_within_5_ms_and_is_named(bad):
    clock = Clock()
    device = coil(clock)
    device.start()
    device.write(np.full(15, 0.5))
    clock.s = 0.005
    with pytest.raises(DeviceFault, match="sample 1 of 3 is (nan|inf|-inf): the output was silenced") as failed:
        device.write([0.5, bad, 0.5])
    assert failed.value.what == "not_a_number"
    clock.s = 0.1
    device.output.advance()
    played = device.output.whole()[0]
    assert np.all(played[:5] == 0.5) and not played[9:].any()
    with pytest.raises(DeviceFault, match="nothing is played before start"):
        device.write([0.1])
    device.start()
    assert device.write([0.1]) == 19


def test_safe_is_silent_within_5_ms_without_a_click_and_close_may_follow_twice():
    clock = Clock()
    device = coil(clock, ahead_ms=100)
    device.start()
    device.write(np.full(100, 0.6))
    clock.s = 0.030
    device.output.advance()
    device.safe()
    clock.s = 0.060
    device.output.advance()
    played = device.output.whole()[0]
    assert np.all(played[:30] == 0.6) and not played[34:].any()
    assert np.abs(np.diff(played)).max() < 0.36 * 0.6
    device.close()
    device.close()


def test_a_feeder_that_is_late_is_an_underrun_on_record_and_no_click():
    clock = Clock()
    device = coil(clock)
    device.start()
    device.write(np.full(10, 0.5))
    clock.s = 0.050
    device.write(np.full(10, -0.2))
    clock.s = 0.060
    device.output.advance()
    assert device.record()["underruns"] == 1 and device.record()["missing"] == 40
    assert np.abs(np.diff(device.output.whole()[0][:49])).max() < 0.2 + 1e-9


def test_more_than_fits_is_a_fault_and_not_lost_without_a_word():
    device = coil(Clock())
    device.start()
    with pytest.raises(DeviceFault, match="21 samples were written where 20 fit") as caught:
        device.write(np.zeros(21))
    assert caught.value.what == "overrun"


def test_beyond_the_limits_the_output_is_turned_down_and_counted():
    clock = Clock()
    device = coil(clock, peak_V=1.0, rms_V=0.2)
    played, _ = play(device, clock, 4.0 * np.sin(np.arange(5000) / 4))
    assert np.abs(played).max() <= 1.0
    assert np.sqrt(np.mean(played[3000:5000] ** 2)) <= 0.2 * 1.01
    assert device.record()["limited"] > 4000


def test_a_calibrated_coil_gives_the_wished_acceleration(tmp_path):
    save(identify(lambda volts: (Shaken().felt(volts), 1000)).calibration("2026-11-21"), tmp_path / "coil.json")
    gains = []
    for hz in (25, 60, 150, 440):
        clock = Clock()
        device = coil(clock, tmp_path, calibration="coil.json", rms_V=1.0, peak_V=2.0)
        _, felt = play(device, clock, 2.0 * np.sin(2 * np.pi * hz * np.arange(2000) / 1000))
        gains.append(np.sqrt(np.mean(felt[1000:1900] ** 2)) / (2.0 / np.sqrt(2)))
    assert np.abs(20 * np.log10(gains)).max() < 0.6
    assert device.describe()["response"].startswith("identified 2026-11-21, flat within")


def test_wishes_beyond_the_limit_of_acceleration_are_held_to_it(tmp_path):
    save(identify(lambda volts: (Shaken().felt(volts), 1000)).calibration("2026-11-21"), tmp_path / "coil.json")
    felt = []
    for wish in (5.0, 500.0):
        clock = Clock()
        device = coil(clock, tmp_path, calibration="coil.json", peak_m_s2=5.0)
        felt.append(play(device, clock, wish * np.sign(np.sin(np.arange(500) / 3)))[1])
    assert np.array_equal(felt[0], felt[1])
    assert device.record()["limited"] >= 490


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"rms_V": 0.9, "peak_V": 0.5}, r"rms_V \(0.9\) must not be above peak_V"),
        ({"driver": "sound", "peak_V": 2.0}, "what the sound card gives at full scale"),
        ({"channel": "Dev1/ai0"}, "should match pattern"),
        ({"peak_V": float("inf")}, "less than or equal to 10"),
        ({"ahead_ms": 1}, "greater than or equal to 5"),
        ({"amplitude": 1}, "Extra inputs"),
    ],
)
def test_settings_that_make_no_sense_are_refused(given, message):
    with pytest.raises(ValidationError, match=message):
        Settings(**{"kind": "voice_coil", "driver": "twin", **given})
