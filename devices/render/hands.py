"""Where speed and force come from: a recording, a simulated hand, a stylus, or whoever pushes reports."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from palpate.devices.tablet.device import Tablet
from palpate.devices.tablet.pipeline import Shape, Stylus
from palpate.devices.tablet.reports import Guard, Report
from palpate.signals.textures.sounds import RenderError

RATE_HZ = 1000


class Hand(Protocol):
    """Speed in mm/s and force in N, asked for once for every sample that is played."""

    def at(self, sample: int) -> tuple[float, float]:
        """Those of the sample of this number; a live hand gives its newest."""


@dataclass(frozen=True)
class Scripted:
    """A hand known beforehand, at 1 kHz; away after its end."""

    speed_mm_s: Sequence[float]
    force_N: Sequence[float]

    def __post_init__(self) -> None:
        if len(self.speed_mm_s) != len(self.force_N):
            raise RenderError(f"{len(self.speed_mm_s)} speeds and {len(self.force_N)} forces: as many are expected.")

    def __len__(self) -> int:
        return len(self.speed_mm_s)

    @property
    def seconds(self) -> float:
        """How long it is."""
        return len(self) / RATE_HZ

    def at(self, sample: int) -> tuple[float, float]:
        """Those of that millisecond."""
        if 0 <= sample < len(self.speed_mm_s):
            return self.speed_mm_s[sample], self.force_N[sample]
        return 0.0, 0.0


@dataclass
class OnTablet:
    """The stylus of an open tablet that was started; nobody else may read it meanwhile."""

    tablet: Tablet

    def at(self, sample: int) -> tuple[float, float]:  # noqa: ARG002 - a live hand has no other than its newest
        """The newest. Raises DeviceFault where the tablet fails."""
        self.tablet.read(0.0)
        return self.tablet.felt


@dataclass
class Pushed:
    """Reports that somebody pushes, as a window does with its mouse; from any one thread.

    `elapsed_s` is the clock that the reports are timed by.
    """

    elapsed_s: Callable[[], float]
    shape: Shape = field(default_factory=Shape)
    refused: Guard = field(default_factory=lambda: Guard("hand", aligned=True))
    felt: tuple[float, float] = (0.0, 0.0)
    _waiting: deque[Report] = field(default_factory=lambda: deque(maxlen=4096))
    _stylus: Stylus = field(init=False)
    _ticks: int = 0

    def __post_init__(self) -> None:
        self._stylus = Stylus(self.shape)

    def push(self, report: Report) -> None:
        """A report came, timed by the clock."""
        self._waiting.append(report)

    def at(self, sample: int) -> tuple[float, float]:  # noqa: ARG002 - a live hand has no other than its newest
        """The newest. Raises DeviceFault where too many reports in a row cannot be believed."""
        now_s = self.elapsed_s()
        due = int(now_s * RATE_HZ) + 1
        if due - self._ticks > RATE_HZ:  # nobody asked for a second: only what is newest matters
            self._ticks = due - 1
        while self._ticks < due:
            t_s = self._ticks / RATE_HZ
            self._take(t_s, now_s)
            self.felt = self._stylus.step(t_s)
            self._ticks += 1
        return self.felt

    def _take(self, t_s: float, now_s: float) -> None:
        while self._waiting and self._waiting[0].t_s <= t_s:
            judged = self.refused.judge(self._waiting.popleft(), now_s)
            if judged is not None:
                self._stylus.report(judged)
