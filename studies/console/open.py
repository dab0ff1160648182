"""Opening the console: keys or lines, a page or lines, as the two ends of the process allow."""

from __future__ import annotations

from collections.abc import Callable
from typing import TextIO

from palpate.protocols.plan import Plan
from palpate.studies.console.listening import Silence, listen
from palpate.studies.console.plain import Plain
from palpate.studies.console.seat import Seat
from palpate.studies.console.view import Display


def open_seat(plan: Plan, now_ns: Callable[[], int], heard: TextIO | None, told: TextIO) -> Seat:
    """The experimenter's seat at an input and an output stream; close it on every way out.

    A terminal to hear from gives single keys, anything else lines; a terminal to tell gives the page, else lines.
    """
    source = listen(heard)
    try:
        display = _display(told, now_ns)
    except BaseException:
        source.close()
        raise
    if isinstance(source, Silence):
        display.say("there is no input to give orders by; Ctrl-C ends the sitting")
    return Seat(plan, source, display)


def _display(told: TextIO, now_ns: Callable[[], int]) -> Display:
    if not told.isatty():
        return Plain(told)
    from palpate.studies.console.painter import Painter

    return Painter(told, now_ns)
