"""The kind `thermometer`: a laboratory thermometer on a serial line, at the skin or in the room, read at a steady pace.

Three sets of commands: `scpi` (SCPI-1999: MEASure:TEMPerature?, 9.9E37 for an overload, 9.91E37 for not a number),
`lakeshore` (Lake Shore 211, 218 and 335: CRDG?, RDGST?), and `lines`, for a board that sends one reading a line.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import isnan, pi, sin
from pathlib import Path
from threading import Event, RLock
from typing import TYPE_CHECKING, Annotated, Any, Literal, Protocol, Self

from pydantic import Field, model_validator

from palpate.devices.device import (
    Block,
    DeviceError,
    DeviceFault,
    Health,
    NowNs,
    Signal,
    closed_on_failure,
    faults_as_errors,
    interleaved,
)
from palpate.devices.kinds import Date, DeviceKind, Finite
from palpate.devices.noise import gaussians
from palpate.devices.serial_port import open_serial
from palpate.devices.source import Elapsed, since
from palpate.protocols.extras import missing_sentence
from palpate.protocols.strict import Strict

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

READING = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:E[+-]?\d+)?|NAN)\s*(?:°?C|DEGC)?")
CELSIUS = ("C", "CEL", "CELS", "CELSIUS")
SCPI_OVERLOAD, SCPI_NAN = 9.9e37, 9.91e37
LEVEL_DEGC = {"skin": 33.0, "room": 22.5}
"""Mean of the twin's temperature: a hand at rest has 25 to 36 degC (Jones and Ho 2008)."""
DRIFT_DEGC, DRIFT_S = 0.3, 900.0
"""Amplitude and period of the oscillation of the twin's temperature."""


class Settings(Strict):
    """The settings of a thermometer in a rig file."""

    kind: Literal["thermometer"]
    driver: Literal["serial", "twin"]
    port: str | None = None
    baud: Annotated[int, Field(ge=300, le=4_000_000)] = 9600
    commands: Literal["scpi", "lakeshore", "lines"] = "scpi"
    input: Annotated[str, Field(pattern=r"^[\w()@,.-]{1,20}$")] | None = None
    rate_hz: Annotated[float, Field(ge=0.02, le=20)] = 1.0
    timeout_s: Annotated[float, Field(ge=0.02, le=1.5)] = 0.5
    most_missed: Annotated[int, Field(ge=1, le=100)] = 3
    lowest_degC: Finite = -20.0
    highest_degC: Finite = 60.0
    calibrated: Date | None = None
    place: Literal["skin", "room"] = "skin"
    noise_degC: Annotated[float, Field(ge=0, le=5)] = 0.02
    seed: Annotated[int, Field(ge=0)] = 1

    @model_validator(mode="after")
    def _fit_together(self) -> Self:
        if self.driver == "serial" and not self.port:
            raise ValueError("the driver serial needs a port, as /dev/ttyUSB0")
        if self.lowest_degC >= self.highest_degC:
            raise ValueError(f"lowest_degC ({self.lowest_degC:g}) must be below highest_degC ({self.highest_degC:g})")
        return self


MEANINGS: Mapping[str, str] = {
    "port": "serial port, as /dev/ttyUSB0 or COM3; needed by `serial`",
    "baud": "symbols per second on the line",
    "commands": "what it speaks: `scpi`, `lakeshore`, or `lines` where it sends one reading a line by itself",
    "input": "which of its inputs is read, as (@101) or A; none is its only one, of `lakeshore` 1",
    "rate_hz": "readings per second, Hz",
    "timeout_s": "how long an answer is waited for, s",
    "most_missed": "this many readings in a row without a readable answer are a fault",
    "lowest_degC": "a reading below this is a fault, degrees Celsius",
    "highest_degC": "a reading above this is a fault, degrees Celsius",
    "place": "what the twin measures",
    "noise_degC": "the twin's noise (SD), degrees Celsius",
}


@dataclass(frozen=True)
class Commands:
    """A set of commands: the requests, with `{input}` for the input, their line end, and the settings of the line."""

    identify: str = ""
    unit: str = ""
    read: str = ""
    status: str = ""
    ending: str = "\n"
    input: str = ""
    bits: int = 8
    parity: str = "N"


