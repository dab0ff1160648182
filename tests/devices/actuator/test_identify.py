"""The response that shaking finds, the filter that makes it flat, and recordings that neither can be had from."""

import json

import numpy as np
import pytest

from palpate.devices.actuator.calibration import load, save
from palpate.devices.actuator.identify import Shaking, Wish, gain_at, identify, minimum_phase, through
from palpate.devices.actuator.outputs import Coil, Shaken
from palpate.devices.actuator.response import ResponseError, estimate, excitation
from palpate.devices.device import DeviceError, DeviceFault
from tests.devices.actuator.benches import Accelerometer, Clock, coil

BAND = (20.0, 450.0)


def twin(actuator=None, spoilt=lambda felt: felt):
    return lambda volts: (spoilt(Shaken(actuator or Coil()).felt(volts)), 1000)


def true_response(actuator, hz):
    b, a = actuator.weights()
    z = np.exp(-2j * np.pi * hz / 1000)
    return np.polyval(b[::-1], z) / np.polyval(a[::-1], z)


def decibels(ratio):
    return np.abs(20 * np.log10(np.abs(ratio)))


@pytest.mark.parametrize(("kind", "within"), [("multisine", 0.2), ("sweep", 0.6)])
def test_the_estimated_response_is_the_twins(kind, within):
    estimated = identify(twin(), Shaking(kind)).response
    inside = estimated.inside(*BAND)
    assert decibels(estimated.response / true_response(Coil(), estimated.hz))[inside].max() < within
    assert np.all(estimated.coherence <= 1) and np.median(estimated.coherence[inside]) > 0.99


def test_without_noise_the_response_is_exact_and_h1_and_h2_agree():
    quiet = Coil(noise_m_s2=0.0)
    estimated = identify(twin(quiet)).response
    inside = estimated.inside(*BAND)
    assert np.abs(estimated.response / true_response(quiet, estimated.hz) - 1)[inside].max() < 1e-6
    assert estimated.apart_dB[inside].max() < 1e-6


def test_the_standard_error_covers_the_error():
    noisy = Coil(noise_m_s2=0.2)
    estimated = identify(twin(noisy)).response
    inside = estimated.inside(30.0, 450.0)
    off = np.abs(estimated.response - true_response(noisy, estimated.hz))[inside] / estimated.error[inside]
    assert 1.0 < np.sqrt(np.mean(off**2)) < 2.0


@pytest.mark.parametrize(
    ("actuator", "before", "ripple"),
    [(Coil(), 18.0, 0.6), (Coil(resonance_Hz=45, damping=0.05), 19.5, 0.6), (Coil(delay=40), 18.0, 0.6)],
)
def test_the_compensated_actuator_is_flat_and_no_later_than_before(actuator, before, ripple):
    result = identify(twin(actuator))
    inside = result.response.inside(*BAND)
    hz = result.response.hz[inside]
    reached = true_response(actuator, hz) * gain_at(result.inverse.taps, hz)
    assert result.inverse.before_dB > before
    assert decibels(reached).max() < ripple and result.inverse.ripple_dB < ripple
    assert abs(result.inverse.added_ms) < 1.0
    assert result.inverse.delay_ms == pytest.approx(actuator.delay, abs=1.0)


def test_where_the_coil_hardly_moves_the_gain_is_limited_and_the_lines_are_named():
    inverse = identify(twin(Coil(resonance_Hz=150, damping=0.1)), wish=Wish(boost_dB=20.0)).inverse
    gains = np.abs(gain_at(inverse.taps, np.arange(0, 500, 0.5))) * inverse.gain
    assert 20 * np.log10(gains.max()) <= 20.0 + 1e-6
    assert inverse.limited_Hz[0] == 20.0 and inverse.limited_Hz[-1] < 60.0
    assert inverse.ripple_dB > 10


def test_a_notch_is_not_filled_beyond_the_limit():
    def notched(volts):
        from scipy.signal import iirnotch, lfilter

        return lfilter(*iirnotch(200, 20, fs=1000), Shaken(Coil(noise_m_s2=0.001)).felt(volts)), 1000

    inverse = identify(notched, wish=Wish(boost_dB=12.0)).inverse
    gains = np.abs(gain_at(inverse.taps, np.arange(0, 500, 0.5))) * inverse.gain
    assert gains.max() <= 10 ** (12 / 20) + 1e-9
    assert any(195 <= hz <= 205 for hz in inverse.limited_Hz)


def test_the_minimum_phase_filter_has_the_wished_gain_and_all_its_zeros_inside():
    grid = np.arange(2049) * 1000 / 4096
    gain = 1 + 3 * np.exp(-(((grid - 120) / 40) ** 2))
    taps = minimum_phase(gain)
    assert decibels(np.fft.rfft(taps, 4096) / gain).max() < 0.01
    assert np.abs(np.roots(np.trim_zeros(taps[:128]))).max() < 1.02


def clipped(felt):
    return np.clip(felt, -3.0, 3.0)


def first_is_nan(felt):
    return np.where(np.arange(len(felt)) == 4711, np.nan, felt)


