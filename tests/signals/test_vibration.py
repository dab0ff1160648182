"""The level of each waveform is the one asked for, and every bad parameter is named."""

import math

import numpy as np
import pytest

from palpate.signals.vibration import VibrationError, displacement_m, read_vibration, waveform, waveform_sha256

RATE = 48_000
SINE = {"waveform": "sine", "frequency_hz": "250", "level_db": "-10", "seconds": "0.5"}
BURST = {"waveform": "burst", "frequency_hz": "200", "level_db": "6", "pulse_hz": "5", "pulse_s": "0.1"}
NOISE = {"waveform": "noise", "level_db": "-20", "low_hz": "50", "high_hz": "300", "ramp_s": "0"}
PULSES = {"waveform": "pulses", "level_db": "20", "pulse_hz": "10", "pulse_s": "0.02"}


def made(columns, rate=RATE, **changes):
    return waveform(read_vibration("a", {**columns, **changes}), rate)


def fitted(samples, hz, rate=RATE):
    """Amplitude and residual of the least-squares sine."""
    t = 2 * np.pi * hz * np.arange(len(samples)) / rate
    basis = np.stack([np.sin(t), np.cos(t)], axis=1)
    weights, *_ = np.linalg.lstsq(basis, samples, rcond=None)
    return float(np.hypot(*weights)), float(np.abs(samples - basis @ weights).max())


@pytest.mark.parametrize("hz", [3.7, 250.0, 1234.5])
def test_the_plateau_of_a_sine_has_the_amplitude_of_its_level_to_1e_9(hz):
    whole = made(SINE, frequency_hz=str(hz), ramp_s="0.05")
    amplitude, residual = fitted(whole[2400:-2400], hz)
    assert amplitude == pytest.approx(1e-6 * 10**-0.5 * (2 * math.pi * hz) ** 2, rel=1e-9)
    assert residual < 1e-9 * max(1.0, amplitude)
    rms, _ = fitted(made(SINE, frequency_hz=str(hz), reference="m_s2")[2400:-2400], hz)
    assert rms / math.sqrt(2) == pytest.approx(10**-0.5, rel=1e-9)


def test_ramps_are_raised_cosines_that_begin_and_end_in_silence():
    gains = made(SINE, ramp_s="0.1") / np.where(made(SINE, ramp_s="0") == 0, 1, made(SINE, ramp_s="0"))
    loud = np.abs(made(SINE, ramp_s="0")) > 0.1
    expected = 0.5 - 0.5 * np.cos(np.pi * np.minimum((np.arange(24_000) + 0.5) / 4800, 1))
    expected = np.minimum(expected, expected[::-1])
    assert np.allclose(gains[loud], expected[loud], atol=1e-12)


def test_a_burst_train_is_the_gated_sine_with_silence_between():
    train = made(BURST, ramp_s="0.01")
    bursts = train.reshape(5, 9600)
    assert np.array_equal(bursts[0], bursts[4]) and not bursts[:, 4800:].any()
    assert fitted(bursts[2, 480:4320], 200)[0] == pytest.approx(1e-6 * 10**0.3 * (400 * math.pi) ** 2, rel=1e-9)


@pytest.mark.parametrize("reference", ["um", "m_s2"])
def test_noise_has_its_level_in_its_band_and_depends_on_the_stimulus_alone(reference):
    noise = made(NOISE, reference=reference)
    size = np.abs(displacement_m(noise, RATE)).max() * 1e6 if reference == "um" else np.sqrt(np.mean(noise**2))
    assert size == pytest.approx(0.1, rel=1e-9)
    power = np.abs(np.fft.rfft(noise)) ** 2
    inside = power[50:301]
    assert power.sum() == pytest.approx(inside.sum(), rel=1e-12) and inside.std() < 1e-6 * inside.mean()
    other = waveform(read_vibration("b", {**NOISE, "reference": reference}), RATE)
    assert np.array_equal(noise, made(NOISE, reference=reference)) and not np.allclose(noise, other)
    assert waveform_sha256(noise) != waveform_sha256(other)