COMMANDS: Mapping[str, Commands] = {
    "scpi": Commands("*IDN?", "UNIT:TEMP?", "MEAS:TEMP? {input}"),
    "lakeshore": Commands(
        "*IDN?", read="CRDG? {input}", status="RDGST? {input}", ending="\r\n", input="1", bits=7, parity="O"
    ),
    "lines": Commands(),
}
"""The sets of commands; `read` is empty if the device sends readings by itself; `status` is 0 for a good reading."""


class Port(Protocol):
    """The functions of a serial port that are used here, by pyserial's names."""

    @property
    def in_waiting(self) -> int:
        """Return how many bytes have arrived."""

    def write(self, data: bytes, /) -> int | None:
        """Send bytes."""

    def readline(self) -> bytes:
        """Return a line with its end, or the part of it that arrived within the timeout."""

    def reset_input_buffer(self) -> None:
        """Drop the bytes that have arrived."""

    def close(self) -> None:
        """Close the port."""


class NoReading(Exception):
    """An answer that is missing or cannot be read; the next one may be fine. `what` is one of FAULTS."""

    def __init__(self, what: str, message: str) -> None:
        super().__init__(message)
        self.what = what


@dataclass
class Thermometer:
    """A source of the signal `temperature` in degrees Celsius. A missed reading is a lost sample.

    `elapsed_s` replaces the time since the start; then no reading comes too late.
    """

    name: str
    settings: Settings
    connect: Callable[[Thermometer], Port]
    elapsed_s: Elapsed | None = None
    port: Port | None = None
    identity: str = ""
    elapsed: Elapsed | None = None
    now_ns: NowNs = time.monotonic_ns
    number: int = 0
    lost: int = 0
    missed: int = 0
    why: str = ""
    stopped: Event = field(default_factory=Event)
    lock: RLock = field(default_factory=RLock)

    @property
    def signals(self) -> Sequence[Signal]:
        """Return its only signal, the temperature."""
        settings = self.settings
        return (Signal("temperature", ("temperature",), ("degC",), settings.rate_hz, "host", settings.calibrated),)

    def open(self) -> None:
        """Open the port, identify the device, and take a reading. Raises DeviceError."""
        self.close()
        self.port = self.connect(self)
        with closed_on_failure(self.close), faults_as_errors():
            self._greet()

    def safe(self) -> None:
        """Do nothing: a thermometer moves nothing."""

    def close(self) -> None:
        """Stop and close the port."""
        self.stopped.set()
        with self.lock:
            port, self.port, self.elapsed = self.port, None, None
            if port is not None:
                port.close()

    def describe(self) -> Mapping[str, Any]:
        """Return the settings, and the device's identification."""
        return {**self.settings.model_dump(mode="json", exclude_none=True), "identity": self.identity}

    def health(self, seconds: float) -> Health:
        """Read it for some seconds, and return the temperature and whether readings were lost."""
        from palpate.devices.health import sensed

        facts = {"identity": self.identity} if self.identity else {}
        try:
            readings = sensed(self, seconds, time.monotonic_ns)
        except DeviceFault as fault:
            return Health(False, str(fault), calibrated=self.settings.calibrated, facts=facts)
        lost = readings[0].lost
        message = f"{readings[0].mean[0]:.2f} degC" + (f", {lost} readings missed" if lost else "")
        return Health(not lost, message, readings, self.settings.calibrated, facts)

    def expect(self, scene: Scene | None) -> None:
        """Do nothing: this sensor does not see the hand's scene."""

    def start(self, now_ns: NowNs) -> None:
        """Begin to sample. Raises DeviceError if it is not open and cannot be reopened."""
        with self.lock:
            if self.port is None:
                self.open()
            self.stopped.clear()
            self.now_ns, self.elapsed = now_ns, self.elapsed_s or since(now_ns)
            self.number = self.lost = self.missed = 0

    def read(self, timeout_s: float) -> Mapping[str, Sequence[Block]]:
        """Take the readings that are due, waiting at most `timeout_s` for the next.

        Raises DeviceFault: `link_lost`, `silent`, `not_a_number` or `over_range`. The port is closed then, so that the
        next start reopens it.
        """
        with self.lock:
            if self.elapsed is None:
                return {"temperature": ()}
            wait_s = self.number / self.settings.rate_hz - self.elapsed()
            if wait_s > 0 and timeout_s > 0:
                self.stopped.wait(min(wait_s, timeout_s))
            blocks: list[Block] = []
            with closed_on_failure(self.close):
                while self.number / self.settings.rate_hz <= self.elapsed():
                    blocks += self._sample(self.elapsed())
                    if self.elapsed_s is None:
                        break
            return {"temperature": blocks}

    def stop(self) -> None:
        """Stop sampling."""
        self.stopped.set()
        with self.lock:
            self.elapsed = None

    def _sample(self, elapsed_s: float) -> list[Block]:
        """Take the reading that is due; earlier ones that were not taken in time are lost."""
        if self.elapsed_s is None and (late := int(elapsed_s * self.settings.rate_hz) - self.number) > 0:
            self.number, self.lost, self.why = self.number + late, self.lost + late, "it answered too late"
        number, self.number = self.number, self.number + 1
        try:
            degC = self._reading()
        except NoReading as error:
            self.lost, self.missed, self.why = self.lost + 1, self.missed + 1, str(error)
            if self.missed >= self.settings.most_missed:
                message = f"{self.name}: {self.missed} readings in a row were missed, the last: {error}"
                raise DeviceFault(self.name, error.what, f"{message}; see its cable and its settings.") from None
            return []
        lost, self.lost, self.missed = self.lost, 0, 0
        return [Block(number, interleaved((degC,)), self.now_ns(), None, lost, self.why if lost else "")]

    def _greet(self) -> None:
        """Check that the device uses this set of commands and degrees Celsius. Raises DeviceError, DeviceFault."""
        commands = COMMANDS[self.settings.commands]
        if commands.identify:
            self.identity = self._first(partial(self._answer, commands.identify))
            if READING.fullmatch(self.identity.upper()):
                raise DeviceError(
                    f"{self.name}: it sends readings by itself ({self.identity:.20}); set `commands: lines`, or end"
                    " that at the thermometer"
                )
            if self.identity == commands.identify:
                raise DeviceError(f"{self.name}: it sends back what it is sent; switch its echo off")
        if commands.unit and (unit := self._first(partial(self._answer, commands.unit))).upper() not in CELSIUS:
            raise DeviceError(f"{self.name}: its unit is {unit!r:.20}, and C is expected; set it at the thermometer")
        if not commands.read:
            self._drop_line()  # it may be cut
        self._first(self._reading)

    def _first(self, ask: Callable[[], Any]) -> Any:
        """Return the first answer that can be read within a few tries. Raises DeviceError if there is none."""
        problem = ""
        for _ in range(self.settings.most_missed):
            try:
                return ask()
            except NoReading as error:
                problem = str(error)
        raise DeviceError(
            f"{self.name}: {problem}. Is it switched on, is {self.settings.port or 'its port'} the right port, are"
            f" `baud` ({self.settings.baud}) and `commands` ({self.settings.commands}) those of the thermometer?"
        )

    def _reading(self) -> float:
        """Return a temperature in degC. Raises NoReading, and DeviceFault if the sensor itself is faulty."""
        commands = COMMANDS[self.settings.commands]
        if commands.status and (status := self._answer(commands.status)).lstrip("0"):
            if not status.isdigit():
                raise NoReading("not_a_number", f"{status!r:.40} is not a status")
            raise self._unsound("over_range", f"it reports that its reading is not valid (status {status})")
        text = self._answer(commands.read)
        if (number := READING.fullmatch(text.upper())) is None:
            raise NoReading("not_a_number", f"{text!r:.40} is not a temperature in degrees Celsius")
        degC = float(number[1])
        if isnan(degC) or degC == SCPI_NAN:
            raise self._unsound("not_a_number", "it measures nothing")
        if abs(degC) >= SCPI_OVERLOAD:
            raise self._unsound("over_range", "it measures more than it can (overload)")
        low, high = self.settings.lowest_degC, self.settings.highest_degC
        if not low <= degC <= high:
            raise self._unsound("over_range", f"{degC:g} degC is outside of {low:g} to {high:g} degC")
        return degC

    def _unsound(self, what: str, message: str) -> DeviceFault:
        return DeviceFault(self.name, what, f"{self.name}: {message}; see its sensor and its input.")

    def _answer(self, request: str) -> str:
        """Send the request, if any, and return the next line. Raises NoReading, DeviceFault (`link_lost`)."""
        commands, port = COMMANDS[self.settings.commands], self.port
        if port is None:
            raise DeviceFault(self.name, "link_lost", f"{self.name} is not open.")
        try:
            if request:
                text = request.format(input=self.settings.input or commands.input).strip()
                port.reset_input_buffer()  # an answer that came too late is none to this request
                port.write((text + commands.ending).encode("ascii"))
            line = port.readline()
            while not request and port.in_waiting:
                line = port.readline()
        except OSError as error:
            raise DeviceFault(self.name, "link_lost", f"{self.name}: the line is gone: {error}.") from None
        if not line.endswith(b"\n"):
            broken = "an answer broke off" if line else "no answer"
            raise NoReading("silent", f"{broken} within {self.settings.timeout_s:g} s")
        try:
            return line.decode("ascii").strip()
        except UnicodeDecodeError:
            raise NoReading("not_a_number", f"{line!r:.40} is no text") from None

    def _drop_line(self) -> None:
        """Read and discard a line."""
        try:
            self._answer("")
        except NoReading:
            return


