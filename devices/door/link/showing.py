"""A presentation on the door simulator, from the check of its limits until the arm is at rest again."""

from __future__ import annotations

import gc
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from palpate.devices.acts import Act, UnconfirmedFault, page_of
from palpate.devices.desk import Desk, Pages, Prompt
from palpate.devices.device import DeviceFault
from palpate.devices.door.link import dialogue
from palpate.devices.door.link.codes import State
from palpate.devices.door.link.limits import ProfileRefused
from palpate.devices.door.link.link import Link
from palpate.devices.door.link.messages import Identity, Profile
from palpate.devices.door.link.telemetry import Opening, trouble
from palpate.protocols.events import Aside, Chunk, Fault, Present, Reply

WAITING = "changing_sample"

Steps = Generator[Aside | Chunk, None, None]


class Recorded(Protocol):
    """The recorder of the telemetry: palpate.devices.streams.recording.Recording."""

    def start(self) -> None:
        """Begin recording."""

    def due(self) -> bool:
        """Return whether there are samples to take."""

    def take(self) -> Chunk:
        """Return the samples since the last call."""

    def fault(self) -> DeviceFault | None:
        """Return the fault, or None."""

    def stop(self) -> Mapping[str, Any]:
        """End recording, and return a summary of each stream."""


class Changes(Protocol):
    """The source of changes to the profile while it is felt: palpate.devices.door.live.LiveDoor."""

    def newer(self, t_ns: int) -> Sequence[float] | None:
        """Return the 621 new forces to be felt from now on, in newtons; None if nothing has changed."""

    def took(self, t_ns: int, why: str) -> None:
        """Record that the door has accepted the last forces, or `why` it has not."""

    def rests(self) -> None:
        """Record that the door is stopped for a pause."""

    def done(self) -> bool | None:
        """Return whether the participant is done; None if one opening and return of the door ends it."""


class Door(Protocol):
    """The interface of a door for a presentation."""

    name: str
    unconfirmed: UnconfirmedFault
    changes: Changes | None

    @property
    def by(self) -> str:
        """Return the name of the door that presents, for the reply."""

    @property
    def time_limit_s(self) -> float:
        """Return the longest time of a presentation, in seconds."""

    def profile(self, request: Present) -> Profile:
        """Return the profile to be played. Raises DeviceFault (limit)."""

    def change_for(self, force_N: Sequence[float], end_deg: float) -> Profile:
        """Return the torques for a change, with the stop in its place. Raises ProfileRefused."""

    def greeted(self) -> tuple[Link, Identity]:
        """Return the link, reconnected if it was lost, and the door's identity. Raises DeviceFault."""

    def recorded(self, now_ns: Callable[[], int]) -> Recorded:
        """Return a recorder of the telemetry."""

    def safe(self) -> None:
        """Bring it to rest."""


@dataclass
class Showing:
    """A presentation in progress. Closing it at any point leaves the door safe."""

    door: Door
    request: Present
    window: Pages
    desk: Desk
    now_ns: Callable[[], int]
    rests: bool = False

    def steps(self) -> Generator[Aside | Chunk | Reply | Fault, None, None]:
        """Yield the events of the presentation one at a time; the last one is a Reply or a Fault."""
        recorded: list[Recorded] = []
        try:
            try:
                reply = yield from self._shown(recorded)
            except DeviceFault as fault:
                self._at_rest("went safe")
                yield from _ended(recorded)
                reply = self.door.unconfirmed.record(fault)
            yield reply
        finally:
            try:
                self._at_rest("at rest")
            finally:
                for recording in recorded:
                    recording.stop()

    def _shown(self, recorded: list[Recorded]) -> Generator[Aside | Chunk, None, Reply | Fault]:
        profile = self.door.profile(self.request)
        link = yield from self._ready()
        dialogue.upload(link, profile)
        dialogue.verify(link, profile)
        act, opening = Act(self.request, self.now_ns()), Opening(profile.end_deg)
        link.from_now()
        recorded.append(self.door.recorded(self.now_ns))
        recorded[0].start()
        felt = Felt(self, act, link, profile, opening, recorded[0])
        yield from felt.steps()
        self._at_rest("at rest")
        yield from _ended(recorded)
        return Reply(felt.reply_value(recorded[0].stop()))

    def _ready(self) -> Generator[Aside, None, Link]:
        """Return the link to a door without a fault, after a person has repaired and confirmed any problem."""
        unconfirmed = self.door.unconfirmed
        while True:
            confirmed = unconfirmed.message
            while (aside := self.door.unconfirmed.demand_confirmation(WAITING, self.window, self.desk)) is not None:
                yield aside
            link, identity = self.door.greeted()
            if not identity.fault:
                return link
            latched = str(dialogue.latched_fault(self.door.name, identity.fault))
            if not confirmed.startswith(latched):
                unconfirmed.message = latched
            elif dialogue.clear(link, identity.fault):
                return link
            else:
                unconfirmed.message = f"{latched}, and its cause remains"

    def _at_rest(self, state: str) -> None:
        """Switch the motor off and the brake on, once."""
        if not self.rests:
            self.rests = True
            self.door.safe()
            self.desk.tell({self.door.name: state})


