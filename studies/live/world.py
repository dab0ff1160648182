"""The live world: a participant at the window, an experimenter at the desk, and devices."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Protocol

from palpate.devices.acts import Act, going_on, page_of
from palpate.devices.desk import Desk, Pages
from palpate.devices.device import Presents, Records
from palpate.devices.samples import FeltInIntervals, HandMounted
from palpate.devices.suspend import SuspendWatch
from palpate.protocols.events import (
    Aside,
    Ask,
    Choose,
    Fault,
    Instruct,
    Present,
    Reply,
    Request,
    Sense,
    Show,
    World,
    WorldEvent,
)
from palpate.protocols.plan import Plan
from palpate.protocols.runner import BROKEN_OFF
from palpate.protocols.simulated_world import Done, Twin
from palpate.protocols.study import Study
from palpate.studies.sessions.rig import RigError

if TYPE_CHECKING:
    from palpate.devices.streams.beside import BesideRecorder
    from palpate.devices.window.presenter import Presenter
    from palpate.studies.console.status import SessionStatus


def clock_from(t_ns: int, count_ns: Callable[[], int] = time.perf_counter_ns) -> Callable[[], int]:
    """Return a clock of session time that starts at t_ns now and never runs backwards."""
    start_ns = count_ns()
    return lambda: t_ns + count_ns() - start_ns


@dataclass
class Resumed:
    """What is done before a session that was interrupted in its trials goes on.

    `repeat` are the parts that the study repeats: the page of instructions, and the block under way from its first
    trial.
    """

    repeat: Collection[str] = ()
    pages: list[Instruct] = field(init=False)
    block: bool = field(init=False)
    between_intervals: bool = True

    def __post_init__(self) -> None:
        self.pages = [Instruct("instructions")] if "instructions" in self.repeat else []
        self.block = "block" in self.repeat

    def before(self, request: Request) -> WorldEvent | None:
        """Return what comes before the first request of a trial, once its pages were shown; None if nothing does.

        What was felt in an interval before the interruption cannot be compared: the trial is repeated.
        """
        if self.block:
            self.block = self.between_intervals = False
            return Aside({"do": "repeat", "which": "block"})
        first, self.between_intervals = self.between_intervals, False
        later = isinstance(request, Present) and request.part is not None and request.part.interval > 1
        asked = isinstance(request, Ask) and request.form.name == "intervals"
        return BROKEN_OFF if first and (later or asked) else None


@dataclass
class LiveWorld:
    """A world that hands requests to the window or to a device, and returns what the experimenter does as asides.

    `left_paused` returns, once all recorded events have been seen, whether the last run ended in a pause: resuming the
    session ends the pause. `notes` are recorded before anything else is done. `in_trials` returns then whether the
    session had come to its trials, and `resumed` says what is repeated in that case.
    """

    presenter: Presenter
    desk: Desk
    device: Station
    clock: Callable[[], int]
    left_paused: Callable[[], bool] = lambda: False
    suspend: SuspendWatch = field(default_factory=SuspendWatch)
    notes: list[str] = field(default_factory=list)
    in_trials: Callable[[], bool] = lambda: False
    resumed: Resumed | None = None
    _seen_record: bool = False
    _held: WorldEvent | None = None
    _showing: Act | None = None

    def now(self) -> int:
        """Return nanoseconds since the session began, without the time between its runs."""
        return self.clock()

    def perform(self, request: Request) -> WorldEvent:
        """Perform the request; if it is given up, its demand to the experimenter is withdrawn.

        If the computer was suspended meanwhile, a note about that is returned first, and the outcome with the next
        request.
        """
        if self._held is not None:
            held, self._held = self._held, None
            return held
        if not self._seen_record:
            self._seen_record = True
            self.desk.demand(None)  # the desk hears of it first: all that was recorded has been seen
            if not self.in_trials():
                self.resumed = None
            if self.left_paused():
                return Aside({"do": "go_on"})
        if self.notes:
            return Aside({"do": "note", "text": self.notes.pop(0)})
        if self.resumed is not None and (before := self._once_more(self.resumed, request)) is not None:
            return before
        event = self._act(request)
        if _gives_up(event):
            self.desk.demand(None)
        if isinstance(request, Ask) and (isinstance(event, Reply) or _gives_up(event)):
            self.desk.tell({"side": None})
        if (message := self.suspend.message()) is not None:
            self._held = event
            return Aside({"do": "note", "text": f"{message[:1].upper()}{message[1:]}."})
        return event

    def _once_more(self, resumed: Resumed, request: Request) -> WorldEvent | None:
        """Show the pages that are repeated, then return what comes before the first request of a trial."""
        trial = getattr(request, "trial", None)
        if trial is None or trial.number < 1:  # a reference is no trial
            return None
        if resumed.pages:
            page = resumed.pages[0]
            event = self.presenter.perform(page, self.desk, self.clock)
            if not isinstance(event, Reply):
                return event
            resumed.pages.pop(0)
            return Aside({"do": "instructed", "page": page.page})
        return resumed.before(request)

    def _act(self, request: Request) -> WorldEvent:
        if isinstance(request, Present | Sense):
            return self.device.perform(request, self.presenter, self.desk, self.clock)
        if isinstance(request, Show):
            return self._show(request)
        if isinstance(request, Choose):
            raise RigError(f"trial {request.trial.number}: no procedure chooses its level")
        if isinstance(request, Ask) and (instead := self.device.before(request)) is not None:
            return instead
        event = self.presenter.perform(request, self.desk, self.clock)
        if isinstance(request, Ask) and isinstance(event, Aside):
            self.device.on_aside(event)
        if isinstance(request, Ask) and (isinstance(event, Reply) or _gives_up(event)):
            return self.device.after(event)
        return event

    def _show(self, request: Show) -> WorldEvent:
        """Show a page for some seconds, without pauses."""
        self._showing = act = going_on(self._showing, request, self.clock)
        aside = act.wait(
            request.page, self.presenter, self.desk, self.clock, lambda: act.seconds(self.clock()) >= request.seconds
        )
        if aside is not None:
            return aside
        self._showing = None
        return Reply({})


def live_world(
    plan: Plan, presenter: Presenter, desk: Desk, status: Callable[[], SessionStatus], station: Station,
    clock: Callable[[], int], safe: Callable[[], None] = lambda: None, notes: Sequence[str] = (),
    suspend: SuspendWatch | None = None,
) -> World:  # fmt: skip
    """Return the live world of a plan, with its procedures; `safe` brings the devices to rest if one of them fails.

    `status` returns the session's status by the events that were recorded so far.
    """
    world = LiveWorld(
        presenter, desk, station, clock, lambda: status().paused, suspend or SuspendWatch(), list(notes),
        lambda: status().first_trial_ns is not None,
        Resumed(() if plan.study.resume is None else plan.study.resume.repeat),
    )  # fmt: skip
    if not plan.study.procedure:
        return world
    from palpate.studies.procedures.advised import advised

    return advised(plan, world, safe)


def _gives_up(event: WorldEvent) -> bool:
    """Return whether the event leaves the request without a reply."""
    return isinstance(event, Fault) or (isinstance(event, Aside) and event.value["do"] in {"repeat", "abort"})


@dataclass
class TwinInRealTime:
    """A simulated device that takes its simulated time in real time; pauses stop it.

    Its replies are marked as simulated.
    """

    name: str
    twin: Twin
    act: Act | None = None
    done: Done | None = None

    def perform(self, request: Present | Sense, window: Pages, desk: Desk, now_ns: Callable[[], int]) -> WorldEvent:
        """Wait as long as the simulated act takes, then return its reply."""
        act = going_on(self.act, request, now_ns)
        if act is not self.act or self.done is None:
            self.act, self.done = act, self.twin(request, act.started_ns)
            desk.tell({self.name: f"simulated, {self.done.seconds:.1f} s"})
        done = self.done
        aside = act.wait(page_of(request), window, desk, now_ns, lambda: act.seconds(now_ns()) >= done.seconds)
        if aside is not None:
            return aside
        self.act = self.done = None
        desk.tell({self.name: "simulated, idle"})
        return Reply({**done.reply.value, "by": "twin"}, done.reply.samples)


@dataclass
class Mounted:
    """A sample that a person mounts, and a device that then presents something with it."""

    presents: Presents
    hand: Presents = field(default_factory=HandMounted)
    mounted: tuple[Request, Reply] | None = None

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: Callable[[], int]) -> WorldEvent:
        """Have the sample mounted, then let the device present; return the values of both and their total seconds."""
        if self.mounted is None or self.mounted[0] is not request:
            by_hand = self.hand.perform(request, window, desk, now_ns)
            if not isinstance(by_hand, Reply):
                return by_hand
            self.mounted = (request, by_hand)
        event = self.presents.perform(request, window, desk, now_ns)
        if not isinstance(event, Reply):
            return event
        by_hand, self.mounted = self.mounted[1], None
        seconds = round(by_hand.value["seconds"] + event.value.get("seconds", 0.0), 3)
        value = {**by_hand.value, **event.value, "by": f"experimenter, {event.value.get('by', 'device')}"}
        return Reply({**value, "seconds": seconds}, event.samples)


class Beside(Protocol):
    """A device that is active while a form is answered."""

    def before(self, request: Ask) -> WorldEvent | None:
        """Become active before a form is answered, also after a resume; return what came instead where it cannot."""

    def after(self, event: WorldEvent) -> WorldEvent:
        """Return the event of the form with what the device did meanwhile, and come to rest."""

    def close(self) -> None:
        """Close everything."""


@dataclass
class Station:
    """All devices of a study: what presents, and what records, by the device name in a request."""

    presents: Presents
    records: Mapping[str, Records] = field(default_factory=dict)
    beside: Beside | None = None
    recorder: BesideRecorder | None = None
    """Records sensors beside everything that is done in trials."""
    on_aside: Callable[[Aside], None] = lambda _aside: None
    """Called with each aside while a form is answered: a pause is silent."""
    switch_side: Callable[[str], None] = lambda _side: None
    """Called with the side that the participant has switched to."""

    feed: Callable[[], None] = lambda: None
    """Called whenever the session waits: without it, a device that sounds beside it falls silent."""

    def perform(self, request: Present | Sense, window: Pages, desk: Desk, now_ns: Callable[[], int]) -> WorldEvent:
        """Hand the request to its device."""
        if isinstance(request, Present):
            return self.presents.perform(request, window, desk, now_ns)
        if request.device not in self.records:
            raise RigError(f"{request.device} is to record, and is missing in the study's needs")
        return self.records[request.device].perform(request, window, desk, now_ns)

    def before(self, request: Ask) -> WorldEvent | None:
        """Make the device active before a form is answered; return None, or what came instead."""
        return None if self.beside is None else self.beside.before(request)

    def after(self, event: WorldEvent) -> WorldEvent:
        """Return the event of a form with what the device did while it was answered."""
        return event if self.beside is None else self.beside.after(event)

    def stop(self) -> None:
        """End all recordings; whoever opened the devices makes them safe."""
        with ExitStack() as ends:
            if self.beside is not None:
                ends.callback(self.beside.close)
            if self.recorder is not None:
                ends.callback(self.recorder.close)
            for device in self.records.values():
                if callable(end := getattr(device, "close", None)):
                    ends.callback(end)


def compose_station(
    study: Study,
    device: Presents | None,
    records: Mapping[str, Records],
    stage: Callable[[], Presents] = HandMounted,
) -> Station:
    """Return a station of the presenter, if any, the recorders by name, and a maker of the presenter of samples."""
    if stage is HandMounted:
        stage = partial(HandMounted, blind=study.blind)
    if device is None:
        return Station(FeltInIntervals(stage()) if study.intervals is not None else stage(), records)
    if "samples" in study.needs:
        return Station(Mounted(device, stage()), records)
    return Station(device, records)