def test_a_pulse_train_has_its_peak_displacement_or_its_rms():
    train = made(PULSES)
    moved_um = 1e6 * np.cumsum(np.cumsum(train[:960])) / RATE**2
    assert moved_um.max() == pytest.approx(10.0, rel=1e-3) and abs(moved_um[-1]) < 1e-3
    rms = made(PULSES, reference="m_s2", pulse_hz="8")
    assert np.sqrt(np.mean(rms**2)) == pytest.approx(10.0, rel=1e-9)
    assert np.count_nonzero(np.diff(np.flatnonzero(train)) > 1000) == 9


@pytest.mark.parametrize("ending", ["npz", "wav"])
def test_a_file_is_played_in_its_band_at_another_rate_and_at_its_level(tmp_path, ending):
    from scipy.io import wavfile

    t = np.arange(4000) / 4000
    recorded = np.sin(2 * np.pi * 100 * t) + 5.0 + np.sin(2 * np.pi * 900 * t)
    if ending == "npz":
        np.savez(tmp_path / "a.npz", m_s2=recorded, rate_hz=4000)
    else:
        wavfile.write(tmp_path / "a.wav", 4000, recorded.astype("f4"))
    columns = {"waveform": "file", "file": f"a.{ending}", "high_hz": "500", "ramp_s": "0"}
    as_recorded = waveform(read_vibration("a", columns, tmp_path), RATE)
    assert np.allclose(as_recorded, np.sin(2 * np.pi * 100 * np.arange(RATE) / RATE), atol=1e-6)
    louder = waveform(read_vibration("a", {**columns, "level_db": "6", "reference": "m_s2"}, tmp_path), RATE)
    assert np.sqrt(np.mean(louder**2)) == pytest.approx(10**0.3, rel=1e-9)
    with pytest.raises(VibrationError, match="SHA-256 differs"):
        read_vibration("a", columns, tmp_path, "0" * 64)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({**SINE, "waveform": "sin"}, r"stimulus 'a', column 'waveform': found 'sin'; one of sine, .* 'sine'"),
        ({**SINE, "frequency_hz": ""}, "column 'frequency_hz': found nothing; a value is needed for the waveform sine"),
        ({**SINE, "level_db": "nan"}, "column 'level_db': found 'nan'; a number from -80 to 120 dB is expected"),
        ({**SINE, "level_db": "inf"}, "column 'level_db': found 'inf'"),
        ({**SINE, "seconds": "1e9"}, "column 'seconds': found '1e9'; a number from 0.001 to 60 s is expected"),
        ({**SINE, "ramp_s": "0.3"}, "column 'ramp_s': found '0.3'; two ramps within the 0.5 s are expected"),
        ({**SINE, "reference": "g"}, "column 'reference': found 'g'; one of um, m_s2 is expected"),
        ({**BURST, "pulse_s": "0.3"}, "column 'pulse_s': found '0.3'; at most 1 / pulse_hz = 0.2 s is expected"),
        ({**NOISE, "low_hz": "400"}, "column 'low_hz': found '400'; less than high_hz"),
        ({"waveform": "file", "file": "none.wav"}, "column 'file': found 'none.wav'; .* there is no file"),
    ],
)
def test_a_bad_parameter_is_named_with_stimulus_column_value_and_what_is_expected(columns, message):
    with pytest.raises(VibrationError, match=message):
        read_vibration("a", columns)


def test_a_rate_too_low_for_the_frequency_and_a_silent_file_are_refused(tmp_path):
    with pytest.raises(VibrationError, match="400 samples a second; at least 550 are expected for 250 Hz"):
        made(SINE, 400)
    np.savez(tmp_path / "a.npz", m_s2=np.zeros(100), rate_hz=1000)
    silent = read_vibration("a", {"waveform": "file", "file": "a.npz", "level_db": "1", "ramp_s": "0"}, tmp_path)
    with pytest.raises(VibrationError, match="it is silent from 20 to 500 Hz"):
        waveform(silent, RATE)
