"""The shape that the events of a ledger must have, so that later readers can rely on it.

A chain of hashes shows that nobody changed a ledger; it does not show that its events are meaningful. `EventShapes`
checks the bodies one after another, in all formats: required keys and the types of their values, the form's answers
against the open request, and events of a trial against the trial that has started. Unknown keys are allowed. Whether an
answer fits the study is checked by a replay.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from palpate.protocols.canonical import encoded, parse
from palpate.protocols.events import Event, Samples
from palpate.protocols.forms import has_any_answers, table_of
from palpate.protocols.session_state import SessionState

DEEPEST = 100
"""Greatest depth of nested lists and objects."""
_LARGEST = 1.7976931348623157e308


class ShapeError(ValueError):
    """An event whose body is not valid for its kind; the message says what was expected and found."""


@dataclass(frozen=True)
class Kind:
    """A type of JSON value: how to recognise it, and its name in messages."""

    matches: Callable[[Any], bool]
    name: str

    def or_null(self) -> Kind:
        """Return the kind of these values or null."""
        return Kind(lambda value: value is None or self.matches(value), f"{self.name} or null")

    def list(self) -> Kind:
        """Return the kind of lists of such values."""
        return Kind(lambda value: type(value) is list and all(map(self.matches, value)), f"a list, each {self.name},")

    def object(self) -> Kind:
        """Return the kind of objects of such values."""
        return Kind(
            lambda value: type(value) is dict and all(map(self.matches, value.values())),
            f"an object, each value {self.name},",
        )


def row(*kinds: Kind) -> Kind:
    """Return the kind of lists that begin with these values."""

    def matches(value: Any) -> bool:
        if type(value) is not list or len(value) < len(kinds):
            return False
        return all(kind.matches(cell) for kind, cell in zip(kinds, value, strict=False))

    return Kind(matches, f"a list of {', '.join(kind.name for kind in kinds)}")


def fields(required: Mapping[str, Kind], optional: Mapping[str, Kind] | None = None) -> Kind:
    """Return the kind of objects with these keys."""

    def matches(value: Any) -> bool:
        try:
            demand_fields(value, required, optional or {})
        except ShapeError:
            return False
        return True

    return Kind(matches, f"an object with {', '.join(required)}" if required else "an object")


TEXT = Kind(lambda value: type(value) is str, "a text")
FLAG = Kind(lambda value: type(value) is bool, "true or false")
WHOLE = Kind(lambda value: type(value) is int and -(2**63) <= value < 2**63, "a whole number")
NUMBER = Kind(lambda value: type(value) in (int, float) and -_LARGEST <= value <= _LARGEST, "a number")
ANY = Kind(lambda _value: True, "a value")
OBJECT = Kind(lambda value: type(value) is dict, "an object")
LEVEL = Kind(lambda value: NUMBER.matches(value) or NUMBER.list().matches(value), "a number or a list of numbers")

_QUESTION = fields(
    {"name": TEXT, "text": TEXT, "kind": TEXT},
    {"levels": row(TEXT, TEXT).list(), "unit": TEXT.or_null(), "low": NUMBER.or_null(), "high": NUMBER.or_null()},
)
_STREAM = fields(
    {},
    {
        "arrived": row(WHOLE, WHOLE).list(), "device_s": NUMBER.list(), "calibration": ANY, "first": WHOLE,
        "count": WHOLE, "lost": WHOLE, "why": TEXT,
    },
)  # fmt: skip
_CHUNKED = fields({}, {"gaps": row(WHOLE, WHOLE, TEXT).list()})
_RECORDED = fields(
    {},
    {
        "samples": WHOLE, "lost": WHOLE, "gaps": WHOLE, "rate_hz": NUMBER.or_null(), "drift_ppm": NUMBER.or_null(),
    },
)  # fmt: skip

HEADER: dict[str, Kind] = {
    "study": fields(
        {"study": TEXT},
        {"title": TEXT.or_null(), "stimuli": fields({"id": TEXT}, {"columns": TEXT.object()}).list()},
    ),
    "participant": TEXT, "group": TEXT.or_null(), "row": WHOLE, "session": WHOLE, "seed": WHOLE, "plan": TEXT,
    "trials": WHOLE, "rig": fields({"kind": TEXT}, {"twins": TEXT.list(), "settings": OBJECT.or_null()}),
    "calibration": OBJECT.or_null(), "environment": fields({"palpate": TEXT}),
}  # fmt: skip
_BODIES: dict[str, tuple[dict[str, Kind], dict[str, Kind]]] = {
    "session_started": (
        HEADER,
        {
            "lab_forms": fields({"consent": TEXT, "questions": _QUESTION.list()}), "accepted_change": OBJECT,
            "extensions": fields({"version": TEXT, "sha256": TEXT}, {"package": TEXT}).object(),
        },
    ),
    "trial_started": ({"stimulus": TEXT, "block": TEXT}, {}),
    "request": ({"do": TEXT}, {}),
    "reply": (
        {},
        {
            "go": TEXT, "at_s": NUMBER.or_null().object(), "streams": _RECORDED.object(),
            "switches": fields({"to": TEXT, "at_s": NUMBER}).list(), "pictures": OBJECT.list(),
        },
    ),
    "experimenter": ({"do": TEXT}, {"which": TEXT, "text": TEXT.or_null()}),
    "samples": ({"streams": _CHUNKED.object()}, {}),
    "fault": ({"device": TEXT, "what": TEXT, "message": TEXT}, {}),
    "trial_ended": ({"as": TEXT}, {}),
    "session_ended": ({"trials": WHOLE}, {"as": TEXT}),
}  # fmt: skip
"""For each kind of event, its required keys and its optional keys, with the kinds of their values."""
_REQUESTS: dict[str, dict[str, Kind]] = {
    "present": {"stimulus": TEXT},
    "ask": {"form": TEXT, "items": TEXT.list(), "back": FLAG, "previous": OBJECT.or_null()},
    "sense": {"device": TEXT, "seconds": NUMBER},
    "rest": {"done": WHOLE, "total": WHOLE},
    "instruct": {"page": TEXT},
    "confirm": {"what": TEXT},
    "choose": {"track": TEXT, "past": WHOLE},
    "show": {"page": TEXT, "seconds": NUMBER},
}
_WORDS = TEXT.list().object()
_ANCHOR = fields(
    {"number": WHOLE, "of": WHOLE, "block": TEXT, "id": TEXT, "label": TEXT}, {"attribute": TEXT, "value": NUMBER}
)


@dataclass
class EventShapes:
    """A checker of a session's events in their order; `state` is the session's state after the events so far."""

    state: SessionState = field(default_factory=SessionState)

    def take(self, event: Event) -> None:
        """Check the next event and its body, and apply it to the state. Raises ShapeError for an invalid event."""
        if event.kind not in _BODIES:
            raise ShapeError(f"an event of the kind {event.kind!r:.40} does not exist")
        self._demand_place(event)
        body = _demand_canonical(event.body, lambda: event.value)
        demand_fields(body, *_BODIES[event.kind])
        if event.kind == "request":
            demand_fields(body, _REQUESTS.get(body["do"], {}), {"wish": NUMBER.object(), "context": OBJECT})
            if table_of(body.get("form")) == "anchors":
                demand_fields(body, {"anchor": _ANCHOR}, {})
        elif event.kind == "reply":
            self._demand_reply(event, body)
        if "streams" in body:
            demand_fields(body["streams"], {}, dict.fromkeys(body["streams"], _STREAM))
        self.state.apply(event)

    def _demand_place(self, event: Event) -> None:
        """Raise ShapeError unless the event's own columns are valid and an event of its kind can occur here."""
        for name in ("trial", "attempt"):
            if (value := getattr(event, name)) is not None and not WHOLE.matches(value):
                raise ShapeError(f"{name}: a whole number is expected, found {_short(value)}")
        if not WHOLE.matches(event.t_ns):
            raise ShapeError(f"t_ns: a whole number is expected, found {_short(event.t_ns)}")
        if (event.kind == "session_started") != (event.seq == 0):
            raise ShapeError("session_started is expected as the first event, and nowhere else")
        here = None if event.trial is None and event.attempt is None else (event.trial, event.attempt)
        current = self.state.current
        under_way = None if current is None else (current.trial, current.number)
        if event.kind == "trial_started":
            if here is None or None in here:
                raise ShapeError("the numbers of the trial and of the attempt are expected, and one is missing")
        elif event.kind != "session_ended" and here != under_way:
            raise ShapeError(f"it belongs to {_place(here)}, and {_place(under_way)} is under way")
        elif event.kind == "trial_ended" and here is None:
            raise ShapeError("no trial is under way that could end")
        if event.kind in {"reply", "samples"} and self.state.request is None:
            raise ShapeError("no request is open that it could belong to")

    def _demand_reply(self, event: Event, body: Mapping[str, Any]) -> None:
        """Raise ShapeError unless the answers to a form have the shape that readers rely on.

        A form that was left has no answers.
        """
        request = {} if self.state.request is None else self.state.request.value
        if request["do"] != "ask":
            if request["do"] == "choose":
                _demand_choice(body)
            if "go" in body:
                raise ShapeError(f"go: only the reply to a form has this key, and {request['do']!r:.40} was requested")
            return
        if "answers" not in body:
            if body.get("go") != "back":
                raise ShapeError("answers is missing: an object is expected")
            return
        table = table_of(request["form"])
        if table == "words":
            demand_fields(body, {"answers": _WORDS}, {})
            return
        kind = ANY if event.trial is None or has_any_answers(request["form"]) else NUMBER
        kind = WHOLE if table == "anchors" else kind
        demand_fields(body, {"answers": OBJECT}, {})
        try:
            demand_fields(body["answers"], dict.fromkeys(request["items"], kind), {})
        except ShapeError as error:
            raise ShapeError(f"answers: {error}") from None


