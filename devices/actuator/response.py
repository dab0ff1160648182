"""The excitation of an actuator, and its frequency response from a recording, with errors if there is none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from palpate.devices.actuator.queue import RATE_HZ
from palpate.devices.device import DeviceError
from palpate.signals.arrays import Array, Complex, Indices

FEWEST = 4
"""Fewest periods for coherence to be meaningful: unrelated noise alone has 1 over their number."""
AT_REST = 1e-9
CLIPPED_SHARE = 0.002
"""Share of the samples that may have the largest or smallest value: one in 500. A clipped recording has far more."""
COHERENT, INCOHERENT_SHARE = 0.8, 0.1
Kind = Literal["multisine", "sweep"]
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
    if len(recorded) != len(played) * rate_hz // played.rate_hz:
        whole_s = len(played) / played.rate_hz
        raise ResponseError(
            f"{len(recorded) / rate_hz:.3f} s were recorded at {rate_hz} Hz, {whole_s:.3f} s were played"
        )
    if len(played.begins) < FEWEST:
        raise ResponseError(f"{len(played.begins)} periods were measured, at least {FEWEST} are needed")
    demand_signal(recorded)
    begins_s = [first / played.rate_hz for first in played.begins]
    x = _spectra(played.samples, begins_s, played.rate_hz, played.highest_Hz)
    y = _spectra(recorded - recorded.mean(), begins_s, rate_hz, played.highest_Hz)
    s_xx, s_yy = np.mean(np.abs(x) ** 2, axis=0), np.mean(np.abs(y) ** 2, axis=0)
    s_xy = np.mean(np.conj(x) * y, axis=0)
    lines = slice(LOWEST_HZ, played.highest_Hz + 1)
    hz = np.arange(LOWEST_HZ, played.highest_Hz + 1, dtype=np.float64)
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


def _spectra(samples: Array, begins_s: list[float], rate_hz: int, highest_Hz: int) -> Complex:
    """Return the lines from 0 Hz to the highest one of each measured second."""
    firsts = [round(first_s * rate_hz) for first_s in begins_s]
    periods = [np.fft.rfft(samples[first : first + rate_hz]) / rate_hz for first in firsts]
    return np.array(periods)[:, : highest_Hz + 1]


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
    """Samples in volts, and where the measured periods begin, by which time the response has settled."""

    samples: Array
    begins: tuple[int, ...]
    rate_hz: int = RATE_HZ
    highest_Hz: int = HIGHEST_HZ

    def __len__(self) -> int:
        return len(self.samples)


def excitation(
    kind: Kind, level_V: float, seed: int, measured: int = 8, rate_hz: int = RATE_HZ, highest_Hz: int = HIGHEST_HZ,
    lifted_Hz: float = 0.0,
) -> Excitation:  # fmt: skip
    """Return `measured` periods of 1 s that peak at `level_V`, each of lines from 5 Hz to the highest.

    A multisine has random phases, new ones in every pair of periods, so that distortion shows as a loss of coherence; a
    sweep is the same logarithmic sweep throughout. An extra period that is not measured comes first. The lines of a
    multisine below `lifted_Hz` grow with 1 / f, up to ten times: an actuator moves little there.
    """
    hz = np.arange(LOWEST_HZ, highest_Hz + 1)
    pairs = [
        _multisine(hz, seed, n, rate_hz, lifted_Hz) if kind == "multisine" else _sweep(hz, rate_hz)
        for n in range((measured + 1) // 2)
    ]
    parts = [np.tile(period * (level_V / np.abs(period).max()), 3) for period in pairs]
    begins = [3 * rate_hz * n + rate_hz * k for n in range(len(pairs)) for k in (1, 2)]
    samples = np.concatenate([*parts, np.zeros(rate_hz // 4)])
    return Excitation(samples, tuple(begins[:measured]), rate_hz, highest_Hz)


def _multisine(hz: Indices, seed: int, number: int, rate_hz: int, lifted_Hz: float) -> Array:
    turns = np.random.PCG64([seed, number]).random_raw(len(hz)) / 2.0**64
    return _signal_of(hz, turns, np.clip(lifted_Hz / hz, 1.0, 10.0), rate_hz)


def _sweep(hz: Indices, rate_hz: int) -> Array:
    """Return a logarithmic sweep, synthesised from its lines, so that none is missing and it loops without a seam."""
    sounds_at_s = np.log(hz / hz[0]) / np.log(hz[-1] / hz[0])
    return _signal_of(hz, -np.cumsum(sounds_at_s), 1 / np.sqrt(hz), rate_hz)


def _signal_of(hz: Indices, turns: Array, sizes: Array, rate_hz: int) -> Array:
    lines = np.zeros(rate_hz // 2 + 1, dtype=np.complex128)
    lines[hz] = sizes * np.exp(2j * np.pi * turns)
    made: Array = np.fft.irfft(lines, rate_hz)
    return made
