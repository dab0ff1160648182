"""The way from the thread that reads a sensor to the one that writes: bounded, and neither ever waits for the other.

One thread puts, another gets. Blocks are handed over by reference through a deque, whose two ends need no lock in
CPython; each of the two byte counts is written by one thread and read by the other. To put a block takes the same few
microseconds whatever the writer is doing.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace

from palpate.devices.signals import Block

BLOCK_BYTES = 320
"""What a block takes beside its data, about: so many tiny blocks cannot fill the memory either."""
NO_ROOM = "no room: the disk was slower than the sensor"


@dataclass
class Ring:
    """Blocks of one signal on their way; `room` is how many bytes of them there may be.

    Where there is no room the new block is dropped, and the next one that is kept tells of it.
    """

    room: int
    row_bytes: int
    held: deque[Block] = field(default_factory=deque)
    put_bytes: int = 0
    got_bytes: int = 0
    dropped: int = 0

    def put(self, block: Block) -> None:
        """Hand a block over; only the thread that reads the sensor calls it, and it never waits."""
        size = len(block.data) + BLOCK_BYTES
        if self.waiting + size > self.room:
            self.dropped += block.lost + len(block.data) // self.row_bytes
            return
        if self.dropped:
            why = f"{NO_ROOM}; {block.why}" if block.why else NO_ROOM
            block = replace(block, lost=block.lost + self.dropped, why=why)
            self.dropped = 0
        self.put_bytes += size
        self.held.append(block)

    def get(self, most_bytes: int) -> list[Block]:
        """What has been put so far, so many bytes of it at most but a block at least; only the writer calls it."""
        found: list[Block] = []
        for _ in range(len(self.held)):
            if most_bytes <= 0:
                break
            found.append(self.held.popleft())
            most_bytes -= len(found[-1].data)
            self.got_bytes += len(found[-1].data) + BLOCK_BYTES
        return found

    @property
    def waiting(self) -> int:
        """Bytes that wait to be written."""
        return self.put_bytes - self.got_bytes
