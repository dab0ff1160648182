"""A barcode scanner on a serial port, which sends each code as a line, and the samples that codes stand for."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from palpate.devices.device import DeviceError, DeviceFault
from palpate.devices.serial_port import open_serial
from palpate.protocols.study import Stimulus

if TYPE_CHECKING:
    from serial import Serial

LONGEST = 256
"""Greatest length of a code in bytes; longer lines are dropped."""
ENDS = b"\r\n"
COLUMN = "barcode"
"""Column of a stimulus table with the samples' codes; without it, ids are the codes."""


@dataclass
class Lines:
    """A buffer that splits incoming bytes into lines, ended by CR, LF or both, never longer than 256 bytes."""

    part: bytearray = field(default_factory=bytearray)
    too_long: bool = False

    def feed(self, data: bytes) -> list[str]:
        """Return the codes that are complete now, without empty lines."""
        codes = []
        for character in data:
            if character in ENDS:
                if self.part and not self.too_long:
                    codes.append(self.part.decode("utf-8", errors="replace"))
                self.part.clear()
                self.too_long = False
            elif len(self.part) < LONGEST:
                self.part.append(character)
            else:
                self.too_long = True
        return codes


@dataclass
class Scanner:
    """A scanner that is read without waiting: `codes` returns what has arrived."""

    name: str
    port: str
    baud: int
    lines: Lines = field(default_factory=Lines)
    _serial: Serial | None = None

    @property
    def is_open(self) -> bool:
        """Return whether the port is open."""
        return self._serial is not None

    def open(self) -> None:
        """Open the port, or reopen it. Raises DeviceError."""
        self.close()
        try:
            self._serial = open_serial(self.port, self.baud, timeout_s=0)
        except ImportError:
            raise DeviceError("a serial scanner needs the package pyserial: pip install 'palpate[rig]'") from None
        except (OSError, ValueError) as error:
            message = f"{self.name}: the scanner's port {self.port} cannot be opened: {_why(error)}"
            raise DeviceError(message) from None
        self.lines = Lines()

    def forget(self) -> None:
        """Drop codes that were scanned before they were requested."""
        self.codes()
        self.lines = Lines()

    def codes(self) -> list[str]:
        """Return the codes since the last call. Raises DeviceFault if the scanner is gone."""
        if self._serial is None:
            raise self._lost("it is not open")
        try:
            return self.lines.feed(self._serial.read(self._serial.in_waiting or 1))
        except OSError as error:
            raise self._lost(_why(error)) from None

    def _lost(self, why: str) -> DeviceFault:
        return DeviceFault(self.name, "link_lost", f"{self.name}: the scanner at {self.port} is gone: {why}")

    def close(self) -> None:
        """Close the port."""
        port, self._serial = self._serial, None
        if port is not None:
            port.close()


def _why(error: Exception) -> str:
    number = getattr(error, "errno", None)
    return os.strerror(number) if isinstance(number, int) else str(error)


def plain(code: str) -> str:
    """Return a code in the form in which codes are compared: upper case, without outer spaces and control
    characters.
    """
    return "".join(character for character in code if character.isprintable()).strip().upper()


def codes_of(stimulus: Stimulus) -> tuple[str, ...]:
    """Return the codes that confirm this sample: its code and its id."""
    given = (plain(stimulus.columns.get(COLUMN, "")), plain(stimulus.id))
    return tuple(dict.fromkeys(code for code in given if code))


def known_codes(stimuli: Iterable[Stimulus]) -> Mapping[str, str]:
    """Return ids by code, to name the sample that a wrong code belongs to.

    A code that two samples share is left out.
    """
    samples: dict[str, set[str]] = {}
    for stimulus in stimuli:
        for code in codes_of(stimulus):
            samples.setdefault(code, set()).add(stimulus.id)
    return {code: next(iter(ids)) for code, ids in samples.items() if len(ids) == 1}


def refusal(stimulus: Stimulus, code: str, known: Mapping[str, str]) -> str:
    """Return why a code does not confirm this sample: T07 is expected, T12 was scanned."""
    name = known.get(plain(code), plain(code) or "an empty code")
    return f"{stimulus.id} is requested, {name} was scanned"
