"""The firmware emulator as a process of its own, behind a pseudo-terminal: the same bytes as over the serial line.

    python -m palpate.devices.door.firmware.process --speed=1 --seed=1 [--ail=stuck@2500] [--log=FILE]

It prints {"port": PATH} and lives until its standard input ends, as it does when its parent is killed; then the plant
goes on without the host until the arm is safe. With --log, every change of state is noted there, one JSON line each.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import sys
import time
import tty
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from palpate.devices.door.firmware.ailments import AILMENTS, Ailing
from palpate.devices.door.firmware.controller import FIRMWARE, Firmware
from palpate.devices.door.firmware.sensor_check import Limits
from palpate.devices.door.firmware.twin_plant import Plant, TwinPlant
from palpate.devices.door.firmware.wire import Wire

AT_ONCE = 5
"""Milliseconds of the plant between two reads of the line, so that a late host is heard before it counts as lost."""
BEHIND = 20
"""Milliseconds that the plant may fall behind the wall clock before that time is given up."""
SAFE_BY_NOW = 200
"""Milliseconds of the plant after which a firmware without a host is certainly safe."""


@dataclass
class Log:
    """A file in which changes of state are recorded, as in a black box."""

    out: IO[str] | None
    last: tuple[Any, ...] = ()

    def note(self, firmware: Firmware, **more: object) -> None:
        """Record the state if it has changed."""
        now = (firmware.state, firmware.fault, firmware.plant.mode)
        if self.out is None or (now == self.last and not more):
            return
        self.last, reading = now, firmware.reading
        entry = {
            "t_ms": firmware.t_ms, "beat_ms": firmware.beat_ms, "state": firmware.state.name,
            "fault": firmware.fault.name, "mode": firmware.plant.mode,
            "motor_Nm": reading.motor_Nm if reading else 0.0, "brake_A": reading.brake_A if reading else 0.0, **more,
        }  # fmt: skip
        self.out.write(json.dumps(entry) + "\n")
        self.out.flush()


@dataclass
class Emulator:
    """A firmware, its line, and the pace of its time."""

    wire: Wire
    master: int
    speed: float
    log: Log
    began_s: float = field(default_factory=time.monotonic)
    ticks: int = 0
    given_up: int = 0

    def run(self) -> None:
        """Run until the parent has ended, and then until the door is safe."""
        os.set_blocking(self.master, False)
        pause_s = min(0.02, 0.001 / self.speed)
        while True:
            ready = select.select([self.master, sys.stdin.buffer], [], [], pause_s)[0]
            if sys.stdin.buffer in ready and not os.read(sys.stdin.fileno(), 1024):
                break
            if self.master in ready:
                self.wire.push(_read(self.master))
            behind = int((time.monotonic() - self.began_s) * 1000 * self.speed) - self.ticks - self.given_up
            if behind > BEHIND:
                self.given_up += behind - BEHIND
            for _ in range(min(max(behind, 0), AT_ONCE)):
                self._tick()
        # The host is gone: nobody reads, nothing beats.
        gone_ms = self.wire.firmware.t_ms
        for _ in range(SAFE_BY_NOW):
            self.wire.tick()
            self.log.note(self.wire.firmware, **({"host": "gone"} if self.wire.firmware.t_ms == gone_ms + 1 else {}))
        self.log.note(self.wire.firmware, host="gone, ended", given_up_ms=self.given_up)

    def _tick(self) -> None:
        self.ticks += 1
        out = self.wire.tick()
        self.log.note(self.wire.firmware)
        if out:
            try:
                os.write(self.master, out)
            except BlockingIOError:
                self.wire.lost += len(out)


def main(arguments: list[str] | None = None) -> None:
    """Run the emulator."""
    parser = argparse.ArgumentParser(prog="python -m palpate.devices.door.firmware.process", description=__doc__)
    parser.add_argument("--speed", type=float, default=1.0, help="seconds of the plant per second")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--baud", type=int, default=1_000_000)
    parser.add_argument("--serial-number", type=int, default=1)
    parser.add_argument("--firmware", type=int, choices=range(1, FIRMWARE + 1), default=FIRMWARE)
    parser.add_argument("--torque-limit", type=float, default=Limits.torque_Nm)
    parser.add_argument("--slope-limit", type=float, default=Limits.slope_Nm_deg)
    parser.add_argument("--speed-limit", type=float, default=Limits.speed_deg_s)
    parser.add_argument("--ail", default="", metavar="NAME@MS", help=f"one of {', '.join(AILMENTS)}, from a time on")
    parser.add_argument("--log", default="", help="note every change of state in this file")
    given = parser.parse_args(arguments)
    limits = Limits(given.torque_limit, given.slope_limit, given.speed_limit)
    plant: Plant = TwinPlant(given.seed)
    name, _, at = given.ail.partition("@")
    if name:
        plant = Ailing(plant, name, int(at or 0))
    firmware = Firmware(plant, limits, given.serial_number, given.firmware)
    master, slave = os.openpty()
    tty.setraw(slave)
    sys.stdout.write(json.dumps({"port": os.ttyname(slave)}) + "\n")
    sys.stdout.flush()
    with Path(given.log or os.devnull).open("w", encoding="utf-8") as out:
        Emulator(Wire(firmware, given.baud), master, given.speed, Log(out if given.log else None)).run()


def _read(master: int) -> bytes:
    try:
        return os.read(master, 4096)
    except OSError:  # a pseudo-terminal that nobody holds any more
        return b""


if __name__ == "__main__":
    main()
