"""A link in virtual time, a window and a desk that live by the same time, and a door over all of it."""

from dataclasses import dataclass, field
from types import SimpleNamespace

from benchmarks.serial_lines import VirtualLine
from palpate.devices.door.firmware.ailments import Ailing
from palpate.devices.door.firmware.controller import Firmware
from palpate.devices.door.firmware.sensor_check import Limits as DeviceLimits
from palpate.devices.door.firmware.wire import Wire
from palpate.devices.door.link.codes import State
from palpate.devices.door.link.limits import Limits
from palpate.devices.door.link.link import Link, Timing
from palpate.devices.door.link.simulator import Connection, DoorSimulator, Setup
from palpate.protocols.events import Chunk, Present, Samples
from tests.devices.door.firmware.plants import TinyPlant, out_and_back

FRAME_MS = 10
PROFILE_N = [10.0] * 621


@dataclass
class Bench:
    """One device on one line, which can be connected again."""

    plant: object = field(default_factory=lambda: Ailing(TinyPlant(out_and_back()), "silent"))
    limits: DeviceLimits = field(default_factory=lambda: DeviceLimits(speed_deg_s=180.0))
    beats: bool = True

    def __post_init__(self):
        self.firmware = Firmware(self.plant, self.limits)
        self.line = VirtualLine(Wire(self.firmware))
        self.link = None
        self.closed = 0
        self.line.every_ms = self._every_ms

    def connect(self):
        self.link = Link("door", self.line, self.line.clock_s, Timing())
        self.link.stamp_ns = self.line.now_ns
        return Connection(self.link, self._close, {"port": "virtual"})

    def _close(self):
        self.closed += 1
        self.link = None

    def _every_ms(self, t_ms):
        if self.link is not None and self.beats and t_ms % 10 == 0:
            self.link.beat()


@dataclass
class VirtualPages:
    """A window that looks every 10 ms of virtual time, and at the desk each time; `shown` are the pages' keys."""

    line: VirtualLine
    link: object
    shown: list = field(default_factory=list)
    looks: int = 0
    paused: bool = False

    def wait_for(self, key, desk, ready):
        self.shown.append(key)
        while self.paused or not ready():
            self.looks += 1
            if self.looks > 20_000:
                raise AssertionError(f"nothing ever happens on the page {key}")
            self.passes(FRAME_MS)
            if (aside := desk.poll()) is not None:
                self.paused = {"pause": True, "go_on": False}.get(aside.value["do"], self.paused)
                return aside
        return None

    def passes(self, ms):
        """Time passes; whoever reads the line reads it."""
        until_ms = self.line.t_ms + ms
        link = self.link()
        while link is not None and link.broken is None and self.line.t_ms < until_ms:
            link.pump((until_ms - self.line.t_ms) / 1000)
        self.line.run(max(0, until_ms - self.line.t_ms))


@dataclass
class VirtualDesk:
    """`at` does things by the virtual millisecond: an aside is given to who polls, an exception raised, a call made."""

    line: VirtualLine
    at: dict = field(default_factory=dict)
    demands: list = field(default_factory=list)
    statuses: list = field(default_factory=list)
    confirmed: list = field(default_factory=list)
    confirms: bool = True
    answered: object = None
    confirm_asked: bool = False

    def poll(self):
        if self.confirm_asked and self.confirms:
            self.answered = True
        for t_ms in sorted(self.at):
            if t_ms <= self.line.t_ms:
                what = self.at.pop(t_ms)
                if isinstance(what, BaseException):
                    raise what
                if callable(what):
                    what()
                    continue
                return what
        return None

    def demand(self, prompt):
        if prompt is not None and (not self.demands or self.demands[-1] != prompt.text):
            self.demands.append(prompt.text)
        if prompt is None and self.confirm_asked and self.answered:
            self.confirmed.append(self.demands[-1])
        self.answered, self.confirm_asked = None, prompt is not None and "then confirm" in prompt.text

    def answer(self):
        return self.answered

    def tell(self, state):
        self.statuses.append(dict(state))


class Drained:
    """Telemetry stored without a thread."""

    def __init__(self, door, now_ns):
        self.door, self.now_ns, self.rows, self.taken_ns, self.ended, self.first = door, now_ns, b"", 0, False, 0

    def start(self):
        self.door.start(self.now_ns)
        self.taken_ns = self.now_ns()

    def _drain(self):
        if not self.ended and self.door._connection is not None and self.door._connection.link.samples:
            for block in self.door.read(0.0)["telemetry"]:
                self.rows += block.data

    def due(self):
        self._drain()
        return bool(self.rows) and (self.ended or self.now_ns() - self.taken_ns >= 500_000_000)

    def take(self):
        rows, self.rows, self.taken_ns = self.rows, b"", self.now_ns()
        signal = self.door.signals[0]
        piece = Samples("door_telemetry", signal.channels, signal.units, signal.rate_hz, 0, rows, self.first)
        self.first += piece.count
        return Chunk({"streams": {}}, (piece,))

    def fault(self):
        return None

    def stop(self):
        self._drain()
        self.ended = True
        self.door.stop()
        return {"door_telemetry": {"samples": self.first}}


def request(name="BC3_g0"):
    """A present request for that stimulus; two of them are two objects."""
    return Present(SimpleNamespace(stimulus=SimpleNamespace(id=name, columns={})))


@dataclass
class Lab:
    """A door, its line, a window and a desk."""

    bench: Bench = field(default_factory=Bench)
    profile_N: object = field(default_factory=lambda: PROFILE_N)
    time_limit_s: float = 60.0

    def __post_init__(self):
        line = self.bench.line
        setup = Setup(0.9, Limits(), 500, self.time_limit_s, "serial")
        self.door = DoorSimulator("door", setup, self.bench.connect, lambda _request: self.profile_N, Drained)
        self.desk = VirtualDesk(line)
        self.window = VirtualPages(line, lambda: self.bench.link)

    def opened(self):
        self.door.open()
        return self

    @property
    def at_rest(self):
        return self.bench.plant.mode == "off"

    def perform(self, presentation):
        return self.door.perform(presentation, self.window, self.desk, self.bench.line.now_ns)

    def until(self, kind, presentation=None):
        """Perform until something of that kind comes: (it, all that came before)."""
        presentation, before = presentation or request(), []
        for _ in range(300):
            outcome = self.perform(presentation)
            if isinstance(outcome, kind):
                return outcome, before
            before.append(outcome)
        raise AssertionError(before)


SLOW = 4000
"""A tiny door that takes eight seconds to be opened and brought back."""


def slow_lab(ailment="silent", **more):
    return Lab(Bench(Ailing(TinyPlant(out_and_back(ms=SLOW)), ailment)), **more).opened()


def playing(ailment="silent"):
    """A lab whose door plays, and the request; a first chunk has come."""
    lab, presentation = slow_lab(ailment), request()
    lab.until(Chunk, presentation)
    assert lab.bench.firmware.state is State.playing and not lab.at_rest
    return lab, presentation
