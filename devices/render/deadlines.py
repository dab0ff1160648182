"""Whether every millisecond was met: how late each step was ready, counted without keeping the steps."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

NS_US = 1000
LATE_US = 1000.0
"""A step that is ready after the next one is due would have been missed without a buffer."""
EDGES_US = tuple(float(round(2 ** (place / 4), 3)) for place in range(2 * 4, 18 * 4 + 1))
"""Upper edges of the histogram's cells, from 4 us to 0.26 s in quarters of an octave; one more cell lies beyond."""


@dataclass
class Deadlines:
    """Steps, how many were late, the worst, and a histogram, of times in ns from when a step was due.

    `skipped` are those among the late ones that were caught up with in one go, since a later one was due by then.
    """

    steps: int = 0
    late: int = 0
    skipped: int = 0
    worst_us: float = 0.0
    cells: list[int] = field(default_factory=lambda: [0] * (len(EDGES_US) + 1))

    def note(self, took_ns: int) -> None:
        """A step was ready so long after it was due."""
        us = took_ns / NS_US
        self.steps += 1
        self.cells[bisect_left(EDGES_US, us)] += 1
        if us > LATE_US:
            self.late += 1
        self.worst_us = max(self.worst_us, us)

    def skip(self, took_ns: int) -> None:
        """A step that was due meanwhile is ready only now, together with the others."""
        self.skipped += 1
        self.note(took_ns)

    @property
    def late_share(self) -> float:
        """Of all steps."""
        return self.late / self.steps if self.steps else 0.0

    def quantile_us(self, share: float) -> float:
        """The upper edge of the cell that this share of the steps reaches: at most 19 % too much."""
        wanted, seen = share * self.steps, 0
        for count, edge in zip(self.cells, EDGES_US, strict=False):
            seen += count
            if seen >= wanted and seen:
                return min(edge, self.worst_us)
        return self.worst_us

    def record(self) -> Mapping[str, Any]:
        """As JSON data."""
        cells = {f"{edge:g}": count for edge, count in zip((*EDGES_US, -1.0), self.cells, strict=True) if count}
        return {
            "steps": self.steps, "late": self.late, "late_share": self.late_share, "skipped": self.skipped,
            "median_us": round(self.quantile_us(0.5), 1), "p99_us": round(self.quantile_us(0.99), 1),
            "p999_us": round(self.quantile_us(0.999), 1), "worst_us": round(self.worst_us, 1), "cells_us": cells,
        }  # fmt: skip