@dataclass
class TwinPort:
    """A simulated thermometer at the other end of the line: it answers its set of commands in bytes."""

    commands: Commands
    degC: Callable[[], float]
    answers: list[str] = field(default_factory=list)
    in_waiting: int = 0

    def write(self, data: bytes) -> None:
        """Answer a request."""
        verb = data.decode("ascii").split()[0]
        answers = {self.commands.identify: "PALPATE,TWIN,0,1.0", self.commands.unit: "C"}
        if verb in answers:
            self.answers.append(answers[verb])
        elif verb == self.commands.status.partition(" ")[0]:
            self.answers.append("000")
        else:
            self.answers.append(f"{self.degC():+.5E}" if self.commands.unit else f"{self.degC():+08.3f}")

    def readline(self) -> bytes:
        """Return the next answer."""
        if not self.commands.read:
            return f"{self.degC():.2f}\n".encode("ascii")
        return f"{self.answers.pop(0)}{self.commands.ending}".encode("ascii") if self.answers else b""

    def reset_input_buffer(self) -> None:
        """Drop the answers."""
        self.answers.clear()

    def close(self) -> None:
        """Do nothing."""


def connect_twin(thermometer: Thermometer) -> Port:
    """Return the port of a simulated thermometer, whose temperature oscillates slowly from the start of sampling."""
    settings, count = thermometer.settings, 0

    def degC() -> float:
        nonlocal count
        count += 1
        at_s = 0.0 if thermometer.elapsed is None else thermometer.elapsed()
        swing = DRIFT_DEGC * sin(2 * pi * (at_s / DRIFT_S + settings.seed % 97 / 97))
        [noise] = gaussians(1, "thermometer", settings.seed, thermometer.name, count)
        return LEVEL_DEGC[settings.place] + swing + settings.noise_degC * noise

    return TwinPort(COMMANDS[settings.commands], degC)


