"""Lines that tell how far a long computation is and how long it will still take."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

Report = Callable[[str], None]
"""Takes a line that says how far a computation is."""
Progress = Callable[[int, int, str], None]
"""Shows how far the work is: how many are done, of how many, of what."""
Clock = Callable[[], float]
"""Gives seconds; only their differences count."""
RECENT = 5


def silent(_line: str) -> None:
    """Reports nothing."""


def lasting(seconds: float) -> str:
    """A time as a person says it: 8 s, 3 min, 2 h 05 min."""
    whole = round(seconds)
    if whole < 1:
        return "less than 1 s"
    if whole < 100:
        return f"{whole} s"
    minutes = round(whole / 60)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60:02d} min"


@dataclass
class Pace:
    """How long steps take: the time left is judged by the last few, since the first are slower than the others."""

    steps: int
    clock: Clock
    done: int = 0
    _times: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._times.append(self.clock())

    def step(self) -> None:
        """One more step is done."""
        self.done += 1
        self._times = [*self._times[-RECENT:], self.clock()]

    @property
    def left_s(self) -> float:
        """Seconds until all steps are done, if they go on as the last few went; 0 before the first."""
        taken = len(self._times) - 1
        return (self._times[-1] - self._times[0]) / taken * (self.steps - self.done) if taken else 0.0
