"""Errors of the conversion of reports to 1 kHz: its delay, and the error that remains after its removal."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from palpate.devices.noise import gaussians
from palpate.devices.tablet.pipeline import Shape, Stylus
from palpate.devices.tablet.reports import Report

SETTLED_S = 1.0
Sample = tuple[float, float, float]


@dataclass(frozen=True)
class Stroke:
    """A stylus that goes round a circle in mm; its speed and force vary `frequency_hz` times a second.

    Reports have jitter; positions and pressures are quantised.
    """

    radius_mm: float = 25.0
    frequency_hz: float = 1.0
    force_N: float = 1.0
    jitter_s: float = 0.0005
    step_mm: float = 0.01
    levels: int = 1024
    seed: int = 1

    def speed_mm_s(self, t_s: float) -> float:
        """Return the true speed: 0.5 to 1.5 times the mean one."""
        return self.radius_mm * self._omega * (1 + 0.5 * math.cos(self._omega * t_s))

    def pressed_N(self, t_s: float) -> float:
        """Return the true force: 0.5 to 1.5 times the mean one."""
        return self.force_N * (1 + 0.5 * math.sin(self._omega * t_s))

    def reports(self, shape: Shape, seconds: float) -> list[Report]:
        """Return a tablet's reports of the stroke."""
        count = round(seconds * shape.report_hz)
        jitter = gaussians(count, "stroke", self.seed)
        most = 0.45 / shape.report_hz
        times = (n / shape.report_hz + max(-most, min(most, self.jitter_s * error)) for n, error in enumerate(jitter))
        return [self._report(shape, max(0.0, t_s)) for t_s in times]

    @property
    def _omega(self) -> float:
        return 2 * math.pi * self.frequency_hz

    def _report(self, shape: Shape, t_s: float) -> Report:
        turned = self._omega * t_s + 0.5 * math.sin(self._omega * t_s)
        x, y = self.radius_mm * math.cos(turned), self.radius_mm * math.sin(turned)
        level = round(shape.force.pressure(self.pressed_N(t_s)) * (self.levels - 1)) / (self.levels - 1)
        return Report(t_s, self.step_mm * round(x / self.step_mm), self.step_mm * round(y / self.step_mm), level, True)


@dataclass(frozen=True)
class Errors:
    """The best-fitting delay, the RMS error without it, and the RMS error at the same instant."""

    delay_s: float
    left: float
    now: float


def convert_reports(shape: Shape, reports: Sequence[Report], seconds: float) -> list[Sample]:
    """Return time, speed and force of every millisecond, from these reports."""
    stylus, place, out = Stylus(shape), 0, []
    for tick in range(round(seconds * shape.rate_hz)):
        t_s = tick / shape.rate_hz
        while place < len(reports) and reports[place].t_s <= t_s:
            stylus.report(reports[place])
            place += 1
        out.append((t_s, *stylus.step(t_s)))
    return out


def errors(out: Sequence[Sample], channel: int, truth: Callable[[float], float]) -> Errors:
    """Return the errors of channel 1 (speed) or 2 (force) against the truth, after the first second."""
    settled = [(sample[0], sample[channel]) for sample in out if sample[0] >= SETTLED_S]

    def rms(late_s: float) -> float:
        return math.sqrt(math.fsum((value - truth(t_s - late_s)) ** 2 for t_s, value in settled) / len(settled))

    near = min(range(0, 401, 20), key=lambda tenth_ms: rms(1e-4 * tenth_ms))
    best = min(range(max(0, near - 20), near + 21), key=lambda tenth_ms: rms(1e-4 * tenth_ms))
    return Errors(1e-4 * best, rms(1e-4 * best), rms(0.0))
