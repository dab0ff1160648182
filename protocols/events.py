"""Requests and replies between a task and the world, and the events that they are recorded as.

A task makes requests; the world returns a reply, or something to record before it. A session is a sequence of numbered
events, appended one at a time.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

from palpate.protocols.canonical import canonical, encoded, parse
from palpate.protocols.forms import AnchorForm, Form, Sliders
from palpate.protocols.trial import Trial

NS = 1_000_000_000
"""Nanoseconds in a second."""
ANSWERED, CAPTURED, LEFT, REPEATED, FAULTED = "answered", "captured", "left", "repeated", "faulted"
STOPPED = "stopped"
"""How an attempt at a trial ends: with an answer, with a recording, because the participant went back, or in two ways
after which the trial is repeated: on the experimenter's request, or after a device failed. `stopped`: its track needs
no more trials.
"""


class ReplyError(ValueError):
    """A reply that does not answer its request: an error of the presenter, never of the participant."""


@dataclass(frozen=True)
class Part:
    """An interval of a trial: the number `interval` of `of`, with a stimulus at a `level`, or `blank`.

    It lasts `seconds` if the study says so, at least `gap_s` after the interval before. `sides`: all intervals are
    presented at once, and these are the stimuli in the order of the sides; the stimulus is at `interval`.
    """

    interval: int
    of: int
    level: float | tuple[float, ...] | None = None
    blank: bool = False
    seconds: float | None = None
    gap_s: float = 0.0
    sides: tuple[str, ...] = ()

    def body(self) -> dict[str, Any]:
        """Return the part as it is stored with its request."""
        level = {} if self.level is None else {"level": self.level}
        sides = {"sides": self.sides} if self.sides else {}
        return {"interval": self.interval, **level, **({"blank": True} if self.blank else {}), **sides}


@dataclass(frozen=True)
class Present:
    """A request to let the participant feel the trial's stimulus, or the one generated for `wish` ({attribute:
    value}).

    In trials with intervals `part` is the one to present; the level is in the stimulus' columns.
    """

    trial: Trial
    wish: Mapping[str, float] | None = None
    part: Part | None = None

    @property
    def live_form(self) -> Sliders | None:
        """Return the form that the stimulus follows while it is felt; None if the stimulus does not change."""
        form = self.trial.form
        return form if isinstance(form, Sliders) and form.live and self.wish is not None else None

    def body(self) -> dict[str, Any]:
        """Return the request as it is stored in the ledger."""
        wished = {} if self.wish is None else {"wish": dict(self.wish)}
        live = {} if self.live_form is None else {"live": True}
        anchor = {"anchor": self.trial.form.number} if isinstance(self.trial.form, AnchorForm) else {}
        part = {} if self.part is None else self.part.body()
        return {"do": "present", "stimulus": self.trial.stimulus.id, **wished, **live, **anchor, **part}


@dataclass(frozen=True)
class Ask:
    """A request to show a form to the participant, who answers it or, where the trial allows it, goes back.

    Outside a trial `trial` is None. `former` are the answers that the form starts from; else those of an earlier
    attempt.
    """

    form: Form
    trial: Trial | None = None
    former: Mapping[str, Any] | None = None

    @property
    def may_go_back(self) -> bool:
        """Return whether the participant may go back to the trial before."""
        return self.trial is not None and self.trial.may_go_back

    @property
    def previous(self) -> Mapping[str, Any] | None:
        """Return the answers that the form starts from."""
        return self.former if self.former is not None or self.trial is None else self.trial.previous

    def demand_answer(self, reply: Reply) -> None:
        """Raise ReplyError unless the reply answers the form, or goes back where that is allowed."""
        inside = self.trial is not None and not isinstance(self.form, AnchorForm)
        where = f"trial {self.trial.number}" if inside and self.trial is not None else self.form.name
        go = reply.value.get("go")
        if go == "back":
            if not self.may_go_back:
                raise ReplyError(f"{where}: the reply goes back, which this trial does not allow")
            return
        if go is not None and not (go == "try" and getattr(self.form, "tries", False)):
            raise ReplyError(f"{where}: the reply goes {go!r}, which this form does not know")
        answers = reply.value.get("answers")
        if problem := self.form.problem(answers):
            raise ReplyError(f"{where}: {problem}")
        unfinished: Callable[[Any], str | None] = getattr(self.form, "unfinished", lambda _answers: None)
        if go is None and (problem := unfinished(answers)):
            raise ReplyError(f"{where}: the reply goes on, and {problem}")

    def body(self) -> dict[str, Any]:
        """Return the request as it is stored in the ledger."""
        return {
            "do": "ask",
            "form": self.form.name,
            "items": self.form.items(),
            "back": self.may_go_back,
            "previous": self.previous,
            **({"anchor": self.form.describe()} if isinstance(self.form, AnchorForm) else {}),
            **({"context": dict(context)} if (context := getattr(self.form, "context", None)) else {}),
        }


@dataclass(frozen=True)
class Choose:
    """A request to choose the level of a trial from what was answered in its track.

    The reply holds `index` and `level` of the grid, or `stop`: true and `why`; `estimate` may say what is known so far.
    """

    trial: Trial

    def demand_answer(self, reply: Reply) -> None:
        """Raise ReplyError unless the reply is a level of the track's grid, or ends the track."""
        where, track, value = f"trial {self.trial.number}", self.trial.track, reply.value
        if track is None:
            raise ReplyError(f"{where}: a level was chosen, and the trial has no track")
        if "stop" in value:
            if value["stop"] is not True or not isinstance(value.get("why"), str) or "index" in value:
                raise ReplyError(f"{where}: stop: true and why: TEXT are expected, found {dict(value)!r:.200}")
            return
        index = value.get("index")
        if type(index) is not int or not 0 <= index < len(track.levels):
            last = len(track.levels) - 1
            raise ReplyError(f"{where}: index {index!r:.60} is not on the grid of {track.name}, which has 0 to {last}")
        expected = track.levels[index]
        level = value.get("level")
        if (tuple(level) if isinstance(level, list) else level) != expected:
            raise ReplyError(f"{where}: level {level!r:.60} is not that of index {index} of {track.name}, {expected}")

    def body(self) -> dict[str, Any]:
        """Return the request as it is stored in the ledger."""
        name = None if self.trial.track is None else self.trial.track.name
        return {"do": "choose", "track": name, "past": len(self.trial.past)}


