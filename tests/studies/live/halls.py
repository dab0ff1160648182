"""A hall for live sessions in tests: virtual time, scripted orders, a presenter that keeps to the seam.

Everything else is the real thing: the desk, the live world, the runner, the ledger.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from itertools import takewhile
from typing import Any

from palpate.devices.samples import HandMounted
from palpate.devices.suspend import SuspendWatch
from palpate.protocols.events import NS, Ask, Confirm, Reply
from palpate.protocols.plan import Plan, compile_plan
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.console.desk import ExperimenterDesk
from palpate.studies.console.listening import Heard
from palpate.studies.live.opening import Opening
from palpate.studies.live.world import Station, live_world
from palpate.studies.sessions.rig import RigPlan
from tests.protocols.studies_for_tests import toy

TURN_NS = NS // 10
"""What one look of the presenter at the desk takes."""
SHEETS = (
    ("T07", "sandpaper P60", "box 3"),
    ("T12", "cork", "box 1"),
    ("T33", "steel mesh", "box 7"),
    ("T41", "felt", ""),
)


def sheets(**changes: Any) -> Study:
    """Four samples that a person mounts, rated on two attributes."""
    stimuli = [{"id": i, "columns": {"material": m, "position": p, "size": "1"}} for i, m, p in SHEETS]
    needs = {"needs": ["samples", "window"], "stimuli": stimuli, "title": "Texture ratings", "study": "sheets"}
    return toy(**{**needs, "order": {"design": "as_listed"}, "simulation": {"latents": {}}, "rest": None, **changes})


def sheets_plan(**changes: Any) -> Plan:
    """The study of sheets for P001."""
    return compile_plan(sheets(**changes), ParticipantRow("P001"))


@dataclass
class Time:
    """Virtual session time."""

    t_ns: int = 0

    def __call__(self) -> int:
        return self.t_ns

    def seconds(self) -> float:
        return self.t_ns / NS


@dataclass
class Script:
    """A source of orders (or of keys) that come one after the other, each at its virtual second at the soonest."""

    time: Time
    orders: Sequence[tuple[float, str]] = ()
    by_line: bool = True
    closed: bool = False
    given: int = 0

    def take(self) -> list[Heard]:
        now_s = self.time.seconds()
        due = list(takewhile(lambda order: order[0] <= now_s, self.orders[self.given :]))
        self.given += len(due)
        return [Heard(text, now_s) for _, text in due]

    def close(self) -> None:
        self.closed = True


@dataclass
class Paper:
    """A display that keeps what it was given."""

    lines: list[str] = field(default_factory=list)
    views: list[Any] = field(default_factory=list)
    closed: bool = False

    def show(self, view: Any) -> None:
        self.views.append(view)

    def say(self, line: str) -> None:
        self.lines.append(line)

    def close(self) -> None:
        self.closed = True


@dataclass
class Stage:
    """A presenter in virtual time: each form takes the simulated person `turns` looks; it keeps to the seam."""

    person: Perceiver
    time: Time
    turns: int = 20
    description: Mapping[str, Any] = field(default_factory=lambda: {"stage": True})
    on_side: Callable[[str], None] | None = None
    paused: bool = False
    request: Any = None
    left: int = 0
    seen_ns: int = 0
    pages: list[str] = field(default_factory=list)
    closed: bool = False

    def perform(self, request, desk, now_ns):
        if request is not self.request:
            self.request, self.left, self.seen_ns = request, self.turns, 0
        while self.left > 0:
            if (aside := self._turn(desk, request.body()["do"])) is not None:
                return aside
            if not self.paused:
                self.left -= 1
                self.seen_ns += TURN_NS
        self.request = None
        if isinstance(request, Confirm):
            return Reply({"measured_mm": 127.0, "nominal_mm": 127.0})
        value = self.person.answer(request)[0].value if isinstance(request, Ask) else {}
        return Reply({**value, "seconds": self.seen_ns / NS})

    def wait_for(self, key, desk, ready):
        while self.paused or not ready():
            if (aside := self._turn(desk, key)) is not None:
                return aside
        return None

    def show_answered(self, request, reply, seconds, desk):
        until_ns = self.time() + round(seconds * NS)
        self.pages.append(getattr(getattr(request, "form", None), "name", request.body()["do"]))
        return self.wait_for("answered", desk, lambda: self.time() >= until_ns)

    def finish(self, desk=None, page="end"):
        self.pages.append(page)

    def close(self):
        self.closed = True

    def _turn(self, desk, page):
        aside = desk.poll()
        self.time.t_ns += TURN_NS
        page = "pause" if self.paused else page
        if not self.pages or self.pages[-1] != page:
            self.pages.append(page)
        if aside is not None and aside.value["do"] in {"pause", "go_on"}:
            self.paused = aside.value["do"] == "pause"
        return aside


@dataclass
class Hall:
    """A live rig at a stage, with everything in it to look at afterwards."""

    orders: Sequence[tuple[float, str]] = ()
    by_line: bool = True
    station: Station | None = None
    turns: int = 20
    time: Time = field(default_factory=Time)
    paper: Paper = field(default_factory=Paper)
    stage: Stage | None = None
    desk: ExperimenterDesk | None = None
    suspended_ns: Callable[[], int] = lambda: 0
    made_safe: list[bool] = field(default_factory=list)

    @property
    def rig(self) -> RigPlan:
        """Return the plan of the rig; opened again it is a new run in the same hall."""
        description = {"kind": "live", "window": None, "twins": [], "language": "en"}
        opening = Opening(description, lambda _plan: None, self._stage, self._furnish)
        return RigPlan(description, opening.check, opening.open)

    def _stage(self, plan: Plan) -> Stage:
        self.stage = Stage(Perceiver(plan), self.time, self.turns)
        return self.stage

    def _furnish(self, plan: Plan, t_ns: int, presenter: Any, opened: ExitStack):
        from palpate.studies.sessions.rig import Rig

        self.time.t_ns = t_ns
        script = Script(self.time, self.orders, self.by_line)
        self.desk = desk = ExperimenterDesk(plan, script, self.paper, self.time.seconds)
        opened.callback(desk.close)
        station = self.station or Station(HandMounted())
        safe = lambda: self.made_safe.append(True)  # noqa: E731
        suspend = SuspendWatch(self.suspended_ns)
        world = live_world(plan, presenter, desk, lambda: desk.status, station, self.time, safe, suspend=suspend)
        return Rig(world, opened.close, desk.watch, lambda: presenter.finish(desk, "end"))
