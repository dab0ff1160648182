"""A thread that reads one sensor and passes its samples to the writer, so that neither waits for the other.

One thread puts into the bounded ring, another gets. Blocks are handed over by reference through a deque, whose two ends
need no lock in CPython; each of the two byte counts is written by one thread and read by the other. Putting a block
takes the same few microseconds whatever the writer is doing.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from palpate.devices.device import Block, DeviceError, DeviceFault, NowNs, Sensor
from palpate.protocols.files import reason

READ_S = 0.05
"""Longest wait of a read, and so the longest delay of the thread's end."""
IDLE_S = 0.001
"""Pause before a sensor that answered at once without samples is read again."""
LAST_READS = 8
"""A thread that was late has so many reads at its end to catch up: a read returns about a second at most."""
GONE_S = 2.0
"""A thread that takes longer to end hangs in its driver."""
BLOCK_BYTES = 320
"""Approximate size of a block without its data, so that many tiny blocks cannot fill the memory either."""
NO_ROOM = "no room: the disk was slower than the sensor"


@dataclass
class Reader:
    """A reader of one sensor into the rings of its signals, until it is stopped or the sensor fails."""

    sensor: Sensor
    rings: Mapping[str, Ring]
    now_ns: NowNs
    heard_ns: dict[str, int] = field(default_factory=dict)
    fault: DeviceFault | None = None
    ending: threading.Event = field(default_factory=threading.Event)
    thread: threading.Thread | None = None

    def start(self) -> None:
        """Start the sensor, and read it from now on. Raises DeviceFault, also if it is not available (refused)."""
        try:
            self.sensor.start(self.now_ns)
        except DeviceFault:
            raise
        except Exception as error:
            raise as_fault(self.sensor.name, error) from error
        self.heard_ns = dict.fromkeys(self.rings, self.now_ns())
        self.thread = threading.Thread(target=self._run, name=f"reads {self.sensor.name}", daemon=True)
        self.thread.start()

    def end(self) -> None:
        """Request the end of the thread, which reads what has been sampled so far."""
        self.ending.set()

    def stop(self) -> None:
        """Stop the sensor. Raises DeviceFault."""
        try:
            self.sensor.stop()
        except DeviceFault:
            raise
        except Exception as error:
            raise as_fault(self.sensor.name, error) from error

    def gone(self) -> bool:
        """Return whether the thread has ended, after waiting for a moment."""
        if self.thread is not None:
            self.thread.join(GONE_S)
        return self.thread is None or not self.thread.is_alive()

    def _run(self) -> None:
        try:
            while not self.ending.is_set():
                if not self._pass_on(self.sensor.read(READ_S)):
                    self.ending.wait(IDLE_S)
            for _ in range(LAST_READS):
                if not self._pass_on(self.sensor.read(0.0)):
                    break
        except DeviceFault as fault:
            self.fault = fault
        except Exception as error:
            self.fault = as_fault(self.sensor.name, error)

    def _pass_on(self, came: Mapping[str, Sequence[Block]]) -> bool:
        some = False
        for name, blocks in came.items():
            ring = self.rings.get(name)
            if ring is None:
                raise DeviceFault(self.sensor.name, "firmware", f"samples of {name!r} came, which it does not have")
            for block in blocks:
                ring.put(block)
                some = True
            if blocks:
                self.heard_ns[name] = self.now_ns()
        return some


def as_fault(device: str, error: Exception) -> DeviceFault:
    """Return another error of a driver as a fault: a lost line, or a refusal; a DeviceError keeps its message."""
    if isinstance(error, OSError) and error.errno is not None:
        said = reason(error)
    else:
        said = str(error) if isinstance(error, DeviceError) else f"{type(error).__name__}: {error}"
    return DeviceFault(device, "link_lost" if isinstance(error, OSError) else "refused", said)


@dataclass
class Ring:
    """A buffer of blocks of one signal on their way; `room` is its size in bytes.

    If there is no room the new block is dropped, and the next block that is kept reports it.
    """

    room: int
    row_bytes: int
    held: deque[Block] = field(default_factory=deque)
    put_bytes: int = 0
    got_bytes: int = 0
    dropped: int = 0

    def put(self, block: Block) -> None:
        """Hand over a block without waiting; only the thread that reads the sensor calls it."""
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
        """Return the blocks so far, at most `most_bytes` but at least one block; only the writer calls it."""
        blocks: list[Block] = []
        for _ in range(len(self.held)):
            if most_bytes <= 0:
                break
            blocks.append(self.held.popleft())
            most_bytes -= len(blocks[-1].data)
            self.got_bytes += len(blocks[-1].data) + BLOCK_BYTES
        return blocks

    @property
    def waiting(self) -> int:
        """Return the number of bytes that wait to be written."""
        return self.put_bytes - self.got_bytes
