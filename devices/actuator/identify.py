"""Identify an actuator by shaking it, and compute the feed-forward filter that makes its response flat.

Thesis 4.5.2; McMahan and Kuchenbecker 2014.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.devices.actuator.calibration import Calibration
from palpate.devices.actuator.queue import RATE_HZ
from palpate.devices.actuator.response import (
    Kind,
    Response,
    ResponseError,
    demand_coherence,
    demand_signal,
    estimate,
    excitation,
)
from palpate.devices.device import DeviceFault, NowNs, Sensor
from palpate.signals.arrays import Array, Complex

if TYPE_CHECKING:
    from palpate.devices.actuator.device import VoiceCoil

PlayAndRecord = Callable[[Array], tuple[Array, int]]
"""Plays volts at 1 kHz and returns the acceleration (m/s^2) recorded meanwhile, and its rate."""
PATIENCE_S = 5.0
TAPS = 256
GRID = 4096
GRID_HZ = np.arange(GRID // 2 + 1) * RATE_HZ / GRID
LEAST_SHARE = 0.1
"""Gain at 0 Hz relative to the gain at the band's lower edge, so that nothing below the band is amplified in vain."""


@dataclass(frozen=True)
class Shaking:
    """The excitation of the actuator: its kind, its peak, its seed, and how many seconds are measured."""

    kind: Kind = "multisine"
    level_V: float = 0.5
    seed: int = 1
    measured: int = 8


@dataclass(frozen=True)
class Identified:
    """The result of an identification."""

    response: Response
    inverse: Inverse
    shaking: Shaking
    wish: Wish

    def calibration(self, date: str) -> Calibration:
        """Return the calibration as it is stored; `date` is the day of the measurement."""
        response, inverse = self.response, self.inverse
        return Calibration(
            date=date, excitation=f"{self.shaking.kind}, {self.shaking.level_V:g} V, seed {self.shaking.seed}",
            band_Hz=(self.wish.low_Hz, self.wish.high_Hz), boost_dB=self.wish.boost_dB, gain_m_s2_V=inverse.gain,
            ripple_dB=inverse.ripple_dB, before_dB=inverse.before_dB, delay_ms=inverse.delay_ms,
            added_ms=inverse.added_ms, limited_Hz=inverse.limited_Hz, hz=response.hz.tolist(),
            real=response.response.real.tolist(), imaginary=response.response.imag.tolist(),
            coherence=response.coherence.tolist(), h2_apart_dB=response.apart_dB.tolist(), filter=inverse.taps.tolist(),
        )  # fmt: skip


def identify(play_and_record: PlayAndRecord, shaking: Shaking | None = None, wish: Wish | None = None) -> Identified:
    """Shake the actuator, estimate its response and compute the filter.

    Raises ResponseError if the recording is silent, clipped, not finite or unrelated to what was played.
    """
    shaking, wish = shaking or Shaking(), wish or Wish()
    played = excitation(shaking.kind, shaking.level_V, shaking.seed, shaking.measured)
    recorded, rate_hz = play_and_record(played.samples)
    response = estimate(played, recorded, rate_hz)
    demand_coherence(response, wish.low_Hz, wish.high_Hz)
    return Identified(response, invert(response, wish), shaking, wish)


def through(coil: VoiceCoil, sensor: Sensor, now_ns: NowNs) -> PlayAndRecord:
    """Return a function that plays through an open voice coil and records an open accelerometer fastened to it.

    Both should be timed by one card: clocks that differ by 50 ppm cost coherence at high frequencies.
    """

    def play_and_record(volts: Array) -> tuple[Array, int]:
        rate_hz = round(sensor.signals[0].rate_hz)
        needed = len(volts) * rate_hz // RATE_HZ
        before = coil.record()
        sensor.start(now_ns)
        try:
            coil.start()
            rows = _recorded(coil, sensor, volts, needed, now_ns)
        finally:
            coil.safe()
            sensor.stop()
        after = coil.record()
        if after["limited"] > before["limited"]:
            count = after["limited"] - before["limited"]
            raise ResponseError(f"{count} samples were limited to what the coil bears: identify it at a lower level")
        if after["underruns"] > before["underruns"]:
            count = after["missing"] - before["missing"]
            raise ResponseError(f"{count} samples came too late to be played: raise `ahead_ms` and identify it again")
        return along_the_motion(rows[:needed]), rate_hz

    return play_and_record


def _recorded(coil: VoiceCoil, sensor: Sensor, volts: Array, due: int, now_ns: NowNs) -> Array:
    """Feed the coil and read the sensor until everything was played and recorded; return the acceleration."""
    signal, parts, count, fed = sensor.signals[0], [np.zeros((0, len(sensor.signals[0].channels)))], 0, 0
    until_ns = now_ns() + round((2 * len(volts) / RATE_HZ + PATIENCE_S) * 1e9)
    while fed < len(volts) or count < due:
        if fed < len(volts) and coil.room:
            part = volts[fed : fed + coil.room]
            coil.drive(part)
            fed += len(part)
            if fed == len(volts):
                coil.rest()
        for block in sensor.read(0.002).get(signal.name, ()):
            if block.lost:
                raise ResponseError(f"{block.lost} samples were lost while it was recorded ({block.why}): record again")
            parts.append(np.frombuffer(block.data, "<f4").reshape(-1, len(signal.channels)).astype(np.float64))
            count += len(parts[-1])
        if now_ns() > until_ns:
            message = f"{coil.name}: {fed} of {len(volts)} samples played, {count} of {due} recorded in time"
            raise DeviceFault(sensor.name, "silent", message)
    coil.check()
    return np.concatenate(parts)


