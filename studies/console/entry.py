"""What a key means: single keys, and the lines that are typed after some of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from palpate.devices.desk import Prompt
from palpate.studies.console.orders import LONGEST_NOTE, Order, OrderError, number_of, worded

ENTER, ESCAPE, BACKSPACE = ("\r", "\n"), "\x1b", ("\x7f", "\x08")
SINGLE = {
    **dict.fromkeys(ENTER, Order("confirm")),
    "p": Order("pause"),
    "r": Order("repeat"),
    "R": Order("repeat last"),
    "q": Order("quit"),
    "h": Order("help"),
    "?": Order("help"),
}
KEYS = (
    ("Enter", "confirm"), ("p", "pause"), ("r", "repeat"), ("R", "the last"), ("n", "note"), ("a", "abort"),
    ("q", "quit"), ("h", "help"),
)  # fmt: skip
"""The keys and their meanings, for the console's last line."""
_IN_A_NUMBER = "0123456789.,-"


@dataclass(frozen=True)
class Entry:
    """Whether keys stand for themselves, or a line is being typed."""

    kind: Literal["keys", "note", "abort", "number"] = "keys"
    text: str = ""

    @property
    def typing(self) -> bool:
        """Whether a line is being typed."""
        return self.kind != "keys"


@dataclass(frozen=True)
class Pressed:
    """What a key led to: the entry as it stands then, an order where one is complete, and a word to the typist."""

    entry: Entry
    order: Order | None = None
    hint: str = ""


IDLE = Entry()
OPENING = {"n": Entry("note"), "a": Entry("abort")}
"""Keys after which a line is typed."""


def press(entry: Entry, key: str, asked: Prompt | None, paused: bool) -> Pressed:
    """What one key means while `asked` stands before the experimenter; a key without a meaning says so."""
    return _typed(entry, key) if entry.typing else _single(key, asked, paused)


def _single(key: str, asked: Prompt | None, paused: bool) -> Pressed:
    if key in OPENING:
        return Pressed(OPENING[key])
    if asked is not None and asked.kind == "number" and key in _IN_A_NUMBER:
        return Pressed(Entry("number", key))
    order = Order("go on") if key == "p" and paused else SINGLE.get(key)
    unknown = f"{key!r} means nothing here; h shows the keys" if order is None and key.isprintable() else ""
    return Pressed(IDLE, order, unknown)


def _typed(entry: Entry, key: str) -> Pressed:
    if key == ESCAPE:
        return Pressed(IDLE, None, f"no {entry.kind}")
    if key in ENTER:
        return _finished(entry)
    if key in BACKSPACE:
        return Pressed(Entry(entry.kind, entry.text[:-1]))
    if not key.isprintable() or len(entry.text) >= LONGEST_NOTE:
        return Pressed(entry)
    if entry.kind == "number" and key not in _IN_A_NUMBER:
        return Pressed(entry, None, f"{key!r} is no part of a number; Esc leaves it")
    return Pressed(Entry(entry.kind, entry.text + key))


def _finished(entry: Entry) -> Pressed:
    try:
        return Pressed(IDLE, _order(entry))
    except OrderError as error:
        return Pressed(IDLE, None, str(error))


def _order(entry: Entry) -> Order:
    """The order that a typed line is; to abort, the word itself must be typed, so that no slip ends a session."""
    if entry.kind == "number":
        value = number_of(entry.text)
        if value is None:
            raise OrderError(f"{entry.text!r} is no number")
        return Order("number", number=value)
    if entry.kind == "abort":
        word, _, reason = entry.text.strip().partition(" ")
        if word.lower() != "abort":
            raise OrderError("not aborted: the word abort was not typed")
        return worded("abort", reason)
    return worded("note", entry.text)
