"""The driver's limits of a vibration at the skin: peaks, duration, and exposure weighted by frequency."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, field

import numpy as np

from palpate.devices.device import DeviceFault
from palpate.devices.vibrator.settings import Limits
from palpate.signals.arrays import Array
from palpate.signals.vibration import displacement_m

DAY_S = 8 * 3600
"""The reference duration of A(8), in s (ISO 5349-1)."""
LOWEST_HZ = 5.0
"""Below this nothing counts as displacement: what is left there is rounding, enlarged by 1 / f^2."""


def hand_arm_weight(hz: Array) -> Array:
    """Return the frequency weighting Wh of ISO 5349-1:2001, Annex A, as a factor of the acceleration."""
    s = 2j * math.pi * np.asarray(hz, np.float64)
    w1, w2, w3, w4 = (2 * math.pi * f for f in (6.310, 1258.9, 15.915, 15.915))
    band = s**2 * w2**2 / ((s**2 + s * w1 * math.sqrt(2) + w1**2) * (s**2 + s * w2 * math.sqrt(2) + w2**2))
    weighting = (s + w3) * w4**2 / ((s**2 + s * w4 / 0.64 + w4**2) * w3)
    return np.asarray(np.abs(band * weighting), np.float64)


def weighted_energy(acceleration: Array, rate_hz: float) -> float:
    """Return the time integral of the squared weighted acceleration, in m^2/s^3."""
    power = np.abs(np.fft.rfft(acceleration)) ** 2 / len(acceleration)
    power[1 : (len(acceleration) + 1) // 2] *= 2
    weight = hand_arm_weight(np.arange(len(power)) * rate_hz / len(acceleration))
    return float(np.sum(power * weight**2)) / rate_hz


@dataclass
class Exposure:
    """What the skin was given since the device was opened; any thread may ask.

    `recent` decays with the window's time constant; `total` is the integral of the day, or since the device was opened.
    """

    device: str
    limits: Limits
    rate_hz: float
    recent: float = 0.0
    total: float = 0.0
    at_s: float = 0.0
    _lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def a8_m_s2(self) -> float:
        """Return the exposure of `total` as the steady weighted acceleration over 8 hours, A(8), in m/s^2."""
        return math.sqrt(self.total / DAY_S)

    def refuse(self, acceleration: Array) -> str | None:
        """Return why one vibration alone is beyond a limit, or None."""
        limits = self.limits
        if not np.isfinite(acceleration).all():
            place = int(np.flatnonzero(~np.isfinite(acceleration))[0])
            return f"sample {place} is {acceleration[place]}; finite numbers are expected"
        seconds = len(acceleration) / self.rate_hz
        if seconds > limits.longest_s:
            return f"{seconds:.3g} s; at most limits.longest_s = {limits.longest_s:g} s are played"
        peak = float(np.abs(acceleration).max())
        if peak > limits.peak_m_s2:
            return f"a peak of {peak:.4g} m/s^2; at most limits.peak_m_s2 = {limits.peak_m_s2:g} are played"
        moved_um = 1e6 * float(np.abs(displacement_m(acceleration, self.rate_hz, LOWEST_HZ)).max())
        if moved_um > limits.peak_um:
            return f"a displacement of {moved_um:.4g} um; at most limits.peak_um = {limits.peak_um:g} are played"
        energy = weighted_energy(acceleration, self.rate_hz)
        if (felt := math.sqrt(energy / limits.window_s)) > limits.hand_arm_m_s2:
            return f"{felt:.3g} m/s^2 (hand-arm weighted, over {limits.window_s:g} s); at most {limits.hand_arm_m_s2:g}"
        return None

    def demand(self, acceleration: Array) -> None:
        """Raise DeviceFault (`not_a_number`, `limit`) if one vibration alone is beyond a limit."""
        if (problem := self.refuse(acceleration)) is not None:
            kind = "limit" if np.isfinite(acceleration).all() else "not_a_number"
            raise DeviceFault(self.device, kind, f"{self.device}: not played: {problem}")

    def take(self, acceleration: Array, at_s: float) -> None:
        """Count a vibration that begins at `at_s` by the output's clock.

        Raises DeviceFault (`not_a_number`, `limit`) instead if it alone, or with what came before, is beyond a limit.
        """
        with self._lock:
            self.demand(acceleration)
            energy, limits = weighted_energy(acceleration, self.rate_hz), self.limits
            recent = self.recent * math.exp(-max(0.0, at_s - self.at_s) / limits.window_s) + energy
            if (felt := math.sqrt(recent / limits.window_s)) > limits.hand_arm_m_s2:
                found = f"{felt:.3g} m/s^2 with those before it (hand-arm weighted, over {limits.window_s:g} s)"
                message = f"{self.device}: not played: {found}; at most {limits.hand_arm_m_s2:g}: wait before the next"
                raise DeviceFault(self.device, "limit", message)
            if (day := math.sqrt((self.total + energy) / DAY_S)) > limits.a8_m_s2:
                found = f"the daily exposure A(8) would be {day:.3g} m/s^2; at most limits.a8_m_s2 = {limits.a8_m_s2:g}"
                raise DeviceFault(self.device, "limit", f"{self.device}: not played: {found}: end for today")
            self.recent, self.total, self.at_s = recent, self.total + energy, max(self.at_s, at_s)


@dataclass
class VoltGuard:
    """The last check before the output, in its callback: finite, within the peak, RMS over the thermal time.

    The heat is the square of the voltage, averaged with the thermal time constant.
    """

    limits: Limits
    rate_hz: float
    heat: float = 0.0

    def first_beyond(self, volts: Array) -> tuple[int, str]:
        """Return how many samples may be played, and why not the next one ("" where all may)."""
        from scipy.signal import lfilter

        bad = ~np.isfinite(volts)
        beyond = ~bad & (np.abs(np.where(bad, 0.0, volts)) > self.limits.peak_V * (1 + 1e-9))
        keep = math.exp(-1 / (self.limits.thermal_s * self.rate_hz))
        squares = np.where(bad | beyond, 0.0, volts) ** 2
        heat, _ = lfilter([1 - keep], [1.0, -keep], squares, zi=[keep * self.heat])
        hot = heat > self.limits.rms_V**2
        stop = np.flatnonzero(bad | beyond | hot)
        count = int(stop[0]) if stop.size else len(volts)
        if count:
            self.heat = float(heat[count - 1])
        if not stop.size:
            return count, ""
        if bad[count]:
            return count, f"a sample is {volts[count]}"
        if beyond[count]:
            return count, f"{volts[count]:.4g} V is beyond limits.peak_V = {self.limits.peak_V:g}"
        return count, f"RMS beyond limits.rms_V = {self.limits.rms_V:g} V over {self.limits.thermal_s:g} s"

    def cool(self, count: int) -> None:
        """Let the actuator cool for so many silent samples."""
        self.heat *= math.exp(-count / (self.limits.thermal_s * self.rate_hz))
