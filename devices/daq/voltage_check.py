"""Check for volts that no working sensor gives: not a number, constant to the last bit, at the end of the range."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from palpate.devices.daq.acquire import Volts
from palpate.devices.device import DeviceFault

EDGE = 0.005
"""The outermost share of the range that counts as its end: the last 0.5 %."""


@dataclass
class VoltageCheck:
    """A check of consecutive blocks of volts. No change for `stuck_s` is a fault: noise alone moves the last bit.

    `low_V` and `high_V` are the ends that the sensor's output or the card's range sets.
    """

    device: str
    wires: Sequence[str]
    low_V: float
    high_V: float
    rate_hz: float
    stuck_s: float
    last: Volts | None = None
    still: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))

    def begin(self) -> None:
        """Forget earlier samples."""
        self.last, self.still = None, np.zeros(len(self.wires), np.int64)

    def see(self, volts: Volts) -> NDArray[np.bool_]:
        """Return a mask, in the volts' shape, of those at an end of the range.

        Raises DeviceFault (not_a_number, stuck).
        """
        self._demand_numbers(volts)
        # Count for how many samples each wire has not changed, up to the newest one.
        before = volts[:1] if self.last is None else self.last
        changed = np.diff(volts, axis=0, prepend=before) != 0
        ever = changed.any(axis=0)
        since = np.argmax(changed[::-1], axis=0)
        self.still = np.where(ever, since, self.still + len(volts))
        self.last = volts[-1:].copy()
        if self.stuck_s > 0 and (self.still >= self.stuck_s * self.rate_hz).any():
            wire = int(np.argmax(self.still))
            value = float(volts[-1, wire])
            stuck = (
                f"{self.device}: {self.wires[wire]} has stood at {value:.4g} V for {self.stuck_s:g} s without any noise"
            )
            edge = EDGE * (self.high_V - self.low_V)
            ended = value <= self.low_V + edge or value >= self.high_V - edge
            why = "the end of its range: a broken sensor or cable, or no power" if ended else "no live sensor does so"
            raise DeviceFault(self.device, "stuck", f"{stuck}: {why}")
        margin = EDGE * (self.high_V - self.low_V)
        at_end: NDArray[np.bool_] = (volts <= self.low_V + margin) | (volts >= self.high_V - margin)
        return at_end

    def _demand_numbers(self, volts: Volts) -> None:
        if np.isfinite(volts).all():
            return
        row, wire = np.argwhere(~np.isfinite(volts))[0]
        raise DeviceFault(
            self.device,
            "not_a_number",
            f"{self.device}: {self.wires[wire]} gave {volts[row, wire]} V; see the card and its driver",
        )
