"""A second-order Butterworth low-pass that takes one sample at a time, in plain floats."""

from __future__ import annotations

import math

from palpate.devices.signals import DeviceError


class Lowpass:
    """The bilinear transform of a second-order Butterworth filter, direct form II transposed.

    Its group delay towards 0 Hz is sqrt(2) / (2 pi cutoff), 11.25 ms at 20 Hz, to within the warping of the transform.
    """

    __slots__ = ("_a1", "_a2", "_b0", "_b1", "_z1", "_z2")

    def __init__(self, cutoff_hz: float, rate_hz: float) -> None:
        """At rest at 0. Raises DeviceError where the cutoff is not between 0 and half the rate."""
        if not 0 < cutoff_hz < rate_hz / 2:
            raise DeviceError(
                f"a cutoff of {cutoff_hz:g} Hz at {rate_hz:g} Hz: above 0 and below half the rate is expected."
            )
        warped = math.tan(math.pi * cutoff_hz / rate_hz)
        whole = 1 + math.sqrt(2) * warped + warped * warped
        self._b0 = warped * warped / whole
        self._b1 = 2 * self._b0
        self._a1 = 2 * (warped * warped - 1) / whole
        self._a2 = (1 - math.sqrt(2) * warped + warped * warped) / whole
        self._z1 = self._z2 = 0.0

    def settle(self, value: float) -> None:
        """Be as if this value had always come in: what follows starts without a transient."""
        self._z1 = (1 - self._b0) * value
        self._z2 = (self._b0 - self._a2) * value

    def step(self, value: float) -> float:
        """The next sample out for the next one in."""
        out = self._b0 * value + self._z1
        self._z1 = self._b1 * value - self._a1 * out + self._z2
        self._z2 = self._b0 * value - self._a2 * out
        return out


def delay_s(cutoff_hz: float) -> float:
    """The group delay of the filter towards 0 Hz."""
    return math.sqrt(2) / (2 * math.pi * cutoff_hz)
