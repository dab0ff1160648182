"""What a tracker gave since it was started, for its health: the rate that it really has, and how much was seen."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from palpate.devices.tracker.source import Batch
from palpate.devices.tracker.watch import HIDDEN


@dataclass
class Tally:
    """Counts of samples; the rate is that of samples that came, by their own time stamps."""

    TOLERANCE: ClassVar[float] = 0.02
    came: int = 0
    seen: int = 0
    lost: int = 0
    spans: int = 0
    spanned_s: float = 0.0
    last_s: float = math.nan

    def add(self, came: int, seen: int, lost: int) -> None:
        """Samples that came, those of them that were seen, and those that are missing."""
        self.came, self.seen, self.lost = self.came + came, self.seen + seen, self.lost + lost

    def took(self, batch: Batch) -> None:
        """The batch's times; across a clock that was set anew nothing can be measured."""
        if not batch.times_s:
            return
        before = batch.times_s[0] if batch.reset or math.isnan(self.last_s) else self.last_s
        self.spans += len(batch.times_s) - (before == batch.times_s[0])
        self.spanned_s += batch.times_s[-1] - before
        self.last_s = batch.times_s[-1]

    @property
    def rate_hz(self) -> float:
        """Samples that came per second of their own clock; 0 for fewer than two."""
        return self.spans / self.spanned_s if self.spanned_s > 0 else 0.0

    def told(self, wanted_hz: float, noise_mm: Sequence[float], counts: Mapping[str, int]) -> tuple[bool, str]:
        """Whether all is well, and one line."""
        right = abs(self.rate_hz / wanted_hz - 1) <= self.TOLERANCE
        rate = f"{self.rate_hz:.2f} Hz" + ("" if right else f", not the {wanted_hz:g} Hz of the rig file")
        hidden = ", ".join(f"{counts[why]} x {told}" for why, told in HIDDEN.items() if counts.get(why))
        share = f"seen {100 * self.seen / max(1, self.came):.1f} % of {self.came} samples"
        noise = f"noise {max(noise_mm):.3f} mm" if self.seen > 1 else "no marker is seen: put it in view"
        missing = f"{self.lost} missing" if self.lost else ""
        return right and self.seen > 1, "; ".join(filter(None, (rate, share, hidden, missing, noise)))
