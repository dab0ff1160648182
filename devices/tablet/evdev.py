"""A tablet through Linux' /dev/input/eventN, or bytes recorded from it.

A record is `struct input_event` on a 64-bit machine (kernel: Documentation/input/event-codes): two 8-byte numbers of
seconds and microseconds, two 2-byte ones of type and code, a 4-byte value. Records up to a SYN_REPORT belong together;
only changes are reported.
"""

from __future__ import annotations

import errno
import os
import select
import stat
import struct
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

from palpate.devices.device import DeviceError, DeviceFault, closed_on_failure
from palpate.devices.source import Elapsed
from palpate.devices.tablet.reports import Batch, Report

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

RECORD = struct.Struct("<qqHHi")
EV_SYN, EV_KEY, EV_ABS = 0, 1, 3
SYN_REPORT, SYN_DROPPED = 0, 3
ABS_X, ABS_Y, ABS_PRESSURE = 0x00, 0x01, 0x18
BTN_TOOL_PEN, BTN_TOUCH = 0x140, 0x14A
ABSINFO = struct.Struct("<6i")
"""value, minimum, maximum, fuzz, flat, resolution (units per mm for x and y)."""
KEYS = 96
"""Number of bytes with one bit for every key."""
MONOTONIC = 1
Ioctl = Callable[[int, int, bytes], bytes]
"""Calls the kernel with file, request and buffer, and returns the buffer. Raises OSError."""
RECORDS = 64
NAMES = {ABS_X: "x", ABS_Y: "y", ABS_PRESSURE: "pressure"}


@dataclass
class State:
    """The known state of the stylus, in the tablet's units; None: not known yet."""

    x: int | None = None
    y: int | None = None
    pressure: int | None = None
    touch: bool | None = None
    near: bool = True


@dataclass(frozen=True)
class Raw:
    """A report in the tablet's units; `known` is False if the stylus' position is unknown."""

    t_s: float
    x: int
    y: int
    pressure: int
    touching: bool
    known: bool


class Assembler:
    """A parser that assembles bytes into reports, however they were split.

    After the kernel dropped records (SYN_DROPPED), all up to the next SYN_REPORT are left out, and the state is
    queried; if that is not possible, the stylus counts as away until it is reported again.
    """

    def __init__(self, ask: Callable[[], State | None] = lambda: None) -> None:
        """Take `ask`, which returns the kernel's state or None."""
        self.state = ask() or State()
        self.dropped = 0
        self._ask = ask
        self._rest = b""
        self._dropping = False

    @property
    def cut_off(self) -> int:
        """Return the bytes of an incomplete record."""
        return len(self._rest)

    def feed(self, data: bytes) -> Iterator[Raw]:
        """Yield the reports that these bytes complete."""
        whole = self._rest + data
        end = len(whole) - len(whole) % RECORD.size
        self._rest = whole[end:]
        for second, micro, kind, code, value in RECORD.iter_unpack(whole[:end]):
            if kind == EV_SYN and code == SYN_DROPPED:
                self._dropping = True
            elif kind == EV_SYN and code == SYN_REPORT:
                yield self._report(second + 1e-6 * micro)
            elif not self._dropping:
                state = self.state
                if kind == EV_ABS and code == ABS_X:
                    state.x = value
                elif kind == EV_ABS and code == ABS_Y:
                    state.y = value
                elif kind == EV_ABS and code == ABS_PRESSURE:
                    state.pressure = value
                elif kind == EV_KEY and code == BTN_TOUCH:
                    state.touch = value != 0
                elif kind == EV_KEY and code == BTN_TOOL_PEN:
                    state.near = value != 0

    def _report(self, t_s: float) -> Raw:
        if self._dropping:
            self._dropping = False
            self.dropped += 1
            self.state = self._ask() or State()
        state = self.state
        known = state.near and state.x is not None and state.y is not None
        pressure = state.pressure or 0
        touching = known and pressure > 0 and state.touch is not False
        return Raw(t_s, state.x or 0, state.y or 0, pressure, touching, known)


@dataclass(frozen=True)
class Axis:
    """The range of an axis in the tablet's units, and units per mm (0: unknown to the tablet)."""

    least: int
    most: int
    per_mm: float = 0.0


def kernel(file: int, request: int, buffer: bytes) -> bytes:
    """Send the request to the kernel, on Linux, and return the answer."""
    answer: bytes = import_module("fcntl").ioctl(file, request, buffer)
    return answer


def asks(number: int, size: int) -> int:
    """Return the code of the request `number` to input devices that reads `size` bytes."""
    return 2 << 30 | size << 16 | ord("E") << 8 | number


def sets(number: int, size: int) -> int:
    """Return the code of the request `number` that writes `size` bytes."""
    return 1 << 30 | size << 16 | ord("E") << 8 | number


def name_of(ask: Ioctl, file: int) -> str:
    """Return the device's own name; "" if it does not answer."""
    return _ioctl(ask, file, asks(0x06, 256), 256).split(b"\0")[0].decode("utf-8", "replace")


