"""Was the marker really seen? Trackers tell of a hidden marker in many ways, and none may pass for a position."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field

from palpate.devices.tracker.source import Row

NAN = math.nan
HIDDEN = {
    "not_seen": "the tracker says that it does not see it",
    "not_a_number": "positions that are no numbers",
    "zeros": "all zeros, which Motive sends for a marker it lost",
    "frozen": "the position before, repeated to the last bit",
}
"""How a hidden marker shows, and what that is in words."""


@dataclass
class Watch:
    """Takes samples one by one and turns those of a hidden marker into NaN; counts why.

    A measured position is never equal to the one before in all three axes: noise far above the last bit stands
    against it. Where positions were rounded (a recording with few digits), `repeats` lets equal ones pass.
    """

    repeats: bool = False
    counts: Counter[str] = field(default_factory=Counter)
    before: tuple[float, float, float] | None = None

    def see(self, row: Row) -> tuple[float, float, float, float]:
        """x, y, z in mm and 1, or NaN three times and 0."""
        why = self._hidden(row)
        self.before = row[:3]
        self.counts[why or "seen"] += 1
        return (NAN, NAN, NAN, 0.0) if why else (*row[:3], 1.0)

    def _hidden(self, row: Row) -> str | None:
        place = row[:3]
        if not row[3]:
            return "not_seen"
        if not all(map(math.isfinite, place)):
            return "not_a_number"
        if not any(place):
            return "zeros"
        return "frozen" if place == self.before and not self.repeats else None
