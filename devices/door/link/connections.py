"""How the door is reached: over a serial port, or through the pseudo-terminal of its twin's process."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from palpate.devices.door.link.limits import Limits
from palpate.devices.door.link.link import Link, Timing
from palpate.devices.door.link.ports import SerialPort
from palpate.devices.door.link.simulator import Connection
from palpate.devices.door.link.threads import Threads
from palpate.devices.door.link.twin_process import TwinProcess

TWIN_PATIENCE_S = 10.0
"""A twin's process shares its machine with others; it may be late where a device would be lost."""


def by_serial(name: str, path: str, baud: int) -> Connection:
    """A door simulator at a serial port. Raises DeviceError."""
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
    """A twin in a process of its own, which ends with this one. Raises DeviceError."""
    twin = TwinProcess(name)
    try:
        path = twin.start(speed, seed, limits, baud, log, more)
        port = SerialPort(name, path, baud)
    except BaseException:
        twin.end()
        raise
    link = Link(name, port, timing=Timing(patience_s=TWIN_PATIENCE_S, silent_s=TWIN_PATIENCE_S))
    threads = Threads(link)
    threads.start()

    def close() -> None:
        threads.end()
        port.close()
        twin.end()

    return Connection(link, close, {"port": f"{path}, a twin at {speed:g} x real time"})
