"""The driver of a serial thermal plate: a Peltier element under the skin, warmed and cooled from a neutral level."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from math import nan
from pathlib import Path
from threading import RLock
from typing import Annotated, Any, Literal, Self, cast

from pydantic import Field, model_validator

from palpate.devices.acts import Act, UnconfirmedFault, going_on, page_of
from palpate.devices.desk import Desk, Pages
from palpate.devices.device import (
    DeviceError,
    DeviceFault,
    Health,
    NowNs,
    closed_on_failure,
    faults_as_errors,
    interleaved,
)
from palpate.devices.kinds import Date, DeviceKind
from palpate.devices.serial_port import open_serial
from palpate.protocols.events import Present, Reply, Samples, WorldEvent
from palpate.protocols.extras import missing_sentence
from palpate.protocols.strict import Strict
from palpate.protocols.study import Stimulus

from .line import FAILED, LENGTH, UNHEARD, FrameError, Port, frame, parse
from .twin import SILENCE_S, TwinPort, Unplugged, peak_degC

COLUMNS = ("target_degc", "seconds", "ramp_degc_s")
"""The columns of a stimulus: the temperature, how long it is held including the way there, and how fast it comes."""
HOT_DEGC = 45.0
SAMPLE_S = 0.05
SETTLED_DEGC, SETTLE_S = 0.3, 60.0
"""A stimulus begins within so many degC of the neutral level; a plate that is not there in time is stuck."""
SLOWEST_DEGC_S = 0.1
TRIES = 3


class Limits(Strict):
    """What the driver never exceeds, whatever a study wants. A rig file can narrow it; it cannot go beyond `le`, `ge`.

    0 and 50 degC are the cut-offs of quantitative sensory testing (Rolke et al. 2006). Each second above 45 degC counts
    up to `hot_s`, each second below counts down.
    """

    lowest_degC: Annotated[float, Field(ge=0, le=30)] = 10.0
    highest_degC: Annotated[float, Field(ge=34, le=50)] = 45.0
    hot_s: Annotated[float, Field(ge=0, le=10)] = 5.0
    longest_s: Annotated[float, Field(gt=0, le=60)] = 30.0
    ramp_degC_s: Annotated[float, Field(ge=0.1, le=50)] = 20.0


class Settings(Strict):
    """The settings of a plate in a rig file."""

    kind: Literal["thermal.plate"]
    driver: Literal["serial", "twin"]
    port: str | None = None
    baud: Annotated[int, Field(ge=9600, le=4_000_000)] = 115_200
    timeout_s: Annotated[float, Field(ge=0.01, le=0.2)] = 0.05
    neutral_degC: Annotated[float, Field(ge=30, le=34)] = 32.0
    limits: Limits = Limits()
    calibrated: Date | None = None
    noise_degC: Annotated[float, Field(ge=0, le=1)] = 0.02
    seed: Annotated[int, Field(ge=0)] = 1

    @model_validator(mode="after")
    def _has_port(self) -> Self:
        if self.driver == "serial" and not self.port:
            raise ValueError("the driver serial needs a port, as /dev/ttyUSB0")
        return self


MEANINGS: Mapping[str, str] = {
    "port": "serial port, as /dev/ttyUSB0 or COM3; needed by `serial`",
    "baud": "symbols per second on the line",
    "timeout_s": "how long an answer is waited for, s",
    "neutral_degC": "the temperature at rest, and after a fault, degrees Celsius",
    "limits": "what the driver never exceeds",
    "limits.lowest_degC": "nothing colder is presented, degrees Celsius",
    "limits.highest_degC": "nothing warmer is presented, degrees Celsius",
    "limits.hot_s": f"longest time above {HOT_DEGC:g} degrees Celsius, s; cooling takes as long again",
    "limits.longest_s": "longest stimulus, s",
    "limits.ramp_degC_s": "fastest ramp, degrees Celsius per second",
    "noise_degC": "noise of the twin's readings (SD), degrees Celsius",
}


class StimulusError(DeviceError):
    """A stimulus that the plate cannot present, or must not; `column` is the one that is wrong."""

    def __init__(self, message: str, column: str) -> None:
        super().__init__(message)
        self.column = column


@dataclass
class Going:
    """A presentation: temperature, ramp and seconds of its warmth (None: blank), and what was measured meanwhile."""

    warmth: tuple[float, float, float] | None
    lasts_s: float
    gap_s: float
    began_s: float
    began_ns: int
    onset_s: float | None = None
    onset_ns: int = 0
    stopped: bool = False
    times: list[float] = field(default_factory=list)
    degC: list[float] = field(default_factory=list)


@dataclass
class Plate:
    """A plate that presents the warmth of a stimulus table. `elapsed_s` is the clock, of its twin too."""

    name: str
    settings: Settings
    elapsed_s: Callable[[], float] = time.monotonic
    port: Port | None = None
    act: Act | None = None
    going: Going | None = None
    counted_s: float = 0.0
    hot_s: float = 0.0
    target_degC: float = 0.0
    degC: float = 0.0
    unconfirmed: UnconfirmedFault = field(default_factory=UnconfirmedFault)
    lock: RLock = field(default_factory=RLock)

    @property
    def signals(self) -> tuple[()]:
        """Return no signals: it does not record by itself, its replies hold the temperature."""
        return ()

    def open(self) -> None:
        """Open the port and go to the neutral level. Raises DeviceError."""
        self.close()
        with closed_on_failure(self.close), faults_as_errors():
            self.port = connect(self)
            self._ask("N", round(10 * self.settings.neutral_degC))
            self._go(self.settings.neutral_degC)
            self.measure()

    def safe(self) -> None:
        """Go to the neutral level, fast. Where the line is gone, the plate does so by itself after a second."""
        with self.lock:
            with suppress(DeviceFault):
                self._ask("R", round(10 * self.settings.limits.ramp_degC_s))
            with suppress(DeviceFault):  # also if the plate did not understand how fast
                self._go(self.settings.neutral_degC)

    def close(self) -> None:
        """Go to the neutral level and close the port."""
        self.safe()
        self.act = self.going = None
        with self.lock:
            port, self.port = self.port, None
            if port is not None:
                port.close()

    def describe(self) -> Mapping[str, Any]:
        """Return the settings with their limits."""
        return self.settings.model_dump(mode="json", exclude_none=True)

    def health(self, seconds: float) -> Health:
        """Wait for some seconds, and return the temperature at rest."""
        time.sleep(seconds)
        return Health(True, f"{self.measure():.2f} degC", calibrated=self.settings.calibrated)

    def check(self, stimulus: Stimulus, seconds: float | None = None) -> None:
        """Raise StimulusError unless the stimulus is within the limits, and not longer than its interval."""
        self._warmth(stimulus, seconds)

    def feels(self, stimulus: Stimulus, seconds: float | None = None) -> Mapping[str, float]:
        """Return the temperature that a twin's surface comes to: a short stimulus does not reach its target."""
        target, ramp, lasts_s = self._warmth(stimulus, seconds)
        return {"target_degc": peak_degC(self.settings.neutral_degC, target, ramp, lasts_s)}

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent:
        """Present the stimulus from the neutral level, or stay there in a blank interval; after a pause, again."""
        if aside := self.unconfirmed.demand_confirmation("changing_sample", window, desk):
            return aside
        fresh = self.act is None or self.act.request is not request
        self.act = act = going_on(self.act, request, now_ns)
        try:
            if fresh or self.going is None or (self.going.stopped and act.paused_at_ns is None):
                self.going = self._begin(request, now_ns)
            going = self.going
            ready = lambda: not going.stopped and self._is_over(going, now_ns)  # noqa: E731
            aside = act.wait(page_of(request), window, desk, now_ns, ready)
        except BaseException as error:
            self.safe()
            self.act = None
            if isinstance(error, DeviceFault):
                return self.unconfirmed.record(error)
            raise
        do = "end" if aside is None else aside.value.get("do")
        if do in ("end", "pause", "repeat", "abort"):
            self.safe()
            going.stopped = True
        if do in ("end", "repeat", "abort"):
            self.act = None
        return aside or self._reply(going)

    def warm(self, target_degC: float, ramp_degC_s: float) -> None:
        """Go to a temperature at a ramp. Raises DeviceFault (`limit`) beyond a limit: then nothing is sent."""
        limits = self.settings.limits
        self._demand(target_degC, "degC", limits.lowest_degC, limits.highest_degC)
        self._demand(ramp_degC_s, "degC/s", SLOWEST_DEGC_S, limits.ramp_degC_s)
        with self.lock:
            self._ask("R", round(10 * ramp_degC_s))
            self._go(target_degC)

    def measure(self) -> float:
        """Return the temperature in degC.

        Raises DeviceFault: `limit` after too long above 45 degC, `heartbeat_lost` or `firmware` if the plate says so.
        """
        status, self.degC = self._ask("S"), self._ask("M") / 100
        self._count_hot()
        if status & FAILED:
            raise DeviceFault(self.name, "firmware", f"{self.name}: the plate says that its hardware has failed")
        if status & UNHEARD:
            raise DeviceFault(self.name, "heartbeat_lost", f"{self.name}: it heard nothing for 1 s and went to neutral")
        limits = self.settings.limits
        self._demand(self.degC, "degC measured", limits.lowest_degC - 1, limits.highest_degC + 1)
        return self.degC

    def _begin(self, request: Present, now_ns: NowNs) -> Going:
        """Start a presentation; the plate is opened again after a fault. Raises DeviceFault."""
        part = request.part
        warmth = None
        try:
            if self.port is None:
                self.open()
            if part is None or not part.blank:
                warmth = self._warmth(request.trial.stimulus, None if part is None else part.seconds)
        except DeviceError as error:
            raise DeviceFault(self.name, "refused", str(error)) from None
        lasts_s = (part and part.seconds) or (warmth[2] if warmth else 0.0)
        self._go(self.settings.neutral_degC)
        gap_s = part.gap_s if part is not None and part.interval > 1 else 0.0
        return Going(warmth, lasts_s, gap_s, self.elapsed_s(), now_ns())

    def _is_over(self, going: Going, now_ns: NowNs) -> bool:
        """Read the plate when a reading is due, and bring the presentation forward. Raises DeviceFault."""
        at_s = self.elapsed_s() - going.began_s
        if going.times and at_s - going.times[-1] < SAMPLE_S:
            return False
        going.times.append(at_s)
        going.degC.append(self.measure())
        neutral = self.settings.neutral_degC
        if going.onset_s is None:
            settled = abs(self.degC - neutral) <= SETTLED_DEGC
            if not settled and at_s > SETTLE_S:
                raise DeviceFault(self.name, "stuck", f"{self.name}: {self.degC:.1f} degC after {SETTLE_S:g} s at rest")
            if settled and at_s >= going.gap_s:
                going.onset_s, going.onset_ns = at_s, now_ns()
                if going.warmth is not None:
                    self.warm(*going.warmth[:2])
            return False
        felt_s = at_s - going.onset_s
        if going.warmth is not None and felt_s >= going.warmth[2]:
            self._go(neutral)
        return felt_s >= going.lasts_s

    def _reply(self, going: Going) -> Reply:
        felt: dict[str, Any] = {"blank": True}
        if going.warmth is not None:
            felt = dict(zip(("target_degc", "ramp_degc_s", "seconds"), going.warmth, strict=True))
        felt |= {"onset_ns": going.onset_ns, "lowest_degc": min(going.degC), "highest_degc": max(going.degC)}
        twin = {"by": "twin"} if self.settings.driver == "twin" else {}
        rows = interleaved(going.times, going.degC)
        samples = Samples("plate", ("time", "temperature"), ("s", "degC"), 0.0, going.began_ns, rows)
        seconds = round(going.times[-1], 3)
        return Reply({"presented": True, "seconds": seconds, **twin, "plate": felt}, (samples,))

    def _warmth(self, stimulus: Stimulus, seconds: float | None) -> tuple[float, float, float]:
        """Return target, ramp and seconds of a stimulus. Raises StimulusError unless they are within the limits."""
        limits = self.settings.limits

        def number(column: str, least: float, most: float, default: object = "") -> float:
            text = stimulus.columns.get(column, "").strip() or str(default)
            try:
                value = float(text)
            except ValueError:
                value = nan
            if least <= value <= most:
                return value
            found = f"{column} is {text!r}; {least:g} to {most:g} is allowed"
            raise StimulusError(f"{self.name}: stimulus {stimulus.id!r}: {found}", column)

        target = number("target_degc", limits.lowest_degC, limits.highest_degC)
        ramp = number("ramp_degc_s", SLOWEST_DEGC_S, limits.ramp_degC_s, 8)
        longest = min(limits.longest_s, limits.hot_s if target > HOT_DEGC else limits.longest_s)
        return target, ramp, number("seconds", SAMPLE_S, min(longest, seconds or longest), seconds or "")

    def _demand(self, value: float, unit: str, least: float, most: float) -> None:
        if not least <= value <= most:  # so is NaN
            self.safe()
            found = f"{self.name}: {value:g} {unit}; {least:g} to {most:g} is allowed"
            raise DeviceFault(self.name, "limit", found)

    def _go(self, degC: float) -> None:
        """Send a target within the limits. Raises DeviceFault."""
        self._count_hot()
        self._ask("T", round(10 * degC))
        self.target_degC = degC

    def _count_hot(self) -> None:
        """Count the time since the last count up if the plate was hot, else down. Raises DeviceFault (`limit`)."""
        now_s = self.elapsed_s()
        passed_s, self.counted_s = now_s - self.counted_s, now_s
        hot_s = 0.0
        if max(self.degC, self.target_degC) > HOT_DEGC:
            hot_s = min(passed_s, SILENCE_S)  # without a request it has gone to neutral by itself
        self.hot_s = max(0.0, self.hot_s + hot_s - (passed_s - hot_s))
        if self.hot_s > self.settings.limits.hot_s and self.target_degC > HOT_DEGC:
            self.target_degC = self.settings.neutral_degC
            self.safe()
            found = f"{self.name}: above {HOT_DEGC:g} degC for {self.hot_s:.1f} s"
            raise DeviceFault(self.name, "limit", f"{found}; at most limits.hot_s = {self.settings.limits.hot_s:g}")

    def _ask(self, letter: str, number: int = 0) -> int:
        """Send a request and return the number of its answer. Raises DeviceFault."""
        problem = ""
        with self.lock:
            if (port := self.port) is None:
                raise DeviceFault(self.name, "link_lost", f"{self.name} is not open")
            for _ in range(TRIES):
                try:
                    port.reset_input_buffer()  # an answer that came too late is none to this request
                    port.write(frame(letter, number))
                    answer, value = parse(port.read(LENGTH))
                except OSError as error:
                    self.port = None
                    with suppress(OSError):
                        port.close()
                    raise DeviceFault(self.name, "link_lost", f"{self.name}: the line is gone: {error}") from None
                except FrameError as error:
                    problem = f"gives no answer to {letter}: {error}"
                    continue
                if answer == "E":
                    raise DeviceFault(self.name, "refused", f"{self.name}: the plate refuses {letter} {number}")
                if answer == letter and (letter in "MS" or value == number):
                    return value
                problem = f"answers {letter} {number} with {answer} {value}"
        raise DeviceFault(self.name, "silent", f"{self.name}: the plate {problem}; see its cable, port and baud")


