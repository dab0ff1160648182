"""The excitation of an actuator, and its frequency response from a recording, with errors if there is none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from palpate.devices.actuator.queue import RATE_HZ
from palpate.devices.device import DeviceError
from palpate.signals.arrays import Array, Complex

FEWEST = 4
"""Fewest periods for coherence to be meaningful: unrelated noise alone has 1 over their number."""
AT_REST = 1e-9
CLIPPED_SHARE = 0.002
"""Share of the samples that may have the largest or smallest value: one in 500. A clipped recording has far more."""
COHERENT, INCOHERENT_SHARE = 0.8, 0.1
Kind = Literal["multisine", "sweep"]
PERIOD = RATE_HZ
"""Samples of one period: lines are 1 Hz apart."""
LOWEST_HZ, HIGHEST_HZ = 5, 490


class ResponseError(DeviceError):
    """A recording from which no response can be estimated; the message says why."""


@dataclass(frozen=True)
class Response:
    """The response at `hz` in units recorded per volt, its coherence, and its standard error in the same units.

    `response` is the H1 estimate (noise in the recording does not bias it); `apart_dB` is how far H2 lies from it.
    """

    hz: Array
    response: Complex
    coherence: Array
    error: Array
    apart_dB: Array

    def inside(self, low_Hz: float, high_Hz: float) -> NDArray[np.bool_]:
        """Return a mask of the lines within a band."""
        return (self.hz >= low_Hz) & (self.hz <= high_Hz)


def demand_signal(recorded: Array) -> None:
    """Raise ResponseError if a recording is empty, not finite, silent or clipped."""
    if not np.all(np.isfinite(recorded)):
        where = int(np.flatnonzero(~np.isfinite(recorded))[0])
        raise ResponseError(
            f"the recording holds a value that is not a number, first at sample {where}: check the sensor's cable"
        )
    if len(recorded) == 0 or float(np.ptp(recorded)) <= AT_REST:
        raise ResponseError("the recording is silent: is the sensor on the actuator, and the amplifier on?")
    ends = (recorded >= recorded.max() - AT_REST) | (recorded <= recorded.min() + AT_REST)
    if float(ends.mean()) > CLIPPED_SHARE:
        share = f"{100 * ends.mean():.1f} % of its samples lie at {recorded.min():.4g} or {recorded.max():.4g}"
        raise ResponseError(f"the recording is clipped: {share}. Lower the level or widen the sensor's range")


def estimate(played: Excitation, recorded: Array, rate_hz: int = RATE_HZ) -> Response:
    """Return H1 = Sxy / Sxx, H2 = Syy / Syx and coherence over the measured periods, at the excited lines.

    The recording may have another integer rate: periods of one second have the same lines in both, so nothing is
    resampled. Raises ResponseError for different lengths, fewer than four periods, or no signal.
    """
    if len(recorded) != len(played) * rate_hz // RATE_HZ:
        raise ResponseError(
            f"{len(recorded) / rate_hz:.3f} s were recorded at {rate_hz} Hz, {len(played) / RATE_HZ:.3f} s were played"
        )
    if len(played.begins) < FEWEST:
        raise ResponseError(f"{len(played.begins)} periods were measured, at least {FEWEST} are needed")
    demand_signal(recorded)
    x = _spectra(played.samples, played.begins, RATE_HZ)
    y = _spectra(recorded - recorded.mean(), played.begins, rate_hz)
    s_xx, s_yy = np.mean(np.abs(x) ** 2, axis=0), np.mean(np.abs(y) ** 2, axis=0)
    s_xy = np.mean(np.conj(x) * y, axis=0)
    lines = slice(LOWEST_HZ, HIGHEST_HZ + 1)
    hz = np.arange(LOWEST_HZ, HIGHEST_HZ + 1, dtype=np.float64)
    return _response(hz, s_xx[lines], s_yy[lines], s_xy[lines], len(played.begins))


def _response(hz: Array, s_xx: Array, s_yy: Array, s_xy: Complex, count: int) -> Response:
    """Return the response with its standard errors.

    The variance of |H1| is (1 - coherence) |H1|^2 / (2 coherence n). Source: Bendat and Piersol, Random Data (2010),
    9.1.
    """
    tiny = np.finfo(float).tiny
    coherence = np.minimum(np.abs(s_xy) ** 2 / np.maximum(s_xx * s_yy, tiny), 1.0)
    h1 = s_xy / s_xx
    spread = np.sqrt((1 - coherence) / (2 * np.maximum(coherence, tiny) * count))
    apart = -10 * np.log10(np.maximum(coherence, tiny))
    return Response(hz, h1, coherence, np.abs(h1) * spread, apart)


def _spectra(samples: Array, begins: tuple[int, ...], rate_hz: int) -> Complex:
    """Return the lines from 0 to 500 Hz of each measured second."""
    firsts = [first * rate_hz // RATE_HZ for first in begins]
    periods = [np.fft.rfft(samples[first : first + rate_hz]) / rate_hz for first in firsts]
    return np.array(periods)[:, : PERIOD // 2 + 1]


def demand_coherence(response: Response, low_Hz: float, high_Hz: float) -> None:
    """Raise ResponseError if more than a tenth of the band's lines have a coherence below 0.8."""
    inside = response.inside(low_Hz, high_Hz)
    coherence, hz = response.coherence[inside], response.hz[inside]
    poor = coherence < COHERENT
    if len(hz) == 0 or float(poor.mean()) > INCOHERENT_SHARE:
        worst = f", {coherence.min():.2f} at {hz[coherence.argmin()]:.0f} Hz" if len(hz) else ""
        share = f"{100 * poor.mean() if len(hz) else 100:.0f} % of the lines from {low_Hz:g} to {high_Hz:g} Hz"
        raise ResponseError(
            f"what was recorded does not follow what was played: {share} have a coherence below {COHERENT}{worst}. "
            "Raise the level, fasten the sensor, and let nothing else shake it"
        )


