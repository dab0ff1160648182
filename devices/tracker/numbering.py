"""Which sample is it? Numbers by time stamps, so that samples that never came are counted and not passed over."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

PULL, DRIFT = 0.1, 0.003
"""How much of a sample's deviation from its expected time moves the expectation, and how much of it the period: one
sample's jitter counts for a tenth of what it is, and a rate that is a little off is followed without falling behind."""
FARTHEST = 0.03
"""How far the period may be from the nominal one, relatively; a rate that is farther off shows as missing samples."""
TOGETHER = 8
"""Samples that are judged together; few enough that a rate 2 % off is not taken for loss among them."""


@dataclass
class Numbering:
    """Numbers for samples that are taken `rate_hz` times a second; they always rise.

    A sample is as late as its time stamp is against the expected one, in periods, rounded: so many are missing before
    it. Where a later sample that came with it is less late, it was only stamped late, and nothing is missing.
    """

    rate_hz: float
    next: int = 0
    expected_s: float = math.nan
    slower: float = 0.0

    def number(self, times_s: Sequence[float]) -> list[int]:
        """The numbers of samples that came together, in that order."""
        parts = (times_s[first : first + TOGETHER] for first in range(0, len(times_s), TOGETHER))
        return [number for part in parts for number in self._few(part)]

    def anew(self, away: int) -> None:
        """The clock was set anew and so many samples are missing; the next time stamp is taken as it is."""
        self.next += away
        self.expected_s = math.nan

    def _few(self, times_s: Sequence[float]) -> list[int]:
        if math.isnan(self.expected_s):
            self.expected_s = times_s[0]
        period_s = (1 + self.slower) / self.rate_hz
        late = [(t_s - self.expected_s) / period_s - place for place, t_s in enumerate(times_s)]
        least = list(accumulate(reversed(late), min))[::-1]
        missing = list(accumulate((max(0, round(each)) for each in least), max))
        numbers = [self.next + place + lost for place, lost in enumerate(missing)]
        off = sum(max(-1.0, min(1.0, each - lost)) for each, lost in zip(late, missing, strict=True))
        self.expected_s += (len(times_s) + missing[-1] + PULL * off) * period_s
        self.slower = max(-FARTHEST, min(FARTHEST, self.slower + DRIFT * off))
        self.next = numbers[-1] + 1
        return numbers
