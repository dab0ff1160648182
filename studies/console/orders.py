"""What the experimenter can order, and how it is written where there is no keyboard: one order a line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from palpate.protocols.did_you_mean import nearest

Do = Literal["confirm", "number", "note", "pause", "go on", "repeat", "repeat last", "abort", "quit", "help", "scan"]
WITH_TEXT: tuple[Do, ...] = ("note", "abort", "scan")
PLAIN: tuple[Do, ...] = ("confirm", "pause", "go on", "repeat", "repeat last", "quit", "help")
LONGEST_NOTE = 2000
LINES = (
    "one order a line: confirm, a number, note TEXT, pause, go on, repeat, repeat last, abort REASON (for good), "
    "quit (for now), help, scan CODE (as a barcode scanner types)"
)


class OrderError(ValueError):
    """The line is no order; the message says what is."""


@dataclass(frozen=True)
class Order:
    """One thing the experimenter wants; `text` goes with a note, an abort or a scanned code, `number` with a number."""

    do: Do
    text: str = ""
    number: float | None = None


def order_of(line: str) -> Order:
    """The order that a line holds. Raises OrderError naming the nearest one."""
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
    raise OrderError(f"{words[:40]!r} is no order; {nearest(words.lower(), (*PLAIN, *WITH_TEXT))}, or a number")


def worded(do: Do, text: str) -> Order:
    """A note or an abort with its text. Raises OrderError on a note that says nothing."""
    said = text.strip()[:LONGEST_NOTE]
    if do == "note" and not said:
        raise OrderError("a note needs words, as: note the fan came on")
    if do == "scan" and not said:
        raise OrderError("a scan needs its code, as: scan T07")
    return Order(do, said)


def number_of(text: str) -> float | None:
    """A finite number, with a decimal point or comma; None where the text is none."""
    try:
        value = float(text.strip().replace(",", "."))
    except ValueError:
        return None
    return value if math.isfinite(value) else None
