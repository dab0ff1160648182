"""From a shaken actuator to the filter that makes it flat."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.devices.actuator.calibration import Calibration
from palpate.devices.actuator.inverse import Inverse, Wish, invert
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
from palpate.devices.signals import Block, DeviceFault, NowNs, Sensor
from palpate.signals.arrays import Array

if TYPE_CHECKING:
    from palpate.devices.actuator.device import VoiceCoil

PlayAndRecord = Callable[[Array], tuple[Array, int]]
"""Plays volts at 1 kHz and gives the acceleration (m/s^2) recorded meanwhile, and its rate."""
PATIENCE_S = 5.0


@dataclass(frozen=True)
class Shaking:
    """How the actuator is shaken: the kind of excitation, its peak, its seed, how many seconds are measured."""

    kind: Kind = "multisine"
    level_V: float = 0.5
    seed: int = 1
    measured: int = 8


@dataclass(frozen=True)
class Identified:
    """What shaking the actuator gave."""

    response: Response
    inverse: Inverse
    shaking: Shaking
    wish: Wish

    def calibration(self, date: str) -> Calibration:
        """As it is kept; the date is the day it was measured."""
        found, made = self.response, self.inverse
        return Calibration(
            date=date, excitation=f"{self.shaking.kind}, {self.shaking.level_V:g} V, seed {self.shaking.seed}",
            band_Hz=(self.wish.low_Hz, self.wish.high_Hz), boost_dB=self.wish.boost_dB, gain_m_s2_V=made.gain,
            ripple_dB=made.ripple_dB, before_dB=made.before_dB, delay_ms=made.delay_ms, added_ms=made.added_ms,
            limited_Hz=made.limited_Hz, hz=found.hz.tolist(), real=found.response.real.tolist(),
            imaginary=found.response.imag.tolist(), coherence=found.coherence.tolist(),
            h2_apart_dB=found.apart_dB.tolist(), filter=made.taps.tolist(),
        )  # fmt: skip


def identify(play_and_record: PlayAndRecord, shaking: Shaking | None = None, wish: Wish | None = None) -> Identified:
    """Shake the actuator, estimate its response and make the filter.

    Raises ResponseError where the recording is silent, clipped, no number or unrelated to what was played.
    """
    shaking, wish = shaking or Shaking(), wish or Wish()
    played = excitation(shaking.kind, shaking.level_V, shaking.seed, shaking.measured)
    recorded, rate_hz = play_and_record(played.samples)
    response = estimate(played, recorded, rate_hz)
    demand_coherence(response, wish.low_Hz, wish.high_Hz)
    return Identified(response, invert(response, wish), shaking, wish)


def through(coil: VoiceCoil, sensor: Sensor, now_ns: NowNs) -> PlayAndRecord:
    """Play through an open voice coil and record an open accelerometer that is fastened to it.

    Both should be timed by one card: clocks that part by 50 ppm cost coherence at high frequencies.
    """

    def play_and_record(volts: Array) -> tuple[Array, int]:
        rate_hz = round(sensor.signals[0].rate_hz)
        wanted = len(volts) * rate_hz // RATE_HZ
        before = coil.record()
        sensor.start(now_ns)
        try:
            coil.start()
            rows = _recorded(coil, sensor, volts, wanted, now_ns)
        finally:
            coil.safe()
            sensor.stop()
        _demand_played(before, coil.record())
        return _along_the_motion(rows[:wanted]), rate_hz

    return play_and_record


def _demand_played(before: Mapping[str, Any], after: Mapping[str, Any]) -> None:
    """Raise ResponseError where the coil did not play what it was given."""
    if after["limited"] > before["limited"]:
        count = after["limited"] - before["limited"]
        raise ResponseError(f"{count} samples were limited to what the coil bears: identify it at a lower level")
    if after["underruns"] > before["underruns"]:
        count = after["missing"] - before["missing"]
        raise ResponseError(f"{count} samples came too late to be played: raise `ahead_ms` and identify it again")


def _recorded(coil: VoiceCoil, sensor: Sensor, volts: Array, wanted: int, now_ns: NowNs) -> Array:
    """Feed the coil and empty the sensor until all was played and recorded."""
    signal, parts, count, fed = sensor.signals[0], [np.zeros((0, len(sensor.signals[0].channels)))], 0, 0
    until_ns = now_ns() + round((2 * len(volts) / RATE_HZ + PATIENCE_S) * 1e9)
    while fed < len(volts) or count < wanted:
        if fed < len(volts) and coil.room:
            part = volts[fed : fed + coil.room]
            coil.drive(part)
            fed += len(part)
            if fed == len(volts):
                coil.rest()
        for block in sensor.read(0.002).get(signal.name, ()):
            parts.append(_rows(block, len(signal.channels)))
            count += len(parts[-1])
        if now_ns() > until_ns:
            told = f"{coil.name}: {fed} of {len(volts)} samples played, {count} of {wanted} recorded in time"
            raise DeviceFault(sensor.name, "silent", told)
    coil.check()
    return np.concatenate(parts)


def _rows(block: Block, channels: int) -> Array:
    if block.lost:
        raise ResponseError(f"{block.lost} samples were lost while it was recorded ({block.why}): record again")
    return np.frombuffer(block.data, "<f4").reshape(-1, channels).astype(np.float64)


def _along_the_motion(rows: Array) -> Array:
    """The three axes as one: the direction in which it moves most, in the sign of its largest part."""
    loudest = int(np.nanstd(rows, axis=0).argmax()) if len(rows) else 0
    demand_signal(rows[:, loudest])
    centred = rows - rows.mean(axis=0)
    direction = np.linalg.svd(centred, full_matrices=False)[2][0]
    along: Array = centred @ (direction * np.sign(direction[np.abs(direction).argmax()]))
    return along
