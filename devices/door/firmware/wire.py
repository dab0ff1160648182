"""The serial line between host and firmware, in plant time: a limited number of bytes per millisecond each way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from palpate.devices.door.firmware.controller import Firmware

BITS_PER_BYTE = 10
"""Start bit, eight data bits, stop bit."""
ROOM = 1 << 16


def as_it_is(data: bytes) -> bytes:
    """Return the data unchanged."""
    return data


@dataclass
class Wire:
    """A line that moves bytes at its rate; `to_device` and `to_host` may damage what passes, for drills.

    Bytes that the host does not take in time are kept, up to ROOM bytes per direction; the rest is lost, as in a UART.
    """

    firmware: Firmware
    baud: int = 1_000_000
    to_device: Callable[[bytes], bytes] = as_it_is
    to_host: Callable[[bytes], bytes] = as_it_is
    lost: int = 0
    _in: bytearray = field(default_factory=bytearray)
    _out: bytearray = field(default_factory=bytearray)
    _credit: float = 0.0

    def push(self, data: bytes) -> None:
        """Send data from the host."""
        self._put(self._in, self.to_device(data))

    def tick(self) -> bytes:
        """Advance the firmware by 1 ms with the bytes that have arrived, and return its bytes that reach the host."""
        self._credit += self.baud / BITS_PER_BYTE / 1000
        share = int(self._credit)
        self._credit -= share
        self.firmware.receive(_taken(self._in, share))
        self._put(self._out, self.firmware.tick())
        return self.to_host(_taken(self._out, share))

    def _put(self, queue: bytearray, data: bytes) -> None:
        room = ROOM - len(queue)
        queue += data[:room]
        self.lost += max(0, len(data) - room)


def _taken(queue: bytearray, most: int) -> bytes:
    data = bytes(queue[:most])
    del queue[:most]
    return data
