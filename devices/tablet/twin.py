"""A simulated tablet: its stylus follows the scene's hand, and reports as a real one would."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain, count, pairwise
from typing import TYPE_CHECKING

from palpate.devices.device import DeviceFault
from palpate.devices.noise import gaussians
from palpate.devices.source import Elapsed, TimedSource
from palpate.devices.tablet.force import Force
from palpate.devices.tablet.reports import Batch, Report

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

TRUTH_HZ = 1000.0
MOST = 256
DRAWN = 256
LOOKED = 1024
"""Greatest number of moments that are searched for a change; a scene at rest has none."""


@dataclass
class TwinTablet(TimedSource):
    """A tablet with reports at `report_hz` with jitter, positions in steps of `step_mm`, and `levels` of pressure.

    Like a real tablet it is silent while nothing changes. The force is the magnitude of the scene's third component.
    """

    name: str
    force: Force
    report_hz: float
    jitter_s: float
    step_mm: float
    levels: int
    seed: int
    aligned: bool = True
    scene: Scene | None = None
    reports: Iterator[tuple[float, Report | None]] = field(default_factory=lambda: iter(()))
    ahead: tuple[float, Report | None] | None = None
    unplugged: bool = False

    def open(self) -> Mapping[str, str]:
        """Return the twin's description; there is no device to open."""
        return {"twin": f"{self.report_hz:g} reports a second, {self.levels} pressures, seed {self.seed}"}

    def expect(self, scene: Scene | None) -> None:
        """Follow this scene from the next start on; None: the stylus is away."""
        self.scene = scene

    def start(self, elapsed_s: Elapsed) -> None:
        """Begin with the first moment of the scene."""
        self.ahead = None
        self.reports = iter(()) if self.scene is None else self._reports(self.scene)
        super().start(elapsed_s)

    def pull(self, timeout_s: float) -> Batch:
        """Return the reports due by now, at most 256. Raises DeviceFault if the twin is unplugged."""
        if self.unplugged:
            raise DeviceFault(self.name, "link_lost", f"{self.name}: the tablet is unplugged.")
        elapsed_s = self.elapsed_s
        if elapsed_s is None:
            return Batch()
        due: list[Report] = []
        now_s = elapsed_s()
        while len(due) < MOST and (one := self._next(now_s)) is not None:
            due.append(one)
        if not due:
            self.stopped.wait(timeout_s)
        return Batch(due)

    def _next(self, now_s: float) -> Report | None:
        """Return the next report that is due and differs from the last."""
        for _ in range(LOOKED):
            self.ahead = self.ahead or next(self.reports, None)
            if self.ahead is None or self.ahead[0] > now_s:
                return None
            (_, one), self.ahead = self.ahead, None
            if one is not None:
                return one
        return None

    def _reports(self, scene: Scene) -> Iterator[tuple[float, Report | None]]:
        """Yield reports in order of time, None if nothing changed."""
        places = scene.position_mm(TRUTH_HZ)
        first = next(places)
        key = hashlib.sha256(first.astype("<f8").tobytes()).hexdigest()
        xy = (row for piece in chain([first], places) for row in piece[:, :2].tolist())
        force = (force_N for piece in scene.wrench(TRUTH_HZ) for force_N in piece[:, 2].tolist())
        truth = pairwise((x, y, force_N) for (x, y), force_N in zip(xy, force, strict=False))
        last: tuple[float, float, float] | None = None
        at, (before, after) = 0, next(truth)
        for t_s in self._times(key):
            while at + 1 <= t_s * TRUTH_HZ:
                at, (before, after) = at + 1, next(truth)
            part = t_s * TRUTH_HZ - at
            x, y, force_N = (b + part * (a - b) for b, a in zip(before, after, strict=True))
            pressure = round(self.force.pressure(abs(force_N)) * (self.levels - 1)) / (self.levels - 1)
            now = self._steps(x), self._steps(y), pressure
            yield t_s, None if now == last else Report(t_s, *now, now[2] > 0)
            last = now

    def _times(self, key: str) -> Iterator[float]:
        """Yield report times, evenly spaced with jitter that never changes their order."""
        most = 0.45 / self.report_hz
        for block in count():
            drawn = gaussians(DRAWN, "tablet", self.seed, self.name, key, block)
            for number, jitter in enumerate(drawn, block * DRAWN):
                yield max(0.0, number / self.report_hz + max(-most, min(most, self.jitter_s * jitter)))

    def _steps(self, mm: float) -> float:
        return self.step_mm * round(mm / self.step_mm)
