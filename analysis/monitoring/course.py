"""The course of a session, from its events as they come: trials, answers, pace, and what the experimenter did."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from palpate.protocols.events import NS, Event

AGAIN = "repeated"
DONE = ("answered", "captured")


@dataclass
class Met:
    """What has become of one trial so far."""

    stimulus: str
    block: str
    done: bool = False
    form: str = ""
    items: tuple[str, ...] = ()
    answers: Mapping[str, Any] | None = None
    seconds: float | None = None
    asked_ns: int | None = None
    paused_before_ns: int = 0


@dataclass(frozen=True)
class Aside:
    """What the experimenter did (note, pause, go_on, repeat, abort), or a device's fault; n is its event's number."""

    n: int
    t_ns: int
    trial: int | None
    do: str
    text: str


@dataclass
class Course:
    """Everything the monitor keeps of a session's events; `take` them in their order."""

    header: dict[str, Any] = field(default_factory=dict)
    trials: dict[int, Met] = field(default_factory=dict)
    asides: list[Aside] = field(default_factory=list)
    times_ns: list[int] = field(default_factory=list)
    pace_ns: list[int] = field(default_factory=list)
    ended: str | None = None
    asked: dict[str, Any] | None = None
    since_ns: int | None = None
    paused_ns: int = 0
    pause_ns: int | None = None

    def take(self, event: Event) -> None:
        """Take in the next event."""
        self.times_ns.append(event.t_ns)
        match event.kind:
            case "session_started":
                self.header = event.value
            case "trial_started":
                self._start(event)
            case "request":
                self._ask(event)
            case "reply":
                self._answer(event)
            case "trial_ended":
                self._end(event)
            case "experimenter":
                self._aside(event)
            case "fault":
                self._fault(event)
            case "session_ended":
                self.ended = event.ended_as

    @property
    def done(self) -> int:
        """Trials that are behind the participant."""
        return sum(met.done for met in self.trials.values())

    @property
    def seconds(self) -> float:
        """The session's own clock at the last event: it stands still between sittings."""
        return self.times_ns[-1] / NS

    @property
    def paused(self) -> bool:
        """Whether the experimenter or the participant paused it last."""
        return self.pause_ns is not None and self.ended is None

    def _start(self, event: Event) -> None:
        body, number = event.value, event.trial or 0
        met = self.trials.setdefault(number, Met(body["stimulus"], body["block"]))
        met.asked_ns = None
        if self.since_ns is None:
            self.since_ns = event.t_ns

    def _ask(self, event: Event) -> None:
        body = event.value
        self.asked = body if body["do"] == "ask" else None
        met = self.trials.get(event.trial or 0)
        if self.asked is not None and met is not None and met.asked_ns is None:
            met.asked_ns, met.paused_before_ns = event.t_ns, self.paused_ns

    def _answer(self, event: Event) -> None:
        value, asked = event.value, self.asked
        self.asked = None
        met = self.trials.get(event.trial or 0)
        if met is None or asked is None or "answers" not in value or value.get("go") is not None:
            return
        if met.answers is None and met.asked_ns is not None:
            paused = self.paused_ns - met.paused_before_ns  # A pause is no time for an answer.
            met.seconds = (event.t_ns - met.asked_ns - paused) / NS
        met.form, met.items, met.answers = asked["form"], tuple(asked["items"]), value["answers"]

    def _end(self, event: Event) -> None:
        met, ended_as = self.trials[event.trial or 0], event.value["as"]
        if ended_as == AGAIN:
            _forget(met)
        elif ended_as in DONE:
            met.done = True
            if self.since_ns is not None:
                self.pace_ns.append(event.t_ns - self.since_ns)
        self.since_ns = event.t_ns

    def _fault(self, event: Event) -> None:
        value = event.value
        text = f"{value.get('device')}: {value.get('message')}"
        self.asides.append(Aside(event.seq, event.t_ns, event.trial, "fault", text))

    def _aside(self, event: Event) -> None:
        value = event.value
        do, text = str(value.get("do", "")), str(value.get("text") or "")
        text = text or ("by the participant" if value.get("by") == "participant" else "")
        self.asides.append(Aside(event.seq, event.t_ns, event.trial, do, text))
        if do == "pause" and self.pause_ns is None:
            self.pause_ns = event.t_ns
        elif do == "go_on" and self.pause_ns is not None:
            self.paused_ns, self.pause_ns = self.paused_ns + event.t_ns - self.pause_ns, None
        last = self.trials.get((event.trial or 0) - 1)
        if do == "repeat" and value.get("which") == "last" and last is not None:
            _forget(last)


def _forget(met: Met) -> None:
    """The trial is to be met again: what was answered does not stand."""
    met.done, met.answers, met.seconds = False, None, None
