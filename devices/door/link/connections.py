"""Connections to the door: a serial port, or the pseudo-terminal of its twin's process.

In real time a link has two threads: one reads the port, one sends heartbeats.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.devices.device import DeviceError, closed_on_failure
from palpate.devices.door.link.limits import Limits
from palpate.devices.door.link.link import Link, Timing
from palpate.devices.door.link.simulator import Connection
from palpate.devices.door.link.twin_process import TwinProcess
from palpate.devices.serial_port import open_serial
from palpate.protocols.extras import missing_sentence

if TYPE_CHECKING:
    from serial import Serial

TWIN_PATIENCE_S = 10.0
"""Patience with a twin's process, which shares its machine with others and may be late."""
WAIT_S = 0.05
"""Longest wait of a read, so that a reading thread soon learns that it has to end."""
WRITE_S = 0.5
"""A line that accepts no bytes for this long is lost."""
BEAT_S = 0.010
ENDS_S = 2.0


def by_serial(name: str, path: str, baud: int) -> Connection:
    """Return a connection to a door simulator at a serial port. Raises DeviceError."""
    port = SerialPort(name, path, baud)
    link = Link(name, port)
    threads = Threads(link)
    threads.start()

    def close() -> None:
        threads.end()
        port.close()

    return Connection(link, close, {"port": f"{path}, {baud} baud"})


def by_twin(
    name: str, speed: float, seed: int, limits: Limits, baud: int, log: Path | None = None, more: Sequence[str] = ()
) -> Connection:
    """Return a connection to a twin in a process of its own, which ends with this one. Raises DeviceError."""
    twin = TwinProcess(name)
    with closed_on_failure(twin.end):
        path = twin.start(speed, seed, limits, baud, log, more)
        port = SerialPort(name, path, baud)
    link = Link(name, port, timing=Timing(patience_s=TWIN_PATIENCE_S, silent_s=TWIN_PATIENCE_S))
    threads = Threads(link)
    threads.start()

    def close() -> None:
        threads.end()
        port.close()
        twin.end()

    return Connection(link, close, {"port": f"{path}, a twin at {speed:g} x real time"})


class SerialPort:
    """A serial port of the operating system. Raises DeviceError if it cannot be opened."""

    def __init__(self, name: str, path: str, baud: int) -> None:
        try:
            self._serial: Serial = open_serial(path, baud, WAIT_S, WRITE_S)
        except ModuleNotFoundError:
            raise DeviceError(f"{name}: {missing_sentence('a serial port', ['serial'])}") from None
        except (OSError, ValueError) as error:
            raise DeviceError(
                f"{name}: the port {path} at {baud} baud cannot be opened ({error}). Is the door simulator plugged in "
                "and switched on, is the port the right one, is nobody else using it, and may this user use serial "
                "ports?"
            ) from error

    def read(self, timeout_s: float) -> bytes:  # noqa: ARG002 - WAIT_S is set once: to change it costs a system call
        """Return the bytes that have arrived."""
        first = self._serial.read(1)
        return bytes(first + self._serial.read(self._serial.in_waiting)) if first else b""

    def write(self, data: bytes) -> None:
        """Send all bytes."""
        self._serial.write(data)

    def close(self) -> None:
        """Close the port."""
        self._serial.close()


@dataclass
class Threads:
    """The threads that run a link until it is closed."""

    link: Link
    ending: threading.Event = field(default_factory=threading.Event)
    running: list[threading.Thread] = field(default_factory=list)

    def start(self) -> None:
        """Start the threads that read the link and send heartbeats."""
        self.link.threaded = True
        for work in (self._read, self._beat):
            thread = threading.Thread(target=work, name=f"{self.link.name} {work.__name__[1:]}s", daemon=True)
            self.running.append(thread)
            thread.start()

    def end(self) -> None:
        """End both threads; afterwards nobody reads the port."""
        self.ending.set()
        for thread in self.running:
            if thread is not threading.current_thread():
                thread.join(ENDS_S)
        self.running.clear()

    def _read(self) -> None:
        with self._lost_where_it_fails():
            while not self.ending.is_set() and self.link.broken is None:
                self.link.pump(WAIT_S)

    def _beat(self) -> None:
        with self._lost_where_it_fails():
            while not self.ending.wait(BEAT_S) and self.link.broken is None:
                self.link.beat()

    @contextmanager
    def _lost_where_it_fails(self) -> Iterator[None]:
        """Treat any error of a driver as a lost line: pyserial's errors on a closed port are no OSError."""
        try:
            yield
        except Exception as error:
            self.link.lose(error)
