"""Vibration stimuli: their parameters in a stimulus table, and their waveforms in m/s^2 at any rate.

A level in dB is relative to 1 um of peak displacement (`um`, as in Verrillo 1963) or to 1 m/s^2 RMS (`m_s2`). It is the
level without the ramps at the ends. Of a sine and a burst it is that of the continuous sine, so that displacement and
acceleration convert by (2 pi f)^2 exactly; of a pulse train that of the endless train; of noise and recordings that of
their samples, whose displacement is computed by the spectrum.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, cast, get_args

import numpy as np

from palpate.protocols.did_you_mean import nearest
from palpate.protocols.keyed import keyed_bits
from palpate.signals.arrays import Array
from palpate.signals.vibration_file import read_acceleration, resampled_in_band

Waveform = Literal["sine", "burst", "noise", "pulses", "file"]
Reference = Literal["um", "m_s2"]
UNITS: Mapping[Reference, str] = {"um": "dB re 1 um peak", "m_s2": "dB re 1 m/s^2 RMS"}
BOUNDS: Mapping[str, tuple[float, float, str]] = {
    "frequency_hz": (1.0, 1500.0, "Hz"),
    "level_db": (-80.0, 120.0, "dB"),
    "seconds": (0.001, 60.0, "s"),
    "ramp_s": (0.0, 10.0, "s"),
    "low_hz": (1.0, 1500.0, "Hz"),
    "high_hz": (1.0, 1500.0, "Hz"),
    "pulse_hz": (0.1, 500.0, "Hz"),
    "pulse_s": (0.0005, 10.0, "s"),
    "seed": (0.0, 2.0**53, ""),
}
"""Lowest and highest value of each column, and its unit."""
DEFAULTS: Mapping[str, float] = {"seconds": 1.0, "ramp_s": 0.02, "low_hz": 20.0, "high_hz": 500.0}
NEEDED: Mapping[Waveform, tuple[str, ...]] = {
    "sine": ("frequency_hz", "level_db"),
    "burst": ("frequency_hz", "level_db", "pulse_hz", "pulse_s"),
    "noise": ("level_db",),
    "pulses": ("level_db", "pulse_hz", "pulse_s"),
    "file": ("file",),
}
"""Columns without a default, by waveform."""
STEP_M_S2 = 1e-6
"""The digest of a waveform is over its samples in whole steps of this, so that the last digits of a machine's sines
do not change it."""


class VibrationError(ValueError):
    """A vibration that cannot be made; the message names stimulus, column, value and what is expected.

    `column` is the column that is wrong, None if no single one is.
    """

    def __init__(self, message: str, column: str | None = None) -> None:
        super().__init__(message)
        self.column = column


@dataclass(frozen=True)
class Vibration:
    """The parameters of a vibration, in SI units but for the level in dB.

    `level_db` is None only for a file that is played as strong as it was recorded. `recorded` is its acceleration in
    m/s^2, of shape (n,), at `recorded_hz`.
    """

    stimulus: str
    waveform: Waveform
    level_db: float | None
    reference: Reference = "um"
    seconds: float = 1.0
    ramp_s: float = 0.02
    frequency_hz: float = 0.0
    low_hz: float = 20.0
    high_hz: float = 500.0
    pulse_hz: float = 0.0
    pulse_s: float = 0.0
    seed: int = 0
    recorded: Array | None = field(default=None, compare=False)
    recorded_hz: float = 0.0

    @property
    def band_hz(self) -> tuple[float, float]:
        """Return the lowest and the highest frequency whose strength matters: what a calibration has to cover."""
        if self.waveform in ("sine", "burst"):
            return self.frequency_hz, self.frequency_hz
        if self.waveform == "pulses":  # cos w t - cos 2 w t during a pulse: two lines, widened by their length
            return 1 / self.pulse_s, 2 / self.pulse_s
        return self.low_hz, self.high_hz

    @property
    def spoken_level(self) -> str:
        """Return the level with its unit, for messages."""
        return "as recorded" if self.level_db is None else f"{self.level_db:g} {UNITS[self.reference]}"


def read_vibration(
    stimulus: str, columns: Mapping[str, str], folder: Path | None = None, sha256: str | None = None
) -> Vibration:
    """Return the vibration that a row of a stimulus table describes; `folder` has its file, `sha256` is the file's.

    Raises VibrationError for a value that is missing, no number or out of its range, and for a file that cannot be
    read or that is not the one with this digest.
    """
    waveform = _one_of(stimulus, columns, "waveform", get_args(Waveform), None)
    shape = cast(Waveform, waveform)
    reference = cast(Reference, _one_of(stimulus, columns, "reference", get_args(Reference), "um"))
    values = {name: _number(stimulus, columns, name) for name in BOUNDS}
    for name in NEEDED[shape]:
        if not columns.get(name, "").strip():
            raise _wrong(stimulus, name, "", f"a value is needed for the waveform {shape}")
    recorded, recorded_hz = (None, 0.0) if shape != "file" else _recording(stimulus, columns, folder, sha256)
    if values["seconds"] is None and recorded is not None:
        values["seconds"] = len(recorded) / recorded_hz
    given = {name: values[name] if values[name] is not None else DEFAULTS.get(name, 0.0) for name in BOUNDS}
    numbers = {name: float(value) for name, value in given.items() if value is not None}
    seed = values["seed"] if values["seed"] is not None else keyed_bits("vibration", stimulus) >> 204
    result = Vibration(
        stimulus, shape, values["level_db"], reference, numbers["seconds"], numbers["ramp_s"], numbers["frequency_hz"],
        numbers["low_hz"], numbers["high_hz"], numbers["pulse_hz"], numbers["pulse_s"], int(seed), recorded,
        recorded_hz,
    )  # fmt: skip
    _demand_consistent(result)
    return result


def _one_of(stimulus: str, columns: Mapping[str, str], name: str, words: tuple[str, ...], default: str | None) -> str:
    word = columns.get(name, "").strip() or default or ""
    if word not in words:
        advice = f"; {nearest(word, list(words))}" if word else ""
        raise _wrong(stimulus, name, word, f"one of {', '.join(words)} is expected{advice}")
    return word


def _number(stimulus: str, columns: Mapping[str, str], name: str) -> float | None:
    """Return the number in a column, or None where it is empty or missing."""
    text = columns.get(name, "").strip()
    if not text:
        return None
    low, high, unit = BOUNDS[name]
    expected = f"a number from {low:g} to {high:g}{' ' + unit if unit else ''} is expected"
    try:
        value = float(text)
    except ValueError:
        raise _wrong(stimulus, name, text, expected) from None
    if not low <= value <= high:  # NaN is not within, either
        raise _wrong(stimulus, name, text, expected)
    return value


def _recording(
    stimulus: str, columns: Mapping[str, str], folder: Path | None, sha256: str | None
) -> tuple[Array, float]:
    name = columns.get("file", "").strip()
    if not name:
        raise _wrong(stimulus, "file", "", "a WAV or npz file in the study's folder is needed for the waveform file")
    try:
        return read_acceleration((folder or Path()) / name, sha256)
    except ValueError as error:
        raise _wrong(stimulus, "file", name, str(error)) from None


def _demand_consistent(vibration: Vibration) -> None:
    """Raise VibrationError where two columns contradict each other."""
    name, seconds = vibration.stimulus, vibration.seconds
    if 2 * vibration.ramp_s > seconds:
        raise _wrong(name, "ramp_s", f"{vibration.ramp_s:g}", f"two ramps within the {seconds:g} s are expected")
    if vibration.waveform in ("noise", "file") and not vibration.low_hz < vibration.high_hz:
        raise _wrong(name, "low_hz", f"{vibration.low_hz:g}", f"less than high_hz ({vibration.high_hz:g}) is expected")
    if vibration.waveform == "noise" and (vibration.high_hz - vibration.low_hz) * seconds < 1:
        raise _wrong(name, "seconds", f"{seconds:g}", "a band times a duration of at least 1 is expected")
    if vibration.waveform in ("burst", "pulses"):
        if vibration.pulse_s * vibration.pulse_hz > 1:
            most = f"at most 1 / pulse_hz = {1 / vibration.pulse_hz:g} s is expected, or pulses overlap"
            raise _wrong(name, "pulse_s", f"{vibration.pulse_s:g}", most)
        if vibration.pulse_s > seconds:
            raise _wrong(name, "pulse_s", f"{vibration.pulse_s:g}", f"at most `seconds` ({seconds:g}) is expected")
    if vibration.waveform == "burst" and 2 * vibration.ramp_s > vibration.pulse_s:
        whole = f"two ramps within the pulse of {vibration.pulse_s:g} s are expected"
        raise _wrong(name, "ramp_s", f"{vibration.ramp_s:g}", whole)
    if vibration.recorded is not None and seconds * vibration.recorded_hz > len(vibration.recorded) + 0.5:
        there = len(vibration.recorded) / vibration.recorded_hz
        raise _wrong(name, "seconds", f"{seconds:g}", f"at most the {there:g} s of the file are expected")


def _wrong(stimulus: str, column: str, value: str, expected: str) -> VibrationError:
    found = repr(value) if value else "nothing"
    return VibrationError(f"stimulus {stimulus!r}, column {column!r}: found {found}; {expected}", column)


def waveform(vibration: Vibration, rate_hz: float) -> Array:
    """Return the acceleration in m/s^2, of shape (n,) with n = round(seconds x rate), with its ramps.

    Raises VibrationError if the rate is too low for its highest frequency (it has to be above 2.2 times that).
    """
    top = vibration.band_hz[1]
    if not math.isfinite(rate_hz) or rate_hz < 2.2 * top:
        found, expected = f"{rate_hz:g} samples a second", f"at least {2.2 * top:g} are expected for {top:g} Hz"
        raise VibrationError(f"stimulus {vibration.stimulus!r}: {found}; {expected}")
    count = max(1, round(vibration.seconds * rate_hz))
    t_s = np.arange(count) / rate_hz
    match vibration.waveform:
        case "sine":
            return amplitude_m_s2(vibration) * _sine(vibration, t_s) * ramps(count, vibration.ramp_s * rate_hz)
        case "burst":
            return amplitude_m_s2(vibration) * _burst(vibration, t_s, rate_hz)
        case "pulses":
            return _pulses(vibration, t_s)
    if vibration.waveform == "noise":
        steady = _noise(vibration, count, rate_hz)
    else:
        recorded = np.zeros(0) if vibration.recorded is None else vibration.recorded
        part = recorded[: max(2, round(vibration.seconds * vibration.recorded_hz))]
        steady = resampled_in_band(part, count, rate_hz, vibration.low_hz, vibration.high_hz)
    return steady * _gain(vibration, steady, rate_hz) * ramps(count, vibration.ramp_s * rate_hz)


def amplitude_m_s2(vibration: Vibration) -> float:
    """Return the peak acceleration of the continuous sine of a sine or burst, in m/s^2."""
    size = float(10 ** ((vibration.level_db or 0.0) / 20))
    if vibration.reference == "m_s2":
        return size * math.sqrt(2)
    return size * 1e-6 * (2 * math.pi * vibration.frequency_hz) ** 2


def ramps(count: int, ramp: float) -> Array:
    """Return gains of `count` samples that rise and fall along a raised cosine of `ramp` samples."""
    place = np.minimum(np.arange(count), np.arange(count)[::-1]) + 0.5
    gains: Array = 0.5 - 0.5 * np.cos(np.pi * np.minimum(place / max(ramp, 0.5), 1.0))
    return gains


def _sine(vibration: Vibration, t_s: Array) -> Array:
    return np.asarray(np.sin(2 * np.pi * vibration.frequency_hz * t_s), np.float64)


def _burst(vibration: Vibration, t_s: Array, rate_hz: float) -> Array:
    """Return the gated sine of amplitude 1: every burst begins at phase 0 with ramps of its own; the last is whole."""
    made = np.zeros(len(t_s))
    length = max(1, round(vibration.pulse_s * rate_hz))
    one = _sine(vibration, t_s[:length]) * ramps(length, vibration.ramp_s * rate_hz)
    number = 0
    while (first := round(number / vibration.pulse_hz * rate_hz)) + length <= len(t_s):
        made[first : first + length] = one
        number += 1
    return made


def _pulses(vibration: Vibration, t_s: Array) -> Array:
    """Return pulses of the displacement D sin^4(pi t / T), which begin and end without a step of the acceleration.

    The acceleration is D w^2 / 2 (cos w t - cos 2 w t) with w = 2 pi / T, and its mean square over the train D^2 w^4 T
    / 4 times the pulses per second.
    """
    w = 2 * math.pi / vibration.pulse_s
    size = float(10 ** ((vibration.level_db or 0.0) / 20))
    if vibration.reference == "um":
        peak_m = size * 1e-6
    else:
        peak_m = size / (w**2 * math.sqrt(vibration.pulse_s * vibration.pulse_hz / 4))
    number = np.floor(t_s * vibration.pulse_hz + 1e-9)
    since = t_s - number / vibration.pulse_hz
    last = (number / vibration.pulse_hz + vibration.pulse_s) <= len(t_s) * (t_s[1] if len(t_s) > 1 else 1.0) + 1e-9
    made = 0.5 * peak_m * w**2 * (np.cos(w * since) - np.cos(2 * w * since))
    return np.where((since <= vibration.pulse_s) & last, made, 0.0)


def _noise(vibration: Vibration, count: int, rate_hz: float) -> Array:
    """Return lines of equal amplitude and random phase in the band: exactly flat, and the same on every machine."""
    hz = np.fft.rfftfreq(count, 1 / rate_hz)
    inside = (hz >= vibration.low_hz) & (hz <= vibration.high_hz)
    if not inside.any():
        raise _wrong(vibration.stimulus, "high_hz", f"{vibration.high_hz:g}", "a wider or longer band is expected")
    turns = np.random.PCG64(vibration.seed).random_raw(int(inside.sum())) / 2.0**64
    lines = np.zeros(len(hz), dtype=np.complex128)
    lines[inside] = np.exp(2j * np.pi * turns)
    return np.asarray(np.fft.irfft(lines, count), np.float64)


def displacement_m(acceleration: Array, rate_hz: float, lowest_hz: float = 1.0) -> Array:
    """Return the displacement of an acceleration by its spectrum, without what lies below `lowest_hz`.

    The signal counts as one period, so both ends should be at rest or meet.
    """
    hz = np.fft.rfftfreq(len(acceleration), 1 / rate_hz)
    lines = np.fft.rfft(acceleration)
    inside = hz >= min(lowest_hz, hz[-1])
    lines[~inside] = 0.0
    lines[inside] /= -((2 * np.pi * hz[inside]) ** 2)
    return np.asarray(np.fft.irfft(lines, len(acceleration)), np.float64)


def _gain(vibration: Vibration, steady: Array, rate_hz: float) -> float:
    """Return the factor that gives the steady waveform its level."""
    if vibration.level_db is None:
        return 1.0
    if vibration.reference == "m_s2":
        size = float(np.sqrt(np.mean(steady**2)))
    else:
        size = float(np.abs(displacement_m(steady, rate_hz, vibration.low_hz)).max()) / 1e-6
    if not size > 0:
        band = f"{vibration.low_hz:g} to {vibration.high_hz:g} Hz"
        raise VibrationError(f"stimulus {vibration.stimulus!r}: it is silent from {band}, so it has no level")
    return float(10 ** (vibration.level_db / 20) / size)


def waveform_sha256(samples: Array) -> str:
    """Return the SHA-256 of a waveform: of its samples in whole micro-m/s^2, as little-endian 64-bit numbers."""
    return hashlib.sha256(np.rint(samples / STEP_M_S2).astype("<i8").tobytes()).hexdigest()
