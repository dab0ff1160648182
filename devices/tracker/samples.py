"""Samples of a tracker's source, and their processing.

Samples get numbers, so that missing ones are counted; those of a hidden marker become NaN; counts show its health.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from threading import Event
from typing import ClassVar, Protocol

from palpate.devices.device import NowNs
from palpate.devices.source import Source

MarkerSample = tuple[float, float, float, bool]
"""The reported position of the marker in mm, and whether the tracker reports it as visible."""
NAN = math.nan
HIDDEN = {
    "not_seen": "the tracker reports that it does not see it",
    "not_a_number": "positions that are not numbers",
    "zeros": "all zeros, which Motive sends for a marker it lost",
    "frozen": "the position before, repeated to the last bit",
}
"""Ways in which a hidden marker shows, with descriptions."""
PULL, DRIFT = 0.1, 0.003
"""How much of a sample's deviation from its expected time moves the expectation, and how much of it the period: one
sample's jitter counts for a tenth of what it is, and a rate that is a little off is followed without falling behind."""
FARTHEST = 0.03
"""Greatest relative deviation of the period from the nominal one; a larger one shows as missing samples."""
TOGETHER = 8
"""Number of samples that are numbered together; few enough that a rate 2 % off is not taken for loss among them."""


@dataclass(frozen=True)
class Batch:
    """Samples as they arrived, with their times in seconds of the source's clock.

    `reset` says that this clock was reset since the batch before; `away` is then how many samples are missing.
    """

    times_s: Sequence[float] = ()
    rows: Sequence[MarkerSample] = ()
    reset: bool = False
    away: int = 0


@dataclass(frozen=True)
class Opened:
    """Facts from opening a source: its declared rate (0: none) and facts to show."""

    declared_hz: float = 0.0
    facts: Mapping[str, str] = field(default_factory=dict)


class TrackerSource(Source[Opened, Batch], Protocol):
    """A source of rows, with times of its own clock."""

    clock: str

    def zero_s(self, now_ns: NowNs) -> float:
        """Return the source's clock when now_ns was 0; 0 for a clock that is not this computer's."""


def awaited(take: Callable[[], Batch], stopped: Event, timeout_s: float, step_s: float) -> Batch:
    """Return the first batch with samples, taken every `step_s`; an empty one after the timeout or a stop."""
    end_s = time.monotonic() + timeout_s
    while not (batch := take()).rows:
        left_s = end_s - time.monotonic()
        if left_s <= 0 or stopped.wait(min(left_s, step_s)):
            break
    return batch


@dataclass
class OcclusionDetector:
    """A detector of hidden markers, whose samples it turns into NaN; it counts the reasons.

    A measured position is never equal to the one before in all three axes, as noise exceeds the last bit by far. If
    positions were rounded (a recording with few digits), `repeats` accepts equal ones.
    """

    repeats: bool = False
    counts: Counter[str] = field(default_factory=Counter)
    before: tuple[float, float, float] | None = None

    def see(self, row: MarkerSample) -> tuple[float, float, float, float]:
        """Return x, y, z in mm and 1, or NaN three times and 0."""
        why, place = "", row[:3]
        if not row[3]:
            why = "not_seen"
        elif not all(map(math.isfinite, place)):
            why = "not_a_number"
        elif not any(place):
            why = "zeros"
        elif place == self.before and not self.repeats:
            why = "frozen"
        self.before = place
        self.counts[why or "seen"] += 1
        return (NAN, NAN, NAN, 0.0) if why else (*place, 1.0)


@dataclass
class Numbering:
    """Numbers for samples at `rate_hz`, which always rise.

    A sample's lateness is its time stamp against the expected one, in periods, rounded: so many are missing before it.
    If a later sample that arrived with it is less late, only its time stamp was late, and nothing is missing.
    """

    rate_hz: float
    next: int = 0
    expected_s: float = math.nan
    slower: float = 0.0

    def number(self, times_s: Sequence[float]) -> list[int]:
        """Return the numbers of samples that arrived together, in that order."""
        numbers: list[int] = []
        for first in range(0, len(times_s), TOGETHER):
            part_s = times_s[first : first + TOGETHER]
            if math.isnan(self.expected_s):
                self.expected_s = part_s[0]
            period_s = (1 + self.slower) / self.rate_hz
            late = [(t_s - self.expected_s) / period_s - place for place, t_s in enumerate(part_s)]
            least = list(accumulate(reversed(late), min))[::-1]
            missing = list(accumulate((max(0, round(periods)) for periods in least), max))
            numbers += [self.next + place + lost for place, lost in enumerate(missing)]
            off = sum(max(-1.0, min(1.0, periods - lost)) for periods, lost in zip(late, missing, strict=True))
            self.expected_s += (len(part_s) + missing[-1] + PULL * off) * period_s
            self.slower = max(-FARTHEST, min(FARTHEST, self.slower + DRIFT * off))
            self.next = numbers[-1] + 1
        return numbers

    def anew(self, away: int) -> None:
        """Record that the clock was reset and so many samples are missing; the next time stamp is taken as it is."""
        self.next += away
        self.expected_s = math.nan


@dataclass
class Tally:
    """Counts of samples; the rate is that of received samples, by their own time stamps."""

    TOLERANCE: ClassVar[float] = 0.02
    came: int = 0
    seen: int = 0
    lost: int = 0
    spans: int = 0
    spanned_s: float = 0.0
    last_s: float = math.nan

    def add(self, came: int, seen: int, lost: int) -> None:
        """Add the numbers of received, visible, and missing samples."""
        self.came, self.seen, self.lost = self.came + came, self.seen + seen, self.lost + lost

    def took(self, batch: Batch) -> None:
        """Add the batch's times to the measured rate, but not across a reset of the clock."""
        if not batch.times_s:
            return
        before = batch.times_s[0] if batch.reset or math.isnan(self.last_s) else self.last_s
        self.spans += len(batch.times_s) - (before == batch.times_s[0])
        self.spanned_s += batch.times_s[-1] - before
        self.last_s = batch.times_s[-1]

    @property
    def rate_hz(self) -> float:
        """Return received samples per second of their own clock; 0 for fewer than two."""
        return self.spans / self.spanned_s if self.spanned_s > 0 else 0.0

    def summary(self, nominal_hz: float, noise_mm: Sequence[float], counts: Mapping[str, int]) -> tuple[bool, str]:
        """Return whether all is well, and a summary line."""
        right = abs(self.rate_hz / nominal_hz - 1) <= self.TOLERANCE
        rate = f"{self.rate_hz:.2f} Hz" + ("" if right else f", not the {nominal_hz:g} Hz of the rig file")
        hidden = ", ".join(f"{counts[why]} x {words}" for why, words in HIDDEN.items() if counts.get(why))
        share = f"seen {100 * self.seen / max(1, self.came):.1f} % of {self.came} samples"
        noise = f"noise {max(noise_mm):.3f} mm" if self.seen > 1 else "no marker is seen: put it in view"
        missing = f"{self.lost} missing" if self.lost else ""
        return right and self.seen > 1, "; ".join(filter(None, (rate, share, hidden, missing, noise)))
