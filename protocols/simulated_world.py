"""The simulated world: a simulated participant with simulated devices, under a virtual clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from palpate.protocols.events import NS, Ask, Confirm, Present, Reply, Request, Rest, Sense, Show
from palpate.protocols.simulated_participants import SimulatedParticipant


@dataclass(frozen=True)
class Done:
    """A simulated action: its reply and how long it took."""

    reply: Reply
    seconds: float


Twin = Callable[[Request, int], Done]
"""A simulated device: performs a request that begins at t_ns."""


@dataclass
class VirtualClock:
    """A clock that advances only with simulated actions."""

    t_ns: int = 0

    def advance(self, seconds: float) -> None:
        """Advance the clock by some seconds."""
        self.t_ns += round(seconds * NS)


@dataclass
class Simulated:
    """A simulated participant with simulated devices under a virtual clock."""

    person: SimulatedParticipant
    device: Twin
    clock: VirtualClock

    def now(self) -> int:
        """Return the virtual nanoseconds since the session began."""
        return self.clock.t_ns

    def perform(self, request: Request) -> Reply:
        """Reply at once, and advance the clock by the time that the action would have taken."""
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
            case Show():
                return Done(Reply({}), request.seconds)
            case Confirm():
                return Done(Reply({"confirmed": True}), self.person.reading_s)
            case _:
                return Done(Reply({}), self.person.reading_s)