def unplug(plate: Plate) -> None:
    """Cut the line of an open twin."""
    plate.port = Unplugged()


def exceed(plate: Plate) -> tuple[float, float]:
    """Command more than the limits of an open twin in every way; return the highest temperature of its surface."""
    highest = plate.settings.limits.highest_degC
    for degC in (highest + 0.1, 1e9, nan):
        with suppress(DeviceFault):
            plate.warm(degC, plate.settings.limits.ramp_degC_s)
    time.sleep(0.5)
    port = cast(TwinPort, plate.port)
    port.pass_time()
    return max(port.plant.degC, port.plant.target_degC), highest


def connect(plate: Plate) -> Port:
    """Return the port of the settings, open. Raises DeviceError."""
    settings = plate.settings
    if settings.driver == "twin":
        return TwinPort(plate.elapsed_s, settings.noise_degC, settings.seed)
    try:
        port: Port = open_serial(str(settings.port), settings.baud, settings.timeout_s, settings.timeout_s)
        return port
    except ModuleNotFoundError:
        raise DeviceError(f"{plate.name}: {missing_sentence('a serial port', ['serial'])}") from None
    except (OSError, ValueError) as error:
        raise DeviceError(f"{plate.name}: the port {settings.port} cannot be opened ({error})") from None


def make(name: str, settings: Settings, folder: Path) -> Plate:  # noqa: ARG001 - it reads no file
    """Return the plate of that name without opening it."""
    return Plate(name, settings)


KIND = DeviceKind(
    Settings,
    make,
    MEANINGS,
    unplug=unplug,
    exceed=exceed,
    calibration="is compared with a reference thermometer on the plate. Write that day down: `calibrated: 2026-11-21`",
)
