"""Figures of the voice coil: what its twin's hand feels against the command, with and without the filter."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from palpate.devices.actuator.compensation import Compensation
from palpate.devices.actuator.device import VoiceCoil, make
from palpate.devices.actuator.identify import Shaking, Wish, identify, invert
from palpate.devices.actuator.outputs import Coil, Shaken
from palpate.devices.actuator.queue import RATE_HZ
from palpate.devices.actuator.response import Response
from palpate.devices.actuator.settings import Settings
from palpate.protocols.bench import Case
from palpate.signals.arrays import Array

AREA = "actuator"
LOW_HZ, HIGH_HZ = 20, 450
LEVEL_M_S2 = 3.0
"""RMS of the commanded acceleration: lines 1 Hz apart over the band, so that every second is equal."""
SETTLED_S = 2
PART = 20
"""Number of samples per write."""
SEED = 7


def cases(quick: bool) -> Iterator[Case]:
    """Yield cases that repeat a second of vibration; the error is taken over the seconds after the first two."""
    seconds = SETTLED_S + (2 if quick else 10)
    wished = commanded_signal(seconds)
    median = float(np.median(np.abs(true_response(Coil()).response)))
    filters = {
        "no filter, median gain": np.array([1 / median]),
        "filter of the true response": invert(true_response(Coil()), Wish()).taps,
        "palpate, identified by shaking": identify_twin(),
    }
    for method, taps in filters.items():
        yield Case(
            AREA, "voice coil: strength by frequency", method, f"{seconds} s, {LOW_HZ} to {HIGH_HZ} Hz", len(wished),
            "dB RMS over the lines", partial(play_through_twin, taps, wished), partial(strength_error_dB, wished), 3,
        )  # fmt: skip
    ways = {"palpate, 8 s of multisine": identify_twin,
            "filter of the true response": lambda: invert(true_response(Coil()), Wish()).taps}  # fmt: skip
    for method, run in ways.items():
        yield Case(AREA, "voice coil: identification", method, "twin with sensor noise", 8 * RATE_HZ,
                   "dB at most, filter and coil against flat", run, ripple_dB, 3)  # fmt: skip


def commanded_signal(seconds: int) -> Array:
    """Return acceleration at 1 kHz that repeats every second: all lines of the band with random phases."""
    lines = np.zeros(RATE_HZ // 2 + 1, dtype=np.complex128)
    turns = np.random.PCG64(SEED).random_raw(HIGH_HZ - LOW_HZ + 1) / 2.0**64
    lines[LOW_HZ : HIGH_HZ + 1] = np.exp(2j * np.pi * turns)
    second = np.fft.irfft(lines, RATE_HZ)
    return np.tile(second * (LEVEL_M_S2 / float(np.sqrt(np.mean(second**2)))), seconds)


def play_through_twin(taps: Array, wished: Array) -> Array:
    """Play through the device and its twin; return what is felt, in m/s^2, as long as the commanded signal."""
    clock = [0.0]
    settings = Settings(kind="voice_coil", driver="twin", peak_V=10.0, rms_V=10.0)
    coil: VoiceCoil = make("coil", settings, Path(), lambda: clock[0])
    coil.open()
    coil.compensation = Compensation(taps, settings.peak_m_s2)
    coil.start()
    for at in range(0, len(wished), PART):
        coil.write(wished[at : at + PART])
        clock[0] += PART / RATE_HZ
        coil.check()
    felt: Array = coil.output.whole()[1]  # type: ignore[attr-defined]
    return felt


def strength_error_dB(wished: Array, felt: Array) -> float:
    """Return how far each line's strength lies from the commanded one in dB, RMS over lines and seconds.

    Phases do not count: a hand feels a vibration's strength, and the filter has the least delay (`invert`).
    """
    sizes = [np.abs(np.fft.rfft(signal.reshape(-1, RATE_HZ)[SETTLED_S:]))[:, LOW_HZ : HIGH_HZ + 1]
             for signal in (wished, felt)]  # fmt: skip
    return float(np.sqrt(np.mean((20 * np.log10(sizes[1] / sizes[0])) ** 2)))


def true_response(coil: Coil) -> Response:
    """Return the twin's own response, without noise."""
    hz = np.arange(5, 491).astype(np.float64)
    turns = np.exp(-2j * np.pi * hz / RATE_HZ)
    over, under = (np.polynomial.polynomial.polyval(turns, weights) for weights in coil.weights())
    nothing = np.zeros(len(hz))
    return Response(hz, over / under, nothing + 1.0, nothing, nothing)


def identify_twin() -> Array:
    """Return the filter identified by shaking the noisy twin."""
    shaken = Shaken(Coil(), seed=SEED)
    return identify(lambda volts: (shaken.felt(volts), RATE_HZ), Shaking()).inverse.taps


def ripple_dB(taps: Array) -> float:
    """Return the largest deviation of filter and true coil together from their mean level, in dB."""
    true = true_response(Coil())
    inside = true.inside(LOW_HZ, HIGH_HZ)
    turns = np.exp(-2j * np.pi * true.hz[inside] / RATE_HZ)
    whole = 20 * np.log10(np.abs(true.response[inside] * np.polynomial.polynomial.polyval(turns, taps)))
    return float(np.abs(whole - whole.mean()).max())
