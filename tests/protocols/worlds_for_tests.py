"""A world that answers from a script, and a log in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from palpate.protocols.events import Ask, Event, Reply, Request
from palpate.protocols.plan import Plan
from palpate.protocols.runner import Recorded, run


@dataclass
class Scripted:
    """Answers every Ask with the next scripted reply, everything else with {}; time moves by 1 ms a look."""

    replies: Iterator[Mapping[str, Any]]
    requests: list[Request] = field(default_factory=list)
    t_ns: int = 0

    def now(self) -> int:
        self.t_ns += 1_000_000
        return self.t_ns

    def perform(self, request: Request) -> Reply:
        self.requests.append(request)
        return Reply(next(self.replies) if isinstance(request, Ask) else {})


class Interrupting:
    """Rates everything; before it answers the n-th request it gives what is scripted for that, as n3=[Aside(...)]."""

    def __init__(self, **script):
        self.script = {int(key[1:]): list(values) for key, values in script.items()}
        self.requests, self.t_ns = [], 0

    def now(self):
        self.t_ns += 1
        return self.t_ns

    def perform(self, request):
        if not self.requests or self.requests[-1] is not request:
            self.requests.append(request)
        if waiting := self.script.get(len(self.requests)):
            return waiting.pop(0)
        return Reply(rated(1, 2) if isinstance(request, Ask) else {})


@dataclass
class MemoryLog:
    """A log in memory that checks what a ledger would: numbers without gaps, time that does not run backwards."""

    events: list[Event] = field(default_factory=list)
    on_append: Callable[[Event], None] = lambda _event: None

    def append(self, event: Event) -> None:
        assert event.seq == len(self.events)
        assert not self.events or event.t_ns >= self.events[-1].t_ns
        self.on_append(event)
        self.events.append(event)

    def words(self) -> list[str]:
        """Return the session as short words, for comparing at a glance."""
        return [_word(event) for event in self.events]


def _word(event: Event) -> str:
    value = event.value
    match event.kind:
        case "trial_started":
            return f"{value['stimulus']}{event.attempt}("
        case "trial_ended":
            return f"){value['as']}"
        case "request":
            return value["do"] + ("+" if value.get("previous") else "")
        case "reply":
            return "back" if value.get("go") else "answer" if "answers" in value else "."
        case _:
            return event.kind


def replay_record(plan: Plan, events: list[Event]) -> None:
    """Replay a record to its end without a world."""
    tape = Recorded(events)
    run(plan, tape, tape, {})
    tape.demand_end()


def rated(*values: float) -> dict[str, Any]:
    """A reply with answers to the toy study's two attributes."""
    return {"answers": dict(zip(("Soft", "Cold"), values, strict=True))}


BACK = {"go": "back"}
