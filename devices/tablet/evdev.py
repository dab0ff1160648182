"""The bytes of Linux' input events, and how they make up a tablet's reports (kernel: Documentation/input/event-codes).

A record is `struct input_event` on a 64-bit machine: two 8-byte numbers of seconds and microseconds, two 2-byte ones of
type and code, a 4-byte value. Records up to a SYN_REPORT belong together; only what changed is told.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass

RECORD = struct.Struct("<qqHHi")
EV_SYN, EV_KEY, EV_ABS = 0, 1, 3
SYN_REPORT, SYN_DROPPED = 0, 3
ABS_X, ABS_Y, ABS_PRESSURE = 0x00, 0x01, 0x18
BTN_TOOL_PEN, BTN_TOUCH = 0x140, 0x14A


@dataclass
class State:
    """What is known of the stylus, in the tablet's units; None: not yet told."""

    x: int | None = None
    y: int | None = None
    pressure: int | None = None
    touch: bool | None = None
    near: bool = True


@dataclass(frozen=True)
class Raw:
    """One report in the tablet's units; `known` is False where it is not known where the stylus is."""

    t_s: float
    x: int
    y: int
    pressure: int
    touching: bool
    known: bool


class Assembler:
    """Puts bytes together into reports, however they were cut apart.

    Where the kernel dropped records (SYN_DROPPED) all up to the next SYN_REPORT is left out, and the state is asked
    for anew; where it cannot be asked for, the stylus counts as away until it is told again.
    """

    def __init__(self, ask: Callable[[], State | None] = lambda: None) -> None:
        """`ask` gives the state that the kernel has, or None."""
        self.state = ask() or State()
        self.dropped = 0
        self._ask = ask
        self._rest = b""
        self._dropping = False

    @property
    def cut_off(self) -> int:
        """Bytes of a record that has not ended."""
        return len(self._rest)

    def feed(self, data: bytes) -> Iterator[Raw]:
        """The reports that these bytes complete."""
        whole = self._rest + data
        end = len(whole) - len(whole) % RECORD.size
        self._rest = whole[end:]
        for second, micro, kind, code, value in RECORD.iter_unpack(whole[:end]):
            if kind == EV_SYN and code == SYN_DROPPED:
                self._dropping = True
            elif kind == EV_SYN and code == SYN_REPORT:
                yield self._report(second + 1e-6 * micro)
            elif not self._dropping:
                self._change(kind, code, value)

    def _change(self, kind: int, code: int, value: int) -> None:
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