@pytest.mark.parametrize(
    ("spoilt", "message"),
    [
        (np.zeros_like, "silent: is the sensor on the actuator"),
        (lambda felt: np.full_like(felt, 9.81), "silent"),
        (clipped, r"clipped: \d+\.\d % of its samples lie at -3 or 3"),
        (first_is_nan, "a value that is not a number, first at sample 4711"),
        (lambda felt: felt[:-7], "12.243 s were recorded at 1000 Hz, 12.250 s were played"),
        (lambda felt: np.random.default_rng(1).normal(size=len(felt)), "does not follow what was played: 100 %"),
        (lambda felt: felt + np.random.default_rng(1).normal(size=len(felt)) * 20, "coherence below 0.8"),
    ],
)
def test_an_uninformative_recording_is_refused_with_the_reason(spoilt, message):
    with pytest.raises(ResponseError, match=message):
        identify(twin(spoilt=spoilt))


def test_too_few_periods_are_refused_since_coherence_would_say_nothing():
    played = excitation("multisine", 0.5, 1, measured=2)
    with pytest.raises(ResponseError, match="2 periods were measured, at least 4"):
        estimate(played, Shaken().felt(played.samples))


def test_distortion_shows_as_a_loss_of_coherence():
    def bent(felt):
        return felt + 0.01 * felt**2

    straight, curved = (identify(twin(spoilt=spoil), Shaking(measured=8)).response for spoil in (lambda x: x, bent))
    inside = straight.inside(30, 450)
    assert np.median(curved.coherence[inside]) < np.median(straight.coherence[inside]) - 0.001


@pytest.mark.long
def test_the_response_is_the_same_through_the_device_and_a_sensor_at_its_own_rate(tmp_path):
    clock = Clock()
    shaken = coil(clock, ahead_ms=50)
    sensor = Accelerometer(shaken, clock)
    result = identify(through(shaken, sensor, clock.ns))
    hold = np.sinc(result.response.hz / 3000) / np.sinc(result.response.hz / 1000)
    inside = result.response.inside(*BAND)
    truth = np.abs(true_response(Coil(), result.response.hz))
    factor = np.abs(result.response.response)[inside] / truth[inside] * hold[inside]
    assert np.ptp(20 * np.log10(factor)) < 1.0
    assert shaken.record()["underruns"] == 0 and not shaken.record()["faults"]
    save(result.calibration("2026-11-21"), tmp_path / "coil.json")
    used = coil(Clock(), tmp_path, calibration="coil.json")
    assert used.unit == "m/s^2"
    assert "identified 2026-11-21, flat within" in used.health(0.0).summary


def test_a_sensor_that_stays_silent_ends_the_wait_and_the_coil_is_safe():
    clock = Clock()
    shaken = coil(clock)

    class Dead(Accelerometer):
        def read(self, timeout_s):
            self.clock.s += timeout_s
            return {}

    with pytest.raises(DeviceFault, match="0 of 36750 recorded in time"):
        identify(through(shaken, Dead(shaken, clock), clock.ns))
    clock.s += 1.0
    shaken.output.advance()
    assert not shaken.output.whole()[0][-900:].any()


@pytest.mark.parametrize(
    ("chosen", "message"),
    [
        ({"peak_V": 0.3, "rms_V": 0.3, "ahead_ms": 50}, "samples were limited to what"),
        ({"ahead_ms": 5}, "came too late"),
    ],
)
def test_an_excitation_that_was_not_played_as_it_was_meant_identifies_nothing(chosen, message):
    clock = Clock()
    shaken = coil(clock, **chosen)

    class Slow(Accelerometer):
        def read(self, timeout_s):
            return super().read(0.008)

    with pytest.raises(ResponseError, match=message):
        identify(through(shaken, Slow(shaken, clock), clock.ns))


@pytest.mark.long
def test_a_clipped_axis_is_detected_before_the_axes_are_combined():
    clock = Clock()
    shaken = coil(clock, ahead_ms=50)
    sensor = Accelerometer(shaken, clock, spoilt=lambda rows: np.clip(rows, -1.0, 11.0))
    with pytest.raises(ResponseError, match="clipped"):
        identify(through(shaken, sensor, clock.ns))


def spoil(path, **changes):
    whole = json.loads(path.read_text())
    path.write_text(json.dumps({**whole, **changes}))


def test_a_calibration_comes_back_as_it_was_saved_and_a_spoilt_one_is_refused_by_name(tmp_path):
    path = tmp_path / "coil.json"
    calibration = identify(twin()).calibration("2026-11-21")
    save(calibration, path)
    assert load(path) == calibration
    spoil(path, coherence=[1.0])
    with pytest.raises(DeviceError, match=r"coil\.json: no voice coil calibration: .*one value per line"):
        load(path)
    save(calibration, path)
    path.write_text(path.read_text().replace('"gain_m_s2_V": ', '"gain_m_s2_V": NaN, "was": '))
    with pytest.raises(DeviceError, match="gain_m_s2_V"):
        load(path)
    with pytest.raises(DeviceError, match=r"other\.json: the voice coil's calibration cannot be read: No such file"):
        load(tmp_path / "other.json")
