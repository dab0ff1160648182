"""A serial port of the operating system, opened through pyserial."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from serial import Serial


def open_serial(
    path: str, baud: int, timeout_s: float, write_timeout_s: float | None = None, bits: int = 8, parity: str = "N"
) -> Serial:
    """Open the port for this process alone; `parity` is N, E or O.

    Raises:
        ModuleNotFoundError: pyserial is not installed.
        OSError: there is no such port, or it is in use.
        ValueError: the port cannot have these settings.
    """
    from serial import Serial

    return Serial(
        path, baud, timeout=timeout_s, write_timeout=write_timeout_s, exclusive=True, bytesize=bits, parity=parity
    )