@dataclass
class Felt:
    """The part of a presentation in which the door is felt: played, watched, stopped for pauses and played again."""

    showing: Showing
    act: Act
    link: Link
    profile: Profile
    opening: Opening
    recorded: Recorded
    ended: str = ""

    def steps(self) -> Steps:
        """Yield the events until the presentation is over. Raises DeviceFault."""
        showing, link = self.showing, self.link
        link.listen = self.opening.see
        gc.freeze()  # A collection of all that is loaded halts every thread, the heart too, for longer than is allowed.
        try:
            while not self.ended:
                self._play()
                aside = self.act.wait(
                    page_of(self.act.request), showing.window, showing.desk, showing.now_ns, self._something
                )
                if aside is not None:
                    self._handle_aside(aside)
                    yield aside
                elif (fault := self._fault()) is not None:
                    raise fault
                elif self.recorded.due():
                    yield self.recorded.take()
        finally:
            gc.unfreeze()
            link.listen = None
            showing.desk.demand(None)

    def reply_value(self, streams: Mapping[str, Any]) -> dict[str, Any]:
        """Return the reply's value."""
        return {
            "presented": True,
            "by": self.showing.door.by,
            "seconds": self.act.seconds(self.showing.now_ns()),
            "profile": f"{self.profile.crc:08x}",
            "opened_deg": round(self.opening.most_deg, 2),
            "end_deg": round(self.profile.end_deg, 1),
            "ended": self.ended,
            "streams": dict(streams),
        }

    def _play(self) -> None:
        if self.act.paused_at_ns is None and not self._playing:
            if (fault := self._fault()) is not None:  # while it paused
                raise fault
            dialogue.play(self.link, self.profile)
            self._playing = True
            stimulus = self.showing.request.trial.stimulus.id
            text = f"{stimulus} is on the door. Confirm to end it before it is opened to its end and brought back"
            self.showing.desk.demand(Prompt(text))
            self._stays = ""
            self.showing.desk.tell({self.showing.door.name: "playing"})

    def _something(self) -> bool:
        """Return whether anything has arrived, and allow further heartbeats, because the main thread is alive."""
        self.link.keep_alive()
        self._change()
        self.ended = self._over()
        return bool(self.ended) or self.recorded.due() or self._fault() is not None

    def _change(self) -> None:
        """Send the door a change, if there is one. Raises DeviceFault if the line is lost."""
        door, now_ns = self.showing.door, self.showing.now_ns
        if door.changes is None or not self._playing or (force_N := door.changes.newer(now_ns())) is None:
            return
        try:
            profile = door.change_for(force_N, self.profile.end_deg)
        except ProfileRefused as refused:
            self._took(str(refused))
            return
        why = "" if profile.crc == self.profile.crc else dialogue.change(self.link, profile)
        if not why:
            self.profile = profile
        self._took(why)

    def _took(self, why: str) -> None:
        """Pass on the outcome of a change; show it to the experimenter if it differs from the last one."""
        showing = self.showing
        if showing.door.changes is not None:
            showing.door.changes.took(showing.now_ns(), why)
        if why != self._stays:
            self._stays = why
            showing.desk.tell({showing.door.name: f"playing, does not change: {why}" if why else "playing"})

    def _over(self) -> str:
        changes = self.showing.door.changes
        done = None if changes is None else changes.done()
        if done:
            return "participant"
        if done is None and self.opening.back:
            return "brought_back"
        if self.showing.desk.answer() is not None:
            return "experimenter"
        late = self.act.seconds(self.showing.now_ns()) >= self.showing.door.time_limit_s
        return "time_limit" if late else ""

    def _fault(self) -> DeviceFault | None:
        fault = trouble(self.link, State.playing if self._playing else None) or self.recorded.fault()
        if fault is not None:
            self.ended = ""
        return fault

    def _handle_aside(self, aside: Aside) -> None:
        if aside.value.get("do") == "pause":
            dialogue.rest(self.link)
            self._playing = False
            if self.showing.door.changes is not None:
                self.showing.door.changes.rests()
            self.showing.desk.tell({self.showing.door.name: "stopped for the pause"})
        elif aside.value.get("do") in {"repeat", "abort"}:
            self._playing = False
            self.showing.door.safe()

    _playing: bool = False
    _stays: str = ""


def _ended(recorded: list[Recorded]) -> Steps:
    """Yield the rest of the telemetry."""
    for recording in recorded:
        recording.stop()
        while recording.due():
            yield recording.take()
