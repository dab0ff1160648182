"""Telemetry of the door as a signal: numbered samples, lost ones counted, and a check for impossible values."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from struct import Struct

from palpate.devices.device import Block, DeviceFault
from palpate.devices.door.link.codes import fault_name, state_name
from palpate.devices.door.link.dialogue import latched_fault
from palpate.devices.door.link.link import Arrived, Link
from palpate.devices.door.link.messages import Telemetry

CHANNELS = ("angle", "velocity", "torque", "brake", "state")
UNITS = ("deg", "deg/s", "N m", "A", "code")
ROW = Struct("<5f")
SAMPLES = 1 << 32
ANGLE_DEG = 90.0
"""No door of this kind opens as far, in either direction."""
TORQUE_NM = 500.0
LOST = "lost on the line"


def row(sample: Telemetry) -> bytes:
    """Return a sample as a row of CHANNELS."""
    return ROW.pack(sample.angle_deg, sample.velocity_deg_s, sample.torque_Nm, sample.brake_A, sample.state)


def untrue(name: str, sample: Telemetry) -> DeviceFault | None:
    """Return a fault for impossible values of a sample, as a second check beside the device's own."""
    values = (sample.angle_deg, sample.velocity_deg_s, sample.torque_Nm, sample.brake_A)
    if not all(map(math.isfinite, values)):
        return DeviceFault(name, "not_a_number", f"{name}: telemetry that is not a number: {values}")
    if abs(sample.angle_deg) > ANGLE_DEG or abs(sample.torque_Nm) > TORQUE_NM:
        reading = f"{sample.angle_deg:.1f} deg, {sample.torque_Nm:.1f} N m"
        return DeviceFault(name, "over_range", f"{name}: telemetry that cannot be: {reading}")
    return None


@dataclass
class TelemetryBlocks:
    """A builder of blocks from telemetry; the first sample after the start is number 0."""

    start: int | None = None
    next: int = 0

    def blocks(self, arrived: Iterable[Arrived]) -> list[Block]:
        """Join consecutive samples into blocks; drop a sample that came twice or late."""
        blocks: list[Block] = []
        run: list[Arrived] = []
        for at_ns, sample in arrived:
            if self.start is None:
                self.start = sample.sample
            ahead = (sample.sample - self.start - self.next) % SAMPLES
            number = self.next + (ahead if ahead < SAMPLES // 2 else ahead - SAMPLES)
            if number < self.next:
                continue
            if number > self.next:
                blocks += self._block(run)
                blocks.append(Block(number, b"", at_ns, lost=number - self.next, why=LOST))
                self.next, run = number, []
            run.append((at_ns, sample))
            self.next += 1
        # A gap without samples goes with the block that follows it.
        kept: list[Block] = []
        for block in blocks + self._block(run):
            if kept and not kept[-1].data:
                gap = kept.pop()
                block = Block(block.first, block.data, block.at_ns, block.device_s, gap.lost, gap.why)  # noqa: PLW2901
            kept.append(block)
        return kept

    def _block(self, run: list[Arrived]) -> list[Block]:
        if not run:
            return []
        at_ns, last = run[-1]
        data = b"".join(row(sample) for _, sample in run)
        return [Block(self.next - len(run), data, at_ns, last.t_us / 1e6)]


@dataclass
class Opening:
    """A detector of a complete opening from closed, and of the return; it sees every sample of telemetry."""

    end_deg: float
    closed_deg: float = 3.0
    nearly_deg: float = 2.0
    most_deg: float = 0.0
    closed: bool = False
    opened: bool = False
    back: bool = False

    def see(self, sample: Telemetry) -> None:
        """Use the sample as the door's current position."""
        angle = sample.angle_deg
        self.most_deg = max(self.most_deg, angle) if self.closed and math.isfinite(angle) else self.most_deg
        if angle <= self.closed_deg:
            self.closed, self.back = True, self.back or self.opened
        elif self.closed and angle >= self.end_deg - self.nearly_deg:
            self.opened = True


def trouble(link: Link, state: int | None) -> DeviceFault | None:
    """Return the door's current fault; `state` is the expected state, or None for any."""
    if link.broken is not None:
        return link.broken
    if link.quiet_s() > link.timing.silent_s:
        return DeviceFault(link.name, "silent", f"{link.name}: no telemetry for {link.quiet_s():.1f} s")
    latest, report = link.latest, link.report
    if latest is None:
        return None
    if latest.fault or report is not None:
        return latched_fault(link.name, latest.fault or (report.fault if report else 0))
    if state is not None and latest.state != state:
        reading = f"the door is {state_name(latest.state)} where it should be {state_name(state)}"
        return DeviceFault(link.name, "firmware", f"{link.name}: {reading} (fault: {fault_name(latest.fault)})")
    return untrue(link.name, latest)
