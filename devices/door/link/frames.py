"""Frames on the serial line: how messages are made of bytes, and found again after any garbage.

A frame is length (u16), type (u8), sequence (u16), payload, CRC-32 (u32), little-endian; on the line it is stuffed by
COBS (Cheshire and Baker 1999) between two zero bytes, which occur nowhere else. docs/reference/door-protocol.md
describes it byte by byte.
"""

from __future__ import annotations

import struct
from typing import NamedTuple
from zlib import crc32

HEAD = struct.Struct("<HBH")
TAIL = struct.Struct("<I")
OVERHEAD = HEAD.size + TAIL.size
MAX_PAYLOAD = 1024
MAX_STUFFED = OVERHEAD + MAX_PAYLOAD + (OVERHEAD + MAX_PAYLOAD) // 254 + 1
"""Length of the longest run of bytes without a zero that can be a frame."""
FULL_BLOCK = 255
SEQUENCES = 1 << 16


class Frame(NamedTuple):
    """A frame whose CRC was checked and removed."""

    kind: int
    sequence: int
    payload: bytes


def bare(frame: Frame) -> bytes:
    """Return the frame before stuffing: length, type, sequence, payload, CRC-32 of all these."""
    head = HEAD.pack(len(frame.payload), frame.kind, frame.sequence)
    return head + frame.payload + TAIL.pack(crc32(frame.payload, crc32(head)))


def on_the_line(frame: Frame) -> bytes:
    """Return the frame as it is sent: stuffed, with a zero on either side. Raises ValueError for too long a payload."""
    if len(frame.payload) > MAX_PAYLOAD:
        raise ValueError(f"a payload of {len(frame.payload)} bytes; {MAX_PAYLOAD} are the most")
    return b"\0" + stuffed(bare(frame)) + b"\0"


def stuffed(data: bytes) -> bytes:
    """Return the bytes without zeros: every run up to a zero begins with its length plus 1, at most 254 bytes a run."""
    out = bytearray()
    for run in data.split(b"\0"):
        while len(run) >= FULL_BLOCK - 1:
            out += b"\xff" + run[: FULL_BLOCK - 1]
            run = run[FULL_BLOCK - 1 :]  # noqa: PLW2901 - what is left of this run
        out.append(len(run) + 1)
        out += run
    return bytes(out)


def unstuffed(data: bytes) -> bytes | None:
    """Return the bytes before stuffing; None if they cannot be the result of stuffing. `data` holds no zero."""
    runs = []
    at, end = 0, len(data)
    while at < end:
        code = data[at]
        after = at + code
        runs.append(data[at + 1 : after])
        if code == FULL_BLOCK:  # no zero follows a full block
            if (rest := unstuffed(data[after:])) is None or after > end:
                return None
            return b"\0".join(runs) + rest
        at = after
    return b"\0".join(runs) if at == end else None


def frame_of(raw: bytes | None) -> Frame | None:
    """Return the frame in these unstuffed bytes if they are a frame with a correct CRC, else None."""
    if raw is None or len(raw) < OVERHEAD:
        return None
    length, kind, sequence = HEAD.unpack_from(raw)
    if length != len(raw) - OVERHEAD or crc32(raw[:-4]) != TAIL.unpack_from(raw, len(raw) - 4)[0]:
        return None
    return Frame(kind, sequence, raw[5:-4])


class Parser:
    """A parser that finds frames in bytes that arrive in pieces of any size, and never raises.

    It keeps at most MAX_STUFFED bytes. A zero always ends the frame before it, so garbage costs at most the frame that
    it hits. `dropped` counts runs of bytes that were not frames, `dropped_bytes` their bytes.
    """

    def __init__(self) -> None:
        self.dropped = 0
        self.dropped_bytes = 0
        self._partial = b""
        self._overlong = False

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that are complete now, in order."""
        *whole, rest = (self._partial + data).split(b"\0")
        frames = []
        for run in whole:
            if self._overlong:
                self._overlong = False
                self.dropped_bytes += len(run)
            elif run:
                frame = frame_of(unstuffed(run)) if len(run) <= MAX_STUFFED else None
                if frame is None:
                    self.dropped += 1
                    self.dropped_bytes += len(run)
                else:
                    frames.append(frame)
        self._keep(rest)
        return frames

    def _keep(self, rest: bytes) -> None:
        """Keep bytes that may still become a frame; of runs that are too long, count the bytes only."""
        if self._overlong or len(rest) > MAX_STUFFED:
            self.dropped += not self._overlong
            self.dropped_bytes += len(rest)
            self._overlong, rest = True, b""
        self._partial = rest

    @property
    def kept(self) -> int:
        """Return the number of bytes that wait for the end of their frame."""
        return len(self._partial)
