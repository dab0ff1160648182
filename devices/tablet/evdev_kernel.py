"""What can be asked of an input device of Linux: its name, its axes, its state (uapi/linux/input.h)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from palpate.devices.tablet.evdev import ABS_PRESSURE, ABS_X, ABS_Y, BTN_TOOL_PEN, BTN_TOUCH, EV_ABS, State

ABSINFO = struct.Struct("<6i")
"""value, minimum, maximum, fuzz, flat, resolution (units per mm for x and y)."""
KEYS = 96
"""Bytes that hold a bit for every key."""
MONOTONIC = 1
Ioctl = Callable[[int, int, bytes], bytes]
"""Asks the kernel: file, request, buffer; gives the buffer as it came back. Raises OSError."""


@dataclass(frozen=True)
class Axis:
    """The range of an axis in the tablet's units, and units per mm (0: the tablet does not know)."""

    least: int
    most: int
    per_mm: float = 0.0


def kernel(file: int, request: int, buffer: bytes) -> bytes:
    """The real thing, on Linux."""
    answer: bytes = import_module("fcntl").ioctl(file, request, buffer)
    return answer


def asks(number: int, size: int) -> int:
    """The request `number` of input devices that reads `size` bytes."""
    return 2 << 30 | size << 16 | ord("E") << 8 | number


def sets(number: int, size: int) -> int:
    """The request `number` that writes `size` bytes."""
    return 1 << 30 | size << 16 | ord("E") << 8 | number


def name_of(ask: Ioctl, file: int) -> str:
    """What the device calls itself; "" where it does not answer."""
    return _asked(ask, file, asks(0x06, 256), 256).split(b"\0")[0].decode("utf-8", "replace")


def axis_of(ask: Ioctl, file: int, code: int) -> Axis | None:
    """The range of an axis; None where there is no such axis."""
    known = _asked(ask, file, asks(0x20 + EV_ABS, 8), 8)
    if not known or not known[code // 8] >> code % 8 & 1:
        return None
    found = _asked(ask, file, asks(0x40 + code, ABSINFO.size), ABSINFO.size)
    if not found:
        return None
    _, least, most, _, _, per_mm = ABSINFO.unpack(found)
    return Axis(least, most, per_mm)


def state_of(ask: Ioctl, file: int) -> State | None:
    """Where the stylus is by the kernel; None where it does not answer."""
    found = [_asked(ask, file, asks(0x40 + code, ABSINFO.size), ABSINFO.size) for code in (ABS_X, ABS_Y, ABS_PRESSURE)]
    keys = _asked(ask, file, asks(0x18, KEYS), KEYS)
    if not all(found) or not keys:
        return None
    x, y, pressure = (ABSINFO.unpack(each)[0] for each in found)
    touch, near = (bool(keys[key // 8] >> key % 8 & 1) for key in (BTN_TOUCH, BTN_TOOL_PEN))
    return State(x, y, pressure, touch, near)


def timed_monotonic(ask: Ioctl, file: int) -> bool:
    """Have its time stamps count by the clock that nobody sets; whether it does."""
    return bool(_asked(ask, file, sets(0xA0, 4), 4, struct.pack("<i", MONOTONIC)))


def input_devices(folder: Path = Path("/sys/class/input")) -> list[str]:
    """The input devices that there are: /dev/input/event3 (Wacom Intuos Pen)."""
    found = []
    for place in sorted(folder.glob("event*"), key=lambda each: (len(each.name), each.name)):
        try:
            name = (place / "device" / "name").read_text(encoding="utf-8").strip()
        except OSError:
            name = "no name"
        found.append(f"/dev/input/{place.name} ({name})")
    return found


def _asked(ask: Ioctl, file: int, request: int, size: int, buffer: bytes = b"") -> bytes:
    try:
        return ask(file, request, buffer or bytes(size))
    except OSError:
        return b""