@dataclass(frozen=True)
class Show:
    """A request to show a page for some seconds, by its key in the screens' texts: whether an answer was right."""

    page: str
    seconds: float
    trial: Trial

    def body(self) -> dict[str, Any]:
        """Return the request as it is stored in the ledger."""
        return {"do": "show", "page": self.page, "seconds": self.seconds}


@dataclass(frozen=True)
class Sense:
    """A request to record a device's channels for some seconds."""

    device: str
    seconds: float
    trial: Trial

    def body(self) -> dict[str, Any]:
        """Return the request as it is stored in the ledger."""
        return {"do": "sense", "device": self.device, "seconds": self.seconds}


@dataclass(frozen=True)
class Rest:
    """A request for a break, after `done` of `total` counted trials."""

    done: int
    total: int

    def body(self) -> dict[str, Any]:
        """Return the request as it is stored in the ledger."""
        return {"do": "rest", "done": self.done, "total": self.total}


@dataclass(frozen=True)
class Instruct:
    """A request to show a page of text, by its name in the study."""

    page: str

    def body(self) -> dict[str, Any]:
        """Return the request as it is stored in the ledger."""
        return {"do": "instruct", "page": self.page}


@dataclass(frozen=True)
class Confirm:
    """A request for the experimenter to confirm something before the session goes on.

    `calibration`: the length of a line on the screen. `setup N`: the N-th step of the setup, which `text` describes.
    """

    what: str
    text: str | None = None

    def body(self) -> dict[str, Any]:
        """Return the request as it is stored in the ledger."""
        return {"do": "confirm", "what": self.what} | ({} if self.text is None else {"text": self.text})


Request = Present | Ask | Sense | Rest | Instruct | Confirm | Choose | Show


