"""The experimenter's orders, and how they are given: a line, a key, a line after a key, or a scanner that types."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from palpate.devices.desk import Prompt
from palpate.protocols.did_you_mean import nearest
from palpate.studies.console.listening import Heard

Do = Literal[
    "confirm",
    "number",
    "note",
    "pause",
    "go on",
    "repeat",
    "repeat last",
    "repeat block",
    "abort",
    "quit",
    "help",
    "scan",
]
WITH_TEXT: tuple[Do, ...] = ("note", "abort", "scan")
PLAIN: tuple[Do, ...] = ("confirm", "pause", "go on", "repeat", "repeat last", "repeat block", "quit", "help")
LONGEST_NOTE = 2000
LINES = (
    "one order a line: confirm, a number, note TEXT, pause, go on, repeat, repeat last, repeat block, abort REASON "
    "(for good), quit (for now), help, scan CODE (as a barcode scanner types)"
)


BURST_S = 0.05
"""The longest pause between two keys of a burst; people take 80 ms and more."""
SHORTEST, LONGEST = 2, 80
"""How many characters a code has."""


class OrderError(ValueError):
    """The line is no order; the message names the orders."""


@dataclass(frozen=True)
class Order:
    """An order; `text` goes with a note, an abort or a scanned code, `number` with a number."""

    do: Do
    text: str = ""
    number: float | None = None


def order_of(line: str) -> Order:
    """Parse a line into an order. Raises OrderError naming the nearest order."""
    words = " ".join(line.split())
    plain = next((do for do in PLAIN if words.lower() == do), None)
    if plain is not None:
        return Order(plain)
    first, _, rest = line.strip().partition(" ")
    with_text = next((do for do in WITH_TEXT if first.lower() == do), None)
    if with_text is not None:
        return worded(with_text, rest)
    number = number_of(words)
    if number is not None:
        return Order("number", number=number)
    raise OrderError(f"{words[:40]!r} is not an order; {nearest(words.lower(), (*PLAIN, *WITH_TEXT))}, or a number")


def worded(do: Do, text: str) -> Order:
    """Return an order with its text. Raises OrderError on a note or a scan without text."""
    stripped = text.strip()[:LONGEST_NOTE]
    if do == "note" and not stripped:
        raise OrderError("a note needs words, as: note the fan came on")
    if do == "scan" and not stripped:
        raise OrderError("a scan needs its code, as: scan T07")
    return Order(do, stripped)


def number_of(text: str) -> float | None:
    """Return the number in a text, with a decimal point or comma; None if the text is no number or it is not finite."""
    try:
        value = float(text.strip().replace(",", "."))
    except ValueError:
        return None
    return value if math.isfinite(value) else None


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
    ("Enter", "confirm"), ("p", "pause"), ("r", "repeat"), ("R", "the last"), ("B", "the block"), ("n", "note"),
    ("a", "abort"), ("q", "quit"), ("h", "help"),
)  # fmt: skip
"""The keys and their meanings, for the console's last line."""
_IN_A_NUMBER = "0123456789.,-"


@dataclass(frozen=True)
class Entry:
    """The state of the keyboard: keys are orders, or a line is being typed."""

    kind: Literal["keys", "note", "abort", "block", "number"] = "keys"
    text: str = ""

    @property
    def typing(self) -> bool:
        """Whether a line is being typed."""
        return self.kind != "keys"


IDLE = Entry()
OPENING = {"n": Entry("note"), "a": Entry("abort"), "B": Entry("block")}
"""Keys after which a line is typed."""


@dataclass(frozen=True)
class Pressed:
    """The result of a key: the entry after it, an order if it completes one, and a hint to the typist."""

    entry: Entry
    order: Order | None = None
    hint: str = ""


def press(entry: Entry, key: str, prompt: Prompt | None, paused: bool) -> Pressed:
    """Return what a key does while `prompt` is shown to the experimenter; for a key without a meaning, a hint."""
    if entry.typing:
        return _typed(entry, key)
    if key in OPENING:
        return Pressed(OPENING[key])
    if prompt is not None and prompt.kind == "number" and key in _IN_A_NUMBER:
        return Pressed(Entry("number", key))
    order = Order("go on") if key == "p" and paused else SINGLE.get(key)
    unknown = f"{key!r} means nothing here; h shows the keys" if order is None and key.isprintable() else ""
    return Pressed(IDLE, order, unknown)


def _typed(entry: Entry, key: str) -> Pressed:
    if key == ESCAPE:
        return Pressed(IDLE, None, f"no {entry.kind}")
    if key in ENTER:
        try:
            return Pressed(IDLE, _order(entry))
        except OrderError as error:
            return Pressed(IDLE, None, str(error))
    if not key.isprintable() or len(entry.text) >= LONGEST_NOTE:
        return Pressed(Entry(entry.kind, entry.text[:-1]) if key in BACKSPACE else entry)
    if entry.kind == "number" and key not in _IN_A_NUMBER:
        return Pressed(entry, None, f"{key!r} is not part of a number; Esc cancels")
    return Pressed(Entry(entry.kind, entry.text + key))


def _order(entry: Entry) -> Order:
    """Return the order in a typed line.

    To abort, or to repeat a block, the word itself must be typed, so that no slip does it. Raises OrderError.
    """
    if entry.kind == "number":
        value = number_of(entry.text)
        if value is None:
            raise OrderError(f"{entry.text!r} is not a number")
        return Order("number", number=value)
    if entry.kind == "block":
        if entry.text.strip().lower() != "block":
            raise OrderError("not repeated: the word block was not typed")
        return Order("repeat block")
    if entry.kind == "abort":
        word, _, reason = entry.text.strip().partition(" ")
        if word.lower() != "abort":
            raise OrderError("not aborted: the word abort was not typed")
        return worded("abort", reason)
    return worded("note", entry.text)


def burst(heard: Sequence[Heard], now_s: float) -> tuple[str | None, bool]:
    """Return the code that the first keys are, else None, and whether to wait for more keys first.

    A burst of keys faster than any hand, with Enter at its end, is one code of a scanner that types.
    """
    keys = list(heard[: LONGEST + 1])
    end = next((place for place, key in enumerate(keys) if key.text in ENTER), None)
    run = keys if end is None else keys[: end + 1]
    if not run or run[0].text in ENTER or any(later.t_s - key.t_s > BURST_S for key, later in pairwise(run)):
        return None, False
    if not all(key.text.isprintable() for key in run if key.text not in ENTER):
        return None, False
    if end is None:
        return None, len(keys) <= LONGEST and now_s - run[-1].t_s <= BURST_S
    return ("".join(key.text for key in run[:-1]), False) if len(run) > SHORTEST else (None, False)