@dataclass(frozen=True)
class Excitation:
    """Samples at 1 kHz in volts, and where the measured periods begin, by which time the response has settled."""

    samples: Array
    begins: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.samples)


def excitation(kind: Kind, level_V: float, seed: int, measured: int = 8) -> Excitation:
    """Return `measured` periods of 1 s that peak at `level_V`, each of lines from 5 to 490 Hz.

    A multisine has random phases, new ones in every pair of periods, so that distortion shows as a loss of coherence; a
    sweep is the same logarithmic sweep throughout. An extra period that is not measured comes first.
    """
    pairs = [_multisine(seed, n) if kind == "multisine" else _sweep() for n in range((measured + 1) // 2)]
    parts = [np.tile(period * (level_V / np.abs(period).max()), 3) for period in pairs]
    begins = [3 * PERIOD * n + PERIOD * k for n in range(len(pairs)) for k in (1, 2)]
    return Excitation(np.concatenate([*parts, np.zeros(PERIOD // 4)]), tuple(begins[:measured]))


def _multisine(seed: int, number: int) -> Array:
    count = HIGHEST_HZ - LOWEST_HZ + 1
    return _signal_of(np.random.PCG64([seed, number]).random_raw(count) / 2.0**64, np.ones(count))


def _sweep() -> Array:
    """Return a logarithmic sweep, synthesised from its lines, so that none is missing and it loops without a seam."""
    hz = np.arange(LOWEST_HZ, HIGHEST_HZ + 1)
    sounds_at_s = np.log(hz / LOWEST_HZ) / np.log(HIGHEST_HZ / LOWEST_HZ)
    return _signal_of(-np.cumsum(sounds_at_s), 1 / np.sqrt(hz))


def _signal_of(turns: Array, sizes: Array) -> Array:
    lines = np.zeros(PERIOD // 2 + 1, dtype=np.complex128)
    lines[LOWEST_HZ : HIGHEST_HZ + 1] = sizes * np.exp(2j * np.pi * turns)
    made: Array = np.fft.irfft(lines, PERIOD)
    return made