def axis_of(ask: Ioctl, file: int, code: int) -> Axis | None:
    """Return the range of an axis; None if there is no such axis."""
    known = _ioctl(ask, file, asks(0x20 + EV_ABS, 8), 8)
    if not known or not known[code // 8] >> code % 8 & 1:
        return None
    answers = _ioctl(ask, file, asks(0x40 + code, ABSINFO.size), ABSINFO.size)
    if not answers:
        return None
    _, least, most, _, _, per_mm = ABSINFO.unpack(answers)
    return Axis(least, most, per_mm)


def state_of(ask: Ioctl, file: int) -> State | None:
    """Return the kernel's state of the stylus; None if it does not answer."""
    answers = [
        _ioctl(ask, file, asks(0x40 + code, ABSINFO.size), ABSINFO.size) for code in (ABS_X, ABS_Y, ABS_PRESSURE)
    ]
    keys = _ioctl(ask, file, asks(0x18, KEYS), KEYS)
    if not all(answers) or not keys:
        return None
    x, y, pressure = (ABSINFO.unpack(answer)[0] for answer in answers)
    touch, near = (bool(keys[key // 8] >> key % 8 & 1) for key in (BTN_TOUCH, BTN_TOOL_PEN))
    return State(x, y, pressure, touch, near)


def timed_monotonic(ask: Ioctl, file: int) -> bool:
    """Request time stamps by the monotonic clock; return whether the device uses it."""
    return bool(_ioctl(ask, file, sets(0xA0, 4), 4, struct.pack("<i", MONOTONIC)))


def input_devices(folder: Path = Path("/sys/class/input")) -> list[str]:
    """Return the input devices of this machine: /dev/input/event3 (Wacom Intuos Pen)."""
    devices = []
    for place in sorted(folder.glob("event*"), key=lambda path: (len(path.name), path.name)):
        try:
            name = (place / "device" / "name").read_text(encoding="utf-8").strip()
        except OSError:
            name = "no name"
        devices.append(f"/dev/input/{place.name} ({name})")
    return devices


def _ioctl(ask: Ioctl, file: int, request: int, size: int, buffer: bytes = b"") -> bytes:
    try:
        return ask(file, request, buffer or bytes(size))
    except OSError:
        return b""


@dataclass
class EventFile:
    """A reader of an event file; `axes` (x, y, pressure), where given, replace the kernel's."""

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
            DeviceError: no such file (listing the input devices), no permission to read it, or not a tablet.
        """
        try:
            self.file = os.open(self.path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
        except OSError as problem:
            message = f"{self.name}: {self.path} cannot be opened: {problem.strerror}."
            if problem.errno in (errno.EACCES, errno.EPERM):
                advice = "Let the station's user into the group that owns it (often `input`)."
            else:
                advice = self._there()
            raise DeviceError(f"{message} {advice}") from None
        with closed_on_failure(self.close):
            self.special = stat.S_ISCHR(os.fstat(self.file).st_mode)
            title = name_of(self.ask, self.file)
            self.ranges = {code: self._axis(code, title) for code in NAMES}
        self.aligned = timed_monotonic(self.ask, self.file)
        self.assembler = self._assembler()
        x, y, pressure = (self.ranges[code] for code in NAMES)
        size = f"{(x.most - x.least) / x.per_mm:.0f} x {(y.most - y.least) / y.per_mm:.0f} mm"
        return {"tablet": title or self.path.name, "size": size, "pressures": str(pressure.most - pressure.least + 1)}

    def expect(self, scene: Scene | None) -> None:
        """Do nothing: a real stylus follows a real hand."""

    def start(self, elapsed_s: Elapsed) -> None:
        """Begin to sample; a device's earlier reports are dropped. Raises DeviceError if it is not open."""
        with self.reading:
            if self.file < 0:
                raise DeviceError(f"{self.name} is not open.")
            while self.special and select.select([self.file], [], [], 0)[0] and self._bytes():
                pass
            self.assembler = self._assembler()
            self.behind_s = self.monotonic_s() - elapsed_s()

    def pull(self, timeout_s: float) -> Batch:
        """Return the reports that have arrived.

        Raises:
            DeviceFault: `link_lost` if it was unplugged, or at the end of the bytes.
        """
        with self.reading:
            if self.file < 0 or not select.select([self.file], [], [], timeout_s)[0]:
                return Batch()
            before = self.assembler.dropped
            raws = list(self.assembler.feed(self._bytes()))
            return Batch([self._report(raw) for raw in raws], self.assembler.dropped - before)

    def stop(self) -> None:
        """Keep the file open, so that it need not be reopened."""

    def close(self) -> None:
        """Close the file."""
        with self.reading:
            if self.file >= 0:
                os.close(self.file)
            self.file = -1

    def _bytes(self) -> bytes:
        """Return at least one byte."""
        try:
            data = os.read(self.file, RECORDS * RECORD.size)
        except BlockingIOError:
            return b""
        except OSError as problem:
            message = "was unplugged" if problem.errno == errno.ENODEV else f"cannot be read: {problem.strerror}"
            raise DeviceFault(
                self.name, "link_lost", f"{self.name}: {self.path} {message}; plug it in again."
            ) from None
        if not data:
            cut = self.assembler.cut_off
            message = f" in the middle of a record ({cut} of {RECORD.size} bytes)" if cut else ""
            raise DeviceFault(self.name, "link_lost", f"{self.name}: {self.path} ended{message}.")
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

    def _there(self) -> str:
        return f"Input devices that there are: {', '.join(input_devices()) or 'none'}."