def _demand_choice(body: Mapping[str, Any]) -> None:
    if "stop" in body:
        demand_fields(body, {"stop": FLAG, "why": TEXT}, {"estimate": OBJECT})
    else:
        demand_fields(body, {"index": WHOLE, "level": LEVEL}, {"estimate": OBJECT})


def parse_canonical(text: bytes) -> Any:
    """Return the value of a canonical JSON text. Raises ShapeError for other texts and too deep nesting."""
    return _demand_canonical(text, lambda: parse(text))


def _demand_canonical(text: bytes, parsed: Callable[[], Any]) -> Any:
    try:
        value = parsed()
        if encoded(value) == text and _depth_is_fine(text, value):
            return value
    except (ValueError, RecursionError):
        pass
    raise ShapeError(f"canonical JSON is expected, found {text[:60]!r}")


def _depth_is_fine(text: bytes, value: Any) -> bool:
    if text.count(b"[") + text.count(b"{") <= DEEPEST:
        return True
    level = [value]
    for _ in range(DEEPEST):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if type(outer) is dict else outer)
            if type(inner) in (dict, list)
        ]
        if not level:
            return True
    return False


def demand_header(header: Any) -> None:
    """Raise ShapeError unless this is the body of a session_started event."""
    demand_fields(header, *_BODIES["session_started"])


