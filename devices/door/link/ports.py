"""Where the bytes go: a serial port, real or a pseudo-terminal; tests bring ports of their own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from palpate.devices.serial_port import open_serial
from palpate.devices.signals import DeviceError
from palpate.protocols.extras import missing_sentence

if TYPE_CHECKING:
    from serial import Serial

WAIT_S = 0.05
"""No read waits longer: so soon a thread that reads hears that it is to end."""
WRITE_S = 0.5
"""A line that takes nothing for so long is lost."""


class Port(Protocol):
    """A line to the device. What it raises where the line is gone is an OSError."""

    def read(self, timeout_s: float) -> bytes:
        """What has come; waits for something at most that long, and may come back with nothing earlier."""

    def write(self, data: bytes) -> None:
        """Send it all."""

    def close(self) -> None:
        """Let go of the line."""


class SerialPort:
    """A serial port of the operating system. Raises DeviceError where it cannot be opened."""

    def __init__(self, name: str, path: str, baud: int) -> None:
        self._serial = _opened(name, path, baud)

    def read(self, timeout_s: float) -> bytes:  # noqa: ARG002 - WAIT_S is set once: to change it costs a system call
        """What has come."""
        first = self._serial.read(1)
        return bytes(first + self._serial.read(self._serial.in_waiting)) if first else b""

    def write(self, data: bytes) -> None:
        """Send it all."""
        self._serial.write(data)

    def close(self) -> None:
        """Let go of the line."""
        self._serial.close()


def _opened(name: str, path: str, baud: int) -> Serial:
    try:
        return open_serial(path, baud, WAIT_S, WRITE_S)
    except ModuleNotFoundError:
        raise DeviceError(f"{name}: {missing_sentence('a serial port', ['serial'])}") from None
    except (OSError, ValueError) as error:
        raise DeviceError(
            f"{name}: the port {path} at {baud} baud cannot be opened ({error}). Is the door simulator plugged in and "
            "switched on, is the port the right one, is nobody else using it, and may this user use serial ports?"
        ) from error
