"""Two of the three worlds: the simulated one, and the recorded one that may go on live."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from palpate.protocols.canonical import difference
from palpate.protocols.events import (
    NS,
    Aside,
    Ask,
    Chunk,
    Confirm,
    Event,
    Fault,
    Log,
    Present,
    Reply,
    Request,
    Rest,
    Sense,
    World,
    WorldEvent,
)
from palpate.protocols.simulated_participants import SimulatedParticipant


@dataclass(frozen=True)
class Done:
    """A simulated act: its reply and how long it took."""

    reply: Reply
    seconds: float


Twin = Callable[[Request, int], Done]
"""A simulated device: performs a request that begins at t_ns."""


@dataclass
class VirtualClock:
    """A clock that only acts move on."""

    t_ns: int = 0

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        self.t_ns += round(seconds * NS)


@dataclass
class Simulated:
    """A simulated participant at simulated devices under a virtual clock."""

    person: SimulatedParticipant
    device: Twin
    clock: VirtualClock

    def now(self) -> int:
        """Return virtual nanoseconds since the session began."""
        return self.clock.t_ns

    def perform(self, request: Request) -> Reply:
        """Answer at once; the clock moves on by what the act would have taken."""
        done = self._act(request)
        self.clock.advance(done.seconds)
        return done.reply

    def _act(self, request: Request) -> Done:
        match request:
            case Present() | Sense():
                return self.device(request, self.clock.t_ns)
            case Ask():
                return Done(*self.person.answer(request))
            case Rest():
                seconds = self.person.rest_s(request)
                return Done(Reply({"seconds": seconds}), seconds)
            case Confirm():
                return Done(Reply({"confirmed": True}), self.person.reading_s)
            case _:
                return Done(Reply({}), self.person.reading_s)


class Divergence(ValueError):
    """What the code does now is not what was recorded."""


BROKEN_OFF = Fault({"device": "session", "what": "interrupted", "message": "the session was interrupted meanwhile"})


class EndOfRecord(Exception):
    """The record ends here and nobody is there to go on."""


@dataclass
class Recorded:
    """A recorded session as World and Log at once: replies and times come from the record.

    Every event that the runner appends must be the recorded one, byte for byte (Divergence otherwise).
    Where the record ends, `world` and `log` take over; without them EndOfRecord is raised.
    """

    events: Sequence[Event]
    world: World | None = None
    log: Log | None = None
    position: int = 0
    recording: Request | None = None

    def now(self) -> int:
        """Return the recorded time of the next event, or the live time."""
        if self.position < len(self.events):
            return self.events[self.position].t_ns
        return self._live()[0].now()

    def perform(self, request: Request) -> WorldEvent:
        """Return the recorded outcome of the request, or perform it live past the end of the record.

        A recording that was cut off by the end of the record becomes a fault, so its trial is repeated.
        """
        if self.position == len(self.events):
            world, broken_off, self.recording = self._live()[0], self.recording is request, None
            return BROKEN_OFF if broken_off else world.perform(request)
        came = self.events[self.position]
        match came.kind:
            case "experimenter":
                return Aside(came.value)
            case "samples":
                self.recording = request
                return Chunk(came.value, came.samples)
            case "fault":
                return Fault(came.value)
            case "reply":
                return Reply(came.value, came.samples)
        raise Divergence(f"{came.place()}: a reply to {request.body()['do']!r} is expected there")

    def append(self, event: Event) -> None:
        """Compare with the record, or write to the live log."""
        if self.position == len(self.events):
            self._live()[1].append(event)
            return
        demand_equal(self.events[self.position], event)
        self.position += 1

    def demand_end(self) -> None:
        """Raise Divergence if the session is over and events are left in the record."""
        if self.position < len(self.events):
            raise Divergence(f"{self.events[self.position].place()}: recorded, but the session is over before it")

    def _live(self) -> tuple[World, Log]:
        if self.world is None or self.log is None:
            raise EndOfRecord
        return self.world, self.log


def demand_equal(recorded: Event, now: Event) -> None:
    """Raise Divergence naming the event, the place in it and both values, unless the two are equal."""
    if recorded == now:
        return
    if recorded.kind != now.kind or recorded.trial != now.trial or recorded.attempt != now.attempt:
        raise Divergence(
            f"{recorded.place()}: the code now gives a {now.kind} of trial {now.trial}, attempt {now.attempt}"
        )
    text = difference(recorded.value, now.value) or f"recorded {recorded.body!r:.80}, now {now.body!r:.80}"
    raise Divergence(f"{recorded.place()}: {text}")
