"""The serial protocol of the plate: frames of 6 bytes, which are 0xA5, a letter, a signed number, and CRC-16 (XMODEM).

    N, T   neutral level, target      0.1 degC      answered with the same frame
    R      ramp                       0.1 degC/s    answered with the same frame
    M      temperature of the plate                 answered in 0.01 degC
    S      status                                   answered with bits: 1 hardware failed, 2 heard nothing for 1 s

Numbers have 16 bits, the high byte first. A refused request is answered with the letter E, a damaged one not at all.
A plate that hears nothing for 1 s goes to its neutral level by itself, fast; a new target resets that bit.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from typing import Protocol

START, LENGTH = 0xA5, 6
FAILED, UNHEARD = 1, 2
BODY = struct.Struct(">BBh")


class Port(Protocol):
    """The functions of a serial port that are used here, by pyserial's names."""

    def write(self, data: bytes, /) -> int | None:
        """Send bytes."""

    def read(self, size: int, /) -> bytes:
        """Return so many bytes, or those that arrived within the timeout."""

    def reset_input_buffer(self) -> None:
        """Drop the bytes that have arrived."""

    def close(self) -> None:
        """Close the port."""


class FrameError(ValueError):
    """Bytes that are not one whole frame."""


def frame(letter: str, number: int = 0) -> bytes:
    """Return a request, or an answer, as bytes."""
    body = BODY.pack(START, ord(letter), number)
    return body + crc_hqx(body, 0).to_bytes(2, "big")


def parse(data: bytes) -> tuple[str, int]:
    """Return the letter and the number of a frame. Raises FrameError."""
    if len(data) != LENGTH:
        raise FrameError(f"{len(data)} of {LENGTH} bytes arrived")
    start, letter, number = BODY.unpack(data[:4])
    if start != START or crc_hqx(data[:4], 0).to_bytes(2, "big") != data[4:]:
        raise FrameError(f"{data.hex(' ')} has a wrong checksum")
    return chr(letter), number
