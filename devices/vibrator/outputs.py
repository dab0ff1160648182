"""Outputs that drive a vibrator: a DAQ card, a sound card, and a twin whose delay and jitter are known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from palpate.devices.actuator.analog_out import AnalogOut
from palpate.devices.actuator.outputs import RANGE_V, Coil, Felt, Shaken
from palpate.devices.noise import gaussians
from palpate.devices.sound.card import Card
from palpate.devices.sound.output import Fill, Output
from palpate.devices.vibrator.calibration import VibratorCalibration, least_volts
from palpate.devices.vibrator.settings import Settings
from palpate.signals.arrays import Array

QUIET_S = 0.01
"""A burst of the twin begins after at least so long a silence."""
TWIN_BAND_HZ = (10.0, 1000.0)
TWIN_COIL = Coil(gain_m_s2_V=400.0, resonance_Hz=100.0, damping=0.5, delay=0)


@dataclass
class ScaledCard(Card):
    """A sound card that plays volts: full scale is `full_scale_V`."""

    full_scale_V: float = 1.0

    def start(self, fill: Fill) -> None:
        """Begin to play. Raises DeviceError."""
        super().start(lambda count: fill(count) / self.full_scale_V)


@dataclass
class DelayedTwin(Felt):
    """A twin that moves `delay_s` late, and every burst by another jitter (SD `jitter_s`, drawn from the seed).

    `delays` has the delay of each burst so far, in samples.
    """

    delay_s: float = 0.0
    jitter_s: float = 0.0
    seed: int = 1
    delays: list[int] = field(default_factory=list)
    _quiet: int = 1 << 62
    _shift: int = 0
    _line: Array = field(default_factory=lambda: np.zeros(0))

    def shake(self, volts: Array) -> None:
        """Record what was played, in volts, and the acceleration that comes of it, late."""
        count = len(volts)
        sounding = np.flatnonzero(volts)
        gaps = np.diff(sounding, prepend=-self._quiet - 1) - 1
        starts = sounding[gaps >= QUIET_S * self.rate_hz].tolist()
        self._quiet = count - 1 - int(sounding[-1]) if sounding.size else min(self._quiet + count, 1 << 62)
        line, self._line = self._line, np.zeros(0)
        for first, end in zip([0, *starts], [*starts, count], strict=True):
            if first == end:
                continue
            if first in starts:
                self._shift = self._drawn()
                self.delays.append(self._shift)
            needed = end + self._shift
            line = np.pad(line, (0, max(0, max(needed, count) - len(line))))
            line[first + self._shift : end + self._shift] += volts[first:end]
        self._line = line[count:]
        super().shake(line[:count])
        self.played[-1] = volts

    def _drawn(self) -> int:
        chance = gaussians(1, "vibrator", self.seed, len(self.delays))[0]
        return max(0, round((self.delay_s + self.jitter_s * chance) * self.rate_hz))


def twin_calibration(settings: Settings) -> VibratorCalibration:
    """Return the twin's own response, from its equation."""
    from scipy.signal import freqz

    b, a = Coil(**{**vars(TWIN_COIL), "rate_hz": float(settings.rate_hz)}).weights()
    hz = np.round(np.geomspace(*TWIN_BAND_HZ, 200), 6)
    response = np.round(freqz(b, a, worN=hz, fs=settings.rate_hz)[1], 6)  # the same digest on every machine
    return VibratorCalibration(
        date="2026-01-01", sensor="its own equation", excitation="none", band_Hz=TWIN_BAND_HZ,
        least_V=least_volts(RANGE_V, settings.bits), most_V=settings.limits.peak_V,
        linear_dB=0.0, delay_ms=settings.delay_ms,
        hz=hz.tolist(), real=response.real.tolist(), imaginary=response.imag.tolist(), coherence=[1.0] * len(hz),
    )  # fmt: skip


def full_scale_V(settings: Settings) -> float:
    """Return the largest voltage of the output's converter."""
    return settings.full_scale_V if settings.driver == "sound" else RANGE_V


def output_of(name: str, settings: Settings, elapsed_s: Callable[[], float]) -> Output:
    """Return the output that the settings name."""
    rate_hz = float(settings.rate_hz)
    if settings.driver == "nidaqmx":
        ahead = settings.ahead_ms * settings.rate_hz // 1000
        return AnalogOut(name, settings.channel, RANGE_V, ahead, rate_hz=rate_hz)
    if settings.driver == "sound":
        return ScaledCard(name, settings.device, settings.rate_hz, full_scale_V=settings.full_scale_V)
    coil = Coil(**{**vars(TWIN_COIL), "rate_hz": rate_hz})
    output = DelayedTwin(
        rate_hz, elapsed_s, lambda _volts: None, shaken=Shaken(coil, settings.seed),
        delay_s=settings.delay_ms / 1000, jitter_s=settings.jitter_ms / 1000, seed=settings.seed,
    )  # fmt: skip
    output.heard = output.shake
    return output