def along_the_motion(rows: Array) -> Array:
    """Return the three axes as one, along the direction of the largest motion, with the sign of its largest part."""
    loudest = int(np.nanstd(rows, axis=0).argmax()) if len(rows) else 0
    demand_signal(rows[:, loudest])
    centred = rows - rows.mean(axis=0)
    direction = np.linalg.svd(centred, full_matrices=False)[2][0]
    along: Array = centred @ (direction * np.sign(direction[np.abs(direction).argmax()]))
    return along


@dataclass(frozen=True)
class Wish:
    """The band to make flat, and the greatest gain of the filter relative to its median gain."""

    low_Hz: float = 20.0
    high_Hz: float = 450.0
    boost_dB: float = 24.0


@dataclass(frozen=True)
class Inverse:
    """Weights of a finite, hence stable filter: volts for an acceleration. Figures hold for the measured response.

    `gain` is the response's median in the band, in units per volt. `ripple_dB` is the largest deviation of the
    compensated response from flat, up or down, `before_dB` the same without the filter. `delay_ms` is the delay from a
    requested acceleration to the movement, including the loop's own; `added_ms` is the filter's part. `limited_Hz` are
    the lines in the band where the response is so small that the gain limit leaves it small.
    """

    taps: Array
    gain: float
    ripple_dB: float
    before_dB: float
    delay_ms: float
    added_ms: float
    limited_Hz: tuple[float, ...]


def invert(response: Response, wish: Wish) -> Inverse:
    """Return the minimum-phase filter whose gain is the regularised inverse of the response's.

    A hand feels a vibration's strength and not its phase, so the gain is made flat with the phase of least delay. Each
    line is regularised by its squared standard error: poorly measured lines are not amplified. Raises ResponseError if
    the band holds no response.
    """
    inside = response.inside(wish.low_Hz, wish.high_Hz)
    gain = float(np.median(np.abs(response.response[inside]))) if inside.any() else 0.0
    if not gain > 0:
        raise ResponseError(f"no response from {wish.low_Hz:g} to {wish.high_Hz:g} Hz to be made flat")
    hz, flat = response.hz[inside], response.response[inside] / gain
    size = np.abs(flat)
    target = size / (size**2 + (response.error[inside] / gain) ** 2)
    most = 10 ** (wish.boost_dB / 20)
    # The gain on the whole grid: as at the band's edges beyond them, less towards 0 Hz.
    everywhere = np.interp(GRID_HZ, hz, np.minimum(target, most)) * np.clip(GRID_HZ / wish.low_Hz, LEAST_SHARE, 1.0)
    taps = minimum_phase(everywhere)
    taps = taps * min(1.0, most / float(np.abs(np.fft.rfft(taps, GRID)).max()))
    limited = tuple(float(f) for f in hz[target > most])
    reached = flat * gain_at(taps, hz)
    own, whole = envelope_delay_ms(hz, flat), envelope_delay_ms(hz, reached)
    ripple, before = _ripple_dB(reached), _ripple_dB(flat)
    return Inverse(taps / gain, gain, ripple, before, whole, whole - own, limited)


def minimum_phase(gain: Array) -> Array:
    """Return 256 taps with this gain on the grid and the least delay.

    Source: Oppenheim and Schafer, 13.5 (folded cepstrum).
    """
    cepstrum = np.fft.irfft(np.log(np.maximum(gain, 1e-9)), GRID)
    cepstrum[1 : GRID // 2] *= 2
    cepstrum[GRID // 2 + 1 :] = 0
    whole: Array = np.fft.irfft(np.exp(np.fft.rfft(cepstrum)), GRID)
    fade = np.ones(TAPS)
    fade[-TAPS // 4 :] = 0.5 + 0.5 * np.cos(np.pi * np.arange(TAPS // 4) / (TAPS // 4))
    return whole[:TAPS] * fade


def gain_at(taps: Array, hz: Array) -> Complex:
    """Return a filter's response at these frequencies."""
    turns = np.exp(-2j * np.pi * np.outer(hz, np.arange(len(taps))) / RATE_HZ)
    return np.asarray(turns @ taps, dtype=np.complex128)


def _ripple_dB(response: Complex) -> float:
    return float(np.abs(20 * np.log10(np.maximum(np.abs(response), 1e-12))).max())


def envelope_delay_ms(hz: Array, response: Complex) -> float:
    """Return where the envelope of the band's impulse response is largest, to a tenth of a millisecond."""
    times_s = np.arange(0, GRID) / (10 * RATE_HZ)
    envelope = np.abs(np.exp(2j * np.pi * np.outer(times_s, hz)) @ response)
    return float(1000 * times_s[envelope.argmax()])