@dataclass(frozen=True)
class Samples:
    """A block of samples of one stream: `data` holds rows of channels, little-endian float32.

    `units` has the unit of each channel. Where events were recorded as they happened, rate_hz is 0 and a channel holds
    the time. `first` is the number of the first sample in its stream; `clock` names the clock that timed the samples.
    """

    stream: str
    channels: tuple[str, ...]
    units: tuple[str, ...]
    rate_hz: float
    t0_ns: int
    data: bytes
    first: int = 0
    clock: str = "host"

    @property
    def count(self) -> int:
        """Return the number of samples per channel."""
        return len(self.data) // (4 * len(self.channels))

    def sha256(self) -> bytes:
        """Return the SHA-256 of the bytes."""
        return hashlib.sha256(self.data).digest()

    def form(self) -> bytes:
        """Return the meaning of the bytes as canonical JSON; with `first` and `clock` if they are not 0 and the
        host's.
        """
        form = {
            "channels": self.channels,
            "units": self.units,
            "rate_hz": float(self.rate_hz),
            "t0_ns": self.t0_ns,
            "dtype": "<f4",
            "count": self.count,
        }
        if self.first:
            form["first"] = self.first
        if self.clock != "host":
            form["clock"] = self.clock
        return canonical(form)


@dataclass(frozen=True)
class Reply:
    """The world's reply to a request: JSON data, and the samples recorded meanwhile."""

    value: Mapping[str, Any]
    samples: tuple[Samples, ...] = ()


@dataclass(frozen=True)
class Aside:
    """An action of the experimenter while a request is being performed; the request goes on.

    {do: note, text}, {do: pause}, {do: go_on}, {do: repeat, which: this|last|block}, {do: abort, text}. A participant
    who rests pauses the session too: {do: pause or go_on, by: participant}. {do: instructed, page}: a page was shown
    again before the session went on.
    """

    value: Mapping[str, Any]


@dataclass(frozen=True)
class Chunk:
    """Samples recorded so far while a request is being performed; they are written at once, and the request goes on.

    `value` holds, by stream, what the samples do not: {streams: {NAME: {first, lost, why, arrived: [[n, t_ns]]}}}.
    """

    value: Mapping[str, Any]
    samples: tuple[Samples, ...]


@dataclass(frozen=True)
class Fault:
    """A failure of a device, which has been made safe, while a request was being performed: {device, what, message}.

    The trial is marked and repeated.
    """

    value: Mapping[str, Any]


WorldEvent = Reply | Aside | Chunk | Fault
"""What performing a request returns: its reply, or something to record before the request is continued."""


@dataclass(frozen=True)
class Event:
    """A recorded event; `body` is canonical JSON, `trial` and `attempt` are set inside a trial."""

    seq: int
    t_ns: int
    kind: str
    body: bytes
    trial: int | None = None
    attempt: int | None = None
    samples: tuple[Samples, ...] = ()

    @cached_property
    def value(self) -> Any:
        """Return the body as data. It is parsed once and shared: callers must not change it."""
        return parse(self.body)

    @property
    def ended_as(self) -> str | None:
        """Return how the event ends the session: complete, declined, ineligible, aborted; None if it does not."""
        return str(self.value.get("as", "complete")) if self.kind == "session_ended" else None

    def place(self) -> str:
        """Return where the event is in the session, for messages."""
        within = f", trial {self.trial}" if self.trial is not None else ""
        return f"event {self.seq} ({self.kind}{within})"


def event_hash(previous: str, happened: Event) -> str:
    """Return the hash of an event in the chain, over the hash before, all fields of the event, and its samples."""
    link = hashlib.sha256(previous.encode())
    link.update(encoded([happened.seq, happened.t_ns, happened.kind, happened.trial, happened.attempt]))
    link.update(b"\n" + happened.body)
    for block in happened.samples:
        link.update(canonical([block.stream, block.form().decode()]))
        link.update(block.sha256())
    return link.hexdigest()


class Log(Protocol):
    """Storage for events; an event is durable when `append` returns."""

    def append(self, event: Event) -> None:
        """Write the event."""


class World(Protocol):
    """The world outside the program: time, the participant and the devices enter here and nowhere else."""

    def now(self) -> int:
        """Return nanoseconds since the session began; the value never decreases."""

    def perform(self, request: Request) -> WorldEvent:
        """Perform the request and return its Reply when it is done.

        Anything else that is returned is recorded, and the same request is continued: an Aside for an action of the
        experimenter, a Chunk of samples. A Fault ends the request: its trial is repeated.
        """
