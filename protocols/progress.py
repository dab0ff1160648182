"""Lines that report the progress of a long computation and the time that it still needs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

Report = Callable[[str], None]
"""Takes a line that reports the progress of a computation."""
Progress = Callable[[int, int, str], None]
"""Shows the progress of a computation: how many steps are done, of how many, and of what."""
Clock = Callable[[], float]
"""Returns seconds; only differences matter."""
RECENT = 5


def silent(_line: str) -> None:
    """Report nothing."""


def lasting(seconds: float) -> str:
    """Return a time for people to read: 8 s, 3 min, 2 h 05 min."""
    whole = round(seconds)
    if whole < 1:
        return "less than 1 s"
    if whole < 100:
        return f"{whole} s"
    minutes = round(whole / 60)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60:02d} min"


@dataclass
class Pace:
    """The pace of a computation: the time left is estimated from the last few steps, as the first are slower."""

    steps: int
    clock: Clock
    done: int = 0
    _times: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._times.append(self.clock())

    def step(self) -> None:
        """Record that one more step is done."""
        self.done += 1
        self._times = [*self._times[-RECENT:], self.clock()]

    @property
    def left_s(self) -> float:
        """Return the seconds until all steps are done at the pace of the last few; 0 before the first."""
        taken = len(self._times) - 1
        return (self._times[-1] - self._times[0]) / taken * (self.steps - self.done) if taken else 0.0
