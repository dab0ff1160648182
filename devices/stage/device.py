"""The sample stage: a person mounts the sample, and a scan or a key confirms it (thesis 3.3.2, 4.7.1)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from palpate.devices.acts import Act, UnconfirmedFault, going_on
from palpate.devices.desk import Desk, Pages, Prompt
from palpate.devices.device import DeviceError, DeviceFault, Health, NowNs, Signal
from palpate.devices.kinds import Date, DeviceKind
from palpate.devices.samples import HandMounted
from palpate.devices.stage.scanner import codes_of, plain, refusal
from palpate.protocols.events import Aside, Present, Reply, WorldEvent
from palpate.protocols.strict import Strict
from palpate.protocols.study import Stimulus

if TYPE_CHECKING:
    from palpate.devices.stage.scanner import Scanner


class Settings(Strict):
    """The settings in a rig file. `port` is that of a serial scanner; a scanner that types needs none.

    `key_confirms`: whether a key alone is enough.
    """

    kind: Literal["stage"]
    driver: Literal["hand", "barcode", "twin"]
    port: str | None = None
    baud: Annotated[int, Field(ge=300, le=4_000_000)] = 9600
    key_confirms: bool = True
    mount_s: Annotated[float, Field(ge=0, le=600)] = 2.0
    calibrated: Date | None = None

    @model_validator(mode="after")
    def _can_be_confirmed(self) -> Self:
        if self.driver != "barcode" and not self.key_confirms:
            raise ValueError("key_confirms: no needs driver: barcode, else nothing confirms a sample")
        if self.driver != "barcode" and self.port is not None:
            raise ValueError("port needs driver: barcode")
        return self


MEANINGS: Mapping[str, str] = {
    "port": "serial port of the scanner; none with `barcode` is a scanner that types",
    "baud": "symbols per second on the line",
    "key_confirms": "whether a key alone is enough, without a scan",
    "mount_s": "how long the twin takes to mount a sample, s",
}


@dataclass
class Scanning:
    """The desk for HandMounted: the right code is an answer, a wrong one is named in the prompt."""

    desk: Desk
    stimulus: Stimulus
    scanned: Callable[[], Sequence[str]]
    known: Mapping[str, str]
    key_confirms: bool
    codes: bool = False
    right: str | None = None
    wrong: list[str] = field(default_factory=list)
    prompt: Prompt | None = None

    def poll(self) -> Aside | None:
        """Return the experimenter's action, if any."""
        return self.desk.poll()

    def tell(self, state: Mapping[str, Any]) -> None:
        """Pass a state on to the desk."""
        self.desk.tell(state)

    def demand(self, prompt: Prompt | None) -> None:
        """Show the prompt, with the last refusal if there is one."""
        self.prompt = prompt
        if prompt is not None:
            why = f". {refusal(self.stimulus, self.wrong[-1], self.known)}." if self.wrong else ""
            prompt = replace(prompt, text=prompt.text + why, codes=self.codes)
        self.desk.demand(prompt)

    def answer(self) -> float | bool | str | None:
        """Return True once the sample is confirmed; a typed text is a code (from a scanner that types)."""
        given = self.desk.answer()
        if self.right is None:
            self._read(self.scanned())
            if isinstance(given, str):
                self.desk.demand(None)  # or what was typed would stay the answer
                self._read([given])
        if self.right is not None:
            return True
        return True if self.key_confirms and given is not None and not isinstance(given, str) else None

    def _read(self, codes: Sequence[str]) -> None:
        for code in codes:
            if plain(code) in codes_of(self.stimulus):
                self.right = code
                return
            self.wrong.append(code)
            self.demand(self.prompt)

    @property
    def by(self) -> str:
        """Return who or what confirmed that the sample is in place."""
        return "experimenter" if self.right is None else "barcode"