def connect_serial(thermometer: Thermometer) -> Port:
    """Open the serial port of the settings. Raises DeviceError."""
    name, settings, commands = thermometer.name, thermometer.settings, COMMANDS[thermometer.settings.commands]
    try:
        port: Port = open_serial(
            str(settings.port), settings.baud, settings.timeout_s, settings.timeout_s, commands.bits, commands.parity
        )
        return port
    except ModuleNotFoundError:
        raise DeviceError(f"{name}: {missing_sentence('a serial port', ['serial'])}") from None
    except (OSError, ValueError) as error:
        raise DeviceError(f"{name}: the port {settings.port} cannot be opened ({error})") from None


def make(name: str, settings: Settings, folder: Path) -> Thermometer:  # noqa: ARG001 - it reads no file
    """Return the thermometer of that name without opening it."""
    return Thermometer(name, settings, connect_twin if settings.driver == "twin" else connect_serial)


class PulledPort(TwinPort):
    """The line of a thermometer whose cable was pulled."""

    def write(self, data: bytes) -> None:  # noqa: ARG002
        """Raise OSError."""
        raise OSError("its cable is pulled")


def unplug(thermometer: Thermometer) -> None:
    """Pull the cable of an open twin; it stays pulled when the port is opened again."""
    thermometer.connect = lambda it: PulledPort(COMMANDS[it.settings.commands], lambda: 0.0)
    thermometer.port = thermometer.connect(thermometer)


KIND = DeviceKind(
    Settings,
    make,
    MEANINGS,
    calibration=(
        "is calibrated by its maker, or in a bath beside a reference. Write that day into the rig file:"
        " `calibrated: 2026-11-21`"
    ),
    unplug=unplug,
)