def demand_fields(body: Any, required: Mapping[str, Kind], optional: Mapping[str, Kind]) -> None:
    """Raise ShapeError unless the body is an object with the required keys and all values have their kinds."""
    if type(body) is not dict:
        what = f"an object with {', '.join(required)}" if required else "an object"
        raise ShapeError(f"{what} is expected, found {_short(body)}")
    for name, kind in required.items():
        if name not in body:
            raise ShapeError(f"{name} is missing: {kind.name} is expected")
        if not kind.matches(body[name]):
            raise ShapeError(f"{name}: {kind.name} is expected, found {_short(body[name])}")
    for name, kind in optional.items():
        if name in body and not kind.matches(body[name]):
            raise ShapeError(f"{name}: {kind.name} is expected, found {_short(body[name])}")


def demand_samples(block: Samples) -> None:
    """Raise ShapeError unless a block has a name, a unit for each channel, a rate, and complete rows of samples."""
    named = all(type(name) is str for name in (block.stream, block.clock, *block.channels, *block.units))
    if not named or not block.channels or len(block.units) != len(block.channels):
        raise ShapeError("samples: names of a stream, its clock, its channels and a unit of each are expected")
    if not NUMBER.matches(block.rate_hz) or block.rate_hz < 0 or not WHOLE.matches(block.t0_ns):
        raise ShapeError(f"samples of {block.stream!r:.40}: a rate of 0 or more and a time are expected")
    if not WHOLE.matches(block.first) or block.first < 0:
        raise ShapeError(f"samples of {block.stream!r:.40}: first: a number of 0 or more is expected")
    if len(block.data) % (4 * len(block.channels)):
        raise ShapeError(f"samples of {block.stream!r:.40}: rows of {len(block.channels)} float32 values are expected")


def _place(here: tuple[int | None, int | None] | None) -> str:
    return "no trial" if here is None else f"trial {here[0]}, attempt {here[1]}"


def _short(value: Any) -> str:
    text = f"{value!r:.60}"
    return text if len(text) < 60 else f"{text[:57]}..."
