"""What a session is made of: numbered events, appended one at a time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

from palpate.protocols.canonical import parse
from palpate.protocols.requests import Request, Samples, WorldEvent

NS = 1_000_000_000
"""Nanoseconds in a second."""
ANSWERED, CAPTURED, LEFT, REPEATED, FAULTED = "answered", "captured", "left", "repeated", "faulted"
"""How an attempt at a trial ends: with an answer, with a recording, because the participant went back, and two ways
after which the trial is repeated: the experimenter had it so, or a device failed."""


@dataclass(frozen=True)
class Event:
    """One thing that happened; `body` is canonical JSON, `trial` and `attempt` are set inside a trial."""

    seq: int
    t_ns: int
    kind: str
    body: bytes
    trial: int | None = None
    attempt: int | None = None
    samples: tuple[Samples, ...] = ()

    @cached_property
    def value(self) -> Any:
        """The body as data, parsed once: whoever reads it leaves it as it is."""
        return parse(self.body)

    @property
    def ended_as(self) -> str | None:
        """How the event ends the session: complete, declined, ineligible, aborted; None where it does not."""
        return str(self.value.get("as", "complete")) if self.kind == "session_ended" else None

    def place(self) -> str:
        """Where the event stands, for messages."""
        within = f", trial {self.trial}" if self.trial is not None else ""
        return f"event {self.seq} ({self.kind}{within})"


class Log(Protocol):
    """Where events go; an event is durable when `append` returns."""

    def append(self, event: Event) -> None:
        """Write the event."""


class World(Protocol):
    """The one seam: all that the program does not decide enters here and nowhere else."""

    def now(self) -> int:
        """Nanoseconds since the session began; never runs backwards."""

    def perform(self, request: Request) -> WorldEvent:
        """Perform the request and return its Reply when it is done.

        What comes back before is put on record, and the same request is performed on: an Aside when the experimenter
        did something meanwhile, a Chunk of what is being recorded. A Fault ends the request: its trial is repeated.
        """
