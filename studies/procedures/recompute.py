"""Ask the procedures of a recorded session again, and compare their choices with those on record."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from palpate.protocols.events import Choose, Reply, Request, WorldEvent
from palpate.protocols.runner import EndOfRecord, Recorded, run
from palpate.studies.procedures.adviser import Adviser, End, Step, adviser_for
from palpate.studies.sessions.record import Record
from palpate.studies.sessions.replay import recompiled


@dataclass(frozen=True)
class Difference:
    """A choice that a procedure now makes in another way; `loss_nats` is what the recorded level tells less than it.

    `recorded` and `now` are levels, or why the track ends. The loss is None where the procedure has no such measure.
    """

    trial: int
    track: str
    recorded: Any
    now: Any
    loss_nats: float | None = None

    def __str__(self) -> str:
        loss = "" if self.loss_nats is None else f", {self.loss_nats:.2g} nats less than now"
        return f"trial {self.trial}, track {self.track}: recorded {self.recorded}{loss}; now {self.now}"


@dataclass
class RecomputingWorld:
    """A recorded session whose choices are made again beside their recorded replies; `count` of them so far."""

    tape: Recorded
    count: int = 0
    differences: list[Difference] = field(default_factory=list)
    _advisers: dict[str, Adviser] = field(default_factory=dict)

    def now(self) -> int:
        """Return the recorded time."""
        return self.tape.now()

    def perform(self, request: Request) -> WorldEvent:
        """Return the recorded outcome of the request."""
        event = self.tape.perform(request)
        if isinstance(request, Choose) and isinstance(event, Reply) and request.trial.track is not None:
            self._compare(request, event.value)
        return event

    def _compare(self, request: Choose, recorded: Mapping[str, Any]) -> None:
        track, past = request.trial.track, request.trial.past
        if track is None:
            return
        adviser = self._advisers.get(track.name) or self._advisers.setdefault(track.name, adviser_for(track))
        advice: Step | End = End(f"{len(past)} trials") if len(past) >= track.trials else adviser.advise(past)
        self.count += 1
        before = recorded.get("why", recorded.get("level"))
        ends = isinstance(advice, End)
        now = advice.why if isinstance(advice, End) else track.levels[advice.index]
        if ends == ("stop" in recorded) and (isinstance(advice, End) or advice.index == recorded["index"]):
            return
        loss = None
        if not ends and "index" in recorded and (measure := getattr(adviser, "loss", None)):
            loss = measure(past, recorded["index"])
        self.differences.append(Difference(request.trial.number, track.name, before, now, loss))


def recompute(record: Record) -> tuple[int, list[Difference]]:
    """Return how many choices of a session were made again, and those that differ. Raises as a replay does."""
    plan = recompiled(record)
    tape = Recorded(record.events)
    world = RecomputingWorld(tape)
    with suppress(EndOfRecord):
        run(plan, world, tape, record.header)
    return world.count, world.differences


def describe_differences(differences: list[Difference], most: int = 8) -> Iterator[str]:
    """Yield a line for each of the first differences, and how many there are beside."""
    yield from map(str, differences[:most])
    if len(differences) > most:
        yield f"and {len(differences) - most} more"