@dataclass
class Stage:
    """A presenter that prompts for samples as HandMounted does. `known` maps codes to the ids of all samples."""

    name: str
    settings: Settings
    scanner: Scanner | None = None
    known: Mapping[str, str] = field(default_factory=dict)
    hand: HandMounted = field(default_factory=HandMounted)
    act: Act | None = None
    request: Present | None = None
    scanning: Scanning | None = None
    unconfirmed: UnconfirmedFault = field(default_factory=UnconfirmedFault)

    @property
    def signals(self) -> Sequence[Signal]:
        """Return an empty sequence: it records nothing."""
        return ()

    def open(self) -> None:
        """Open the scanner, if there is one. Raises DeviceError."""
        if self.scanner is not None:
            self.scanner.open()

    def safe(self) -> None:
        """Do nothing: a stage moves nothing."""

    def close(self) -> None:
        """Release the scanner."""
        if self.scanner is not None:
            self.scanner.close()

    def describe(self) -> Mapping[str, Any]:
        """Return the settings."""
        return self.settings.model_dump(mode="json", exclude_none=True)

    def health(self, seconds: float) -> Health:  # noqa: ARG002 - a port is open or it is not
        """Return the state of the scanner, after dropping the codes that were scanned so far."""
        by = {"hand": "a key confirms", "twin": "simulated"}
        summary = by.get(self.settings.driver, f"scanner at {self.settings.port or 'the keyboard'}")
        try:
            if self.scanner is not None:
                self.scanner.forget()
        except DeviceFault as fault:
            return Health(False, str(fault), calibrated=self.settings.calibrated)
        return Health(True, summary, calibrated=self.settings.calibrated)

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent:
        """Wait until the sample of the trial is in place."""
        if aside := self.unconfirmed.demand_confirmation("changing_sample", window, desk):
            return aside
        if self.settings.driver == "twin":
            return self._simulated(request, window, desk, now_ns)
        if request.part is not None and (request.part.blank or request.part.sides):
            return self.hand.perform(
                request, window, desk, now_ns
            )  # nothing, or several samples: no code confirms that
        try:
            scanning = self._start_scanning(request, desk)
            event = self.hand.perform(request, window, scanning, now_ns)
        except DeviceFault as fault:
            desk.demand(None)
            self.scanning = None
            self.close()
            return self.unconfirmed.record(fault)
        if isinstance(event, Aside):
            return event
        self.scanning = None
        wrong = {"wrong": [plain(code) for code in scanning.wrong]} if scanning.wrong else {}
        code = {} if scanning.right is None else {"code": plain(scanning.right)}
        return Reply({**event.value, "by": scanning.by, **code, **wrong})

    def _start_scanning(self, request: Present, desk: Desk) -> Scanning:
        """Return the scanning for this very request; reopen a failed scanner, and drop earlier codes."""
        scanning = self.scanning
        if scanning is not None and self.request is request:
            scanning.desk = desk
            return scanning
        if self.scanner is not None and self.scanner.is_open:
            self.scanner.forget()
        elif self.scanner is not None:
            try:
                self.scanner.open()
            except DeviceError as error:
                raise DeviceFault(self.name, "link_lost", str(error)) from None
        self.request = request
        scanned: Callable[[], Sequence[str]] = (lambda: ()) if self.scanner is None else self.scanner.codes
        codes = self.settings.driver == "barcode"
        self.scanning = Scanning(desk, request.trial.stimulus, scanned, self.known, self.settings.key_confirms, codes)
        return self.scanning

    def _simulated(self, request: Present, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent:
        self.act = act = going_on(self.act, request, now_ns)
        mounted = self.settings.mount_s
        aside = act.wait("changing_sample", window, desk, now_ns, lambda: act.seconds(now_ns()) >= mounted)
        if aside is not None:
            return aside
        self.act = None
        return Reply({"presented": True, "by": "twin", "seconds": act.seconds(now_ns())})


def make(name: str, settings: Settings, folder: Path) -> Stage:  # noqa: ARG001 - every kind is made alike
    """Return the stage of that name without opening it."""
    if settings.driver != "barcode" or settings.port is None:
        return Stage(name, settings)
    from palpate.devices.stage.scanner import Scanner

    return Stage(name, settings, Scanner(name, settings.port, settings.baud))


NOTHING_TO_CALIBRATE = "has nothing to calibrate: it only reports which sample is on it"
KIND = DeviceKind(
    Settings,
    make,
    MEANINGS,
    NOTHING_TO_CALIBRATE,
    unplug="a person answers",
    exceed="a person places the samples",
)
