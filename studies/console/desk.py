"""The experimenter's desk: keys and lines become asides and answers, events and states become the display."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import Any, TextIO

from palpate.devices.desk import Prompt
from palpate.devices.samples import TELLING
from palpate.protocols.blinding import hider
from palpate.protocols.events import NS, Aside, Event
from palpate.protocols.plan import Plan
from palpate.protocols.session_state import SessionState
from palpate.studies.console.display import Display, Plain, View
from palpate.studies.console.listening import Heard, Silence, Source, listen
from palpate.studies.console.orders import IDLE, LINES, Order, OrderError, burst, order_of, press
from palpate.studies.console.status import Remark, SessionStatus, status_of, track_end
from palpate.studies.console.words import clock, doing_now, how_to_answer, line, where
from palpate.studies.sessions.interrupts import Interrupted

REACTION_S = 0.3
"""A key that comes sooner after a demand or a trial's start was meant for what stood there before."""
ORDERS_AFTER_THE_END = ("confirm", "number", "help", "quit")
"""The orders that are accepted after the session's end, while its last page is shown."""


@dataclass
class ExperimenterDesk:
    """A desk (palpate.devices.desk) that reads orders from a source and draws on a display, in the main thread only.

    Orders are carried out one by one as they came. Keys that nothing waits for are refused with a hint; a line that
    answers waits for its demand, and later lines wait behind it, so that a whole session can be scripted.
    """

    plan: Plan
    source: Source
    display: Display
    clock: Callable[[], float] = time.monotonic
    state: SessionState = field(default_factory=SessionState)
    view: View = field(init=False)
    _heard: deque[Heard] = field(default_factory=deque)
    _answer: float | bool | str | None = None
    _demanded_s: float = 0.0
    _trial_s: float = 0.0
    _live: bool = False
    _ends: list[Remark] = field(default_factory=list)
    _scanner: bool = False
    """Whether a prompt has asked for a code: from then on a burst of keys is a scan and never an order."""

    def __post_init__(self) -> None:
        self.view = View(SessionStatus(self.plan))
        self._hide = hider(self.plan.study, TELLING)

    @property
    def status(self) -> SessionStatus:
        """Where the session is."""
        return self.view.status

    def watch(self, event: Event) -> None:
        """Update the status with a recorded event; the events of earlier runs come before the first poll."""
        if event.kind == "trial_started":
            self._trial_s = self.clock()
        if (ended := track_end(self.plan, self.state, event)) is not None:
            self._ends.append(ended)
        self.state.apply(event)
        if self._live:
            self._show(status=status_of(self.plan, self.state, self._ends))
            if (text := line(event, self.status)) is not None:
                self.display.say(text)
            if ended is not None:
                self.display.say(f"[{clock(event.t_ns / NS)}] {ended.text}")

    def poll(self) -> Aside | None:
        """Return the next thing that the experimenter did. Raises Interrupted if it was to quit."""
        self._go_live()
        self._heard.extend(self.source.take())
        while self._heard and not self._is_early(self._heard[0].text):
            if self._scanning():
                continue
            if self._scans and burst(list(self._heard), self.clock())[1]:
                break  # the first keys may yet become a code: what they mean is not known before
            aside = self._hear(self._heard.popleft())
            if aside is not None:
                return aside
        return None

    def demand(self, prompt: Prompt | None) -> None:
        """Show the experimenter a demand, or None to take it away; an equal one stays unchanged.

        What the study keeps blind is left out, whoever makes the demand.
        """
        self._go_live()
        if prompt is not None:
            prompt = replace(prompt, text=self._hide(prompt.text))
        if prompt == self.view.prompt:
            return
        self._answer, self._demanded_s = None, self.clock()
        self._scanner = self._scanner or (prompt is not None and prompt.codes)
        self._show(prompt=prompt, entry=self.view.entry if self.view.entry.kind != "number" else IDLE)
        if prompt is not None:
            self.display.say(f"> {prompt.text} ({how_to_answer(prompt, self.source.by_line)})")

    def answer(self) -> float | bool | str | None:
        """Return the answer to the standing demand; None before it is given."""
        return self._answer

    def tell(self, state: Mapping[str, Any]) -> None:
        """Show the state of a window or device, without what the study keeps blind; None removes a key."""
        shown = {key: self._hide(value) if isinstance(value, str) else value for key, value in state.items()}
        states = {key: value for key, value in {**self.view.states, **shown}.items() if value is not None}
        if states != self.view.states:
            self._show(states=states)

    def close(self) -> None:
        """Stop listening and showing, and restore the terminal, even if one of the two fails."""
        with ExitStack() as ends:
            ends.callback(self.source.close)
            ends.callback(self.display.close)

    @property
    def _waiting(self) -> Prompt | None:
        """The demand that has no answer yet."""
        return self.view.prompt if self._answer is None else None

    def _go_live(self) -> None:
        if not self._live:
            self._live = True
            self.view = replace(self.view, status=status_of(self.plan, self.state, self._ends))
            text = where(self.status)
            self.display.say(text if self.status.doing is None else f"{text}; {doing_now(self.status)}")
            self._show()

    def _is_early(self, text: str) -> bool:
        """Return whether a line answers a demand that has not come yet."""
        if not self.source.by_line or self._waiting is not None:
            return False
        try:
            return order_of(text).do in {"confirm", "number", "scan"}
        except OrderError:
            return False

    @property
    def _scans(self) -> bool:
        """Whether keys may come from a scanner that types."""
        return self._scanner and not self.source.by_line and not self.view.entry.typing

    def _scanning(self) -> bool:
        """Take the first keys as the answer if they are a scanned code, and return whether they are."""
        code, _ = burst(list(self._heard), self.clock()) if self._scans else (None, False)
        if code is None:
            return False
        for _ in range(len(code) + 1):
            self._heard.popleft()
        if self._waiting is not None and self._waiting.codes:
            self._answer = code
        else:
            self._hint(f"{code} was scanned: no code is expected now")
        return True

    def _hear(self, heard: Heard) -> Aside | None:
        """Carry out one line or key."""
        if not self.source.by_line:
            pressed = press(self.view.entry, heard.text, self._waiting, self.status.paused)
            self._show(entry=pressed.entry, hint=pressed.hint, help=False)
            return None if pressed.order is None else self._handle_order(pressed.order, heard.t_s)
        if not heard.text.strip():
            return None
        try:
            return self._handle_order(order_of(heard.text), heard.t_s)
        except OrderError as error:
            self._hint(str(error))
            return None

    def _handle_order(self, order: Order, t_s: float) -> Aside | None:
        if self.status.ended is not None and order.do not in ORDERS_AFTER_THE_END:
            self._hint("the session is over: nothing more is recorded")
            return None
        match order.do:
            case "confirm" | "number" | "scan":
                self._take_answer(order, t_s)
            case "help":
                self._show(help=True)
                if self.source.by_line:
                    self.display.say(LINES)
            case "quit":
                raise Interrupted("QUIT")
            case "note":
                return Aside({"do": "note", "text": order.text})
            case "abort":
                return Aside({"do": "abort", "text": order.text})
            case "pause" | "go on" if (order.do == "pause") == self.status.paused:
                self._hint("the session is paused already" if self.status.paused else "the session is not paused")
            case "pause" | "go on":
                return Aside({"do": "pause" if order.do == "pause" else "go_on"})
            case "repeat block" if not self.status.has_blocks:
                self._hint("the study has no blocks to repeat")
            case "repeat" | "repeat last" | "repeat block":
                return self._repeat(order, t_s)
        return None

    def _take_answer(self, order: Order, t_s: float) -> None:
        prompt = self._waiting
        if prompt is None:
            self._hint("nothing to confirm now")
        elif not self.source.by_line and t_s < self._demanded_s + REACTION_S:
            self._hint("too soon after the demand: once more, please")
        elif order.do == "scan":
            self._answer = order.text if prompt.codes else None
            self._hint("" if prompt.codes else "no code is expected")
        elif prompt.kind == "confirm" and order.do == "number":
            self._hint("no number is expected: confirm once it is done")
        elif prompt.kind == "number" and order.number is None and prompt.default is None:
            self._hint("a number is expected")
        else:
            number = prompt.default if order.number is None else order.number
            self._answer = True if prompt.kind == "confirm" or number is None else float(number)
            self._hint("")

    def _repeat(self, order: Order, t_s: float) -> Aside | None:
        if self.status.trial is None:
            self._hint("no trial is under way: nothing to repeat now")
        elif self.status.paused:
            self._hint("the session is paused: continue first, then repeat")
        elif not self.source.by_line and t_s < self._trial_s + REACTION_S:
            self._hint("a trial began just then: r repeats this one, R the one before")
        else:
            return Aside({"do": "repeat", "which": order.do.removeprefix("repeat").strip() or "this"})
        return None

    def _hint(self, text: str) -> None:
        self._show(hint=text)
        if self.source.by_line and text:
            self.display.say(text)

    def _show(self, **changes: Any) -> None:
        self.view = replace(self.view, **changes)
        if self._live:
            self.display.show(self.view)


def open_desk(plan: Plan, now_ns: Callable[[], int], orders: TextIO | None, shown: TextIO) -> ExperimenterDesk:
    """Open the experimenter's desk at an input and an output stream; close it on every way out.

    Orders from a terminal come as single keys, from anything else as lines; a terminal shows the page, anything else
    lines.
    """
    source = listen(orders)
    try:
        if shown.isatty():
            from palpate.studies.console.page import Painter

            display: Display = Painter(shown, now_ns)
        else:
            display = Plain(shown)
    except BaseException:
        source.close()
        raise
    if isinstance(source, Silence):
        display.say("there is no input for orders; Ctrl-C ends the run")
    return ExperimenterDesk(plan, source, display)
