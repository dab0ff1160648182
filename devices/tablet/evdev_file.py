"""A tablet through Linux' /dev/input/eventN, or bytes that were recorded from one."""

from __future__ import annotations

import errno
import os
import select
import stat
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

from palpate.devices.signals import DeviceError, DeviceFault
from palpate.devices.tablet.evdev import ABS_PRESSURE, ABS_X, ABS_Y, RECORD, Assembler, Raw
from palpate.devices.tablet.evdev_kernel import (
    Axis,
    Ioctl,
    axis_of,
    input_devices,
    kernel,
    name_of,
    state_of,
    timed_monotonic,
)  # fmt: skip
from palpate.devices.tablet.reports import Batch, Elapsed, Report

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

RECORDS = 64
NAMES = {ABS_X: "x", ABS_Y: "y", ABS_PRESSURE: "pressure"}


@dataclass
class EventFile:
    """Reads an event file; `axes` (x, y, pressure) stand in for what the kernel says of them, where they are given."""

    name: str
    path: Path
    axes: Mapping[str, Axis]
    ask: Ioctl = kernel
    monotonic_s: Callable[[], float] = time.monotonic
    file: int = -1
    special: bool = False
    aligned: bool = False
    behind_s: float = 0.0
    assembler: Assembler = field(default_factory=Assembler)
    ranges: dict[int, Axis] = field(default_factory=dict)
    reading: Lock = field(default_factory=Lock)

    def open(self) -> Mapping[str, str]:
        """Open it and learn its axes.

        Raises:
            DeviceError: no such file (naming the input devices that there are), no right to read it, no tablet.
        """
        try:
            self.file = os.open(self.path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
        except OSError as problem:
            raise DeviceError(self._not_there(problem)) from None
        try:
            self.special = stat.S_ISCHR(os.fstat(self.file).st_mode)
            title = name_of(self.ask, self.file)
            self.ranges = {code: self._axis(code, title) for code in NAMES}
        except DeviceError:
            self.close()
            raise
        self.aligned = timed_monotonic(self.ask, self.file)
        self.assembler = self._assembler()
        x, y, pressure = (self.ranges[code] for code in NAMES)
        size = f"{(x.most - x.least) / x.per_mm:.0f} x {(y.most - y.least) / y.per_mm:.0f} mm"
        return {"tablet": title or self.path.name, "size": size, "pressures": str(pressure.most - pressure.least + 1)}

    def expect(self, scene: Scene | None) -> None:
        """A real stylus goes where a hand leads it."""

    def start(self, elapsed_s: Elapsed) -> None:
        """Begin; what waits from before is dropped, where it is a device. Raises DeviceError where it is not open."""
        with self.reading:
            if self.file < 0:
                raise DeviceError(f"{self.name} is not open.")
            while self.special and select.select([self.file], [], [], 0)[0] and self._bytes():
                pass
            self.assembler = self._assembler()
            self.behind_s = self.monotonic_s() - elapsed_s()

    def pull(self, timeout_s: float) -> Batch:
        """What came.

        Raises:
            DeviceFault: `link_lost` where it was unplugged, or where the bytes end.
        """
        with self.reading:
            if self.file < 0 or not select.select([self.file], [], [], timeout_s)[0]:
                return Batch()
            before = self.assembler.dropped
            raws = list(self.assembler.feed(self._bytes()))
            return Batch([self._report(raw) for raw in raws], self.assembler.dropped - before)

    def stop(self) -> None:
        """The file stays open, so that nothing else has to be asked again."""

    def close(self) -> None:
        """Let go of it."""
        with self.reading:
            if self.file >= 0:
                os.close(self.file)
            self.file = -1

    def _bytes(self) -> bytes:
        """At least one byte."""
        try:
            data = os.read(self.file, RECORDS * RECORD.size)
        except BlockingIOError:
            return b""
        except OSError as problem:
            told = "was unplugged" if problem.errno == errno.ENODEV else f"cannot be read: {problem.strerror}"
            raise DeviceFault(self.name, "link_lost", f"{self.name}: {self.path} {told}; plug it in again.") from None
        if not data:
            cut = self.assembler.cut_off
            told = f" in the middle of a record ({cut} of {RECORD.size} bytes)" if cut else ""
            raise DeviceFault(self.name, "link_lost", f"{self.name}: {self.path} ended{told}.")
        return data

    def _report(self, raw: Raw) -> Report:
        x, y, pressure = (self.ranges[code] for code in NAMES)
        return Report(
            raw.t_s - (self.behind_s if self.aligned else 0.0),
            (raw.x - x.least) / x.per_mm,
            (raw.y - y.least) / y.per_mm,
            (raw.pressure - pressure.least) / (pressure.most - pressure.least),
            raw.touching,
            not raw.known,
        )

    def _assembler(self) -> Assembler:
        return Assembler(lambda: state_of(self.ask, self.file))

    def _axis(self, code: int, title: str) -> Axis:
        axis = self.axes.get(NAMES[code]) or axis_of(self.ask, self.file, code)
        what = f"{self.name}: {self.path} ({title or 'no name'})"
        if axis is None:
            other = "; a touch screen for fingers?" if code == ABS_PRESSURE else ""
            raise DeviceError(
                f"{what} has no {NAMES[code]} axis: not a stylus tablet{other} {self._there()} "
                "Bytes recorded from one need `axes` in the rig file."
            )
        if axis.most <= axis.least:
            raise DeviceError(f"{what}: its {NAMES[code]} axis goes from {axis.least} to {axis.most}; set `axes`.")
        if code != ABS_PRESSURE and axis.per_mm <= 0:
            raise DeviceError(f"{what} does not say how long its {NAMES[code]} axis is: set `axes` with `per_mm`.")
        return axis

    def _not_there(self, problem: OSError) -> str:
        told = f"{self.name}: {self.path} cannot be opened: {problem.strerror}."
        if problem.errno in (errno.EACCES, errno.EPERM):
            return f"{told} Let the station's user into the group that owns it (often `input`)."
        return f"{told} {self._there()}"

    def _there(self) -> str:
        return f"Input devices that there are: {', '.join(input_devices()) or 'none'}."
