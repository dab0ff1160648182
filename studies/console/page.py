"""The console's page on a terminal: its layout for the size of the terminal, and the thread that draws it.

It is drawn at most four times a second, and only when it has changed.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TextIO

from rich import box
from rich.cells import cell_len
from rich.console import Console, Group, RenderableType
from rich.control import Control
from rich.layout import Layout
from rich.padding import Padding
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.screen import Screen
from rich.segment import ControlType
from rich.table import Table
from rich.text import Text

from palpate.protocols.events import NS
from palpate.studies.console.display import View
from palpate.studies.console.orders import KEYS, Entry
from palpate.studies.console.status import SessionStatus
from palpate.studies.console.words import about, about_trial, clock, doing_now, how_to_answer, standing

HELP = (
    ("Enter", "the demand is done: the sample is in place, the number is typed"),
    ("p", "pause; once more to continue. Paused time is not counted"),
    ("r", "repeat this trial from its start; its answers stay recorded, but do not count"),
    ("R", "go back and repeat the trial before this one"),
    ("B", "begin this block again from its first trial: type block. Its answers so far do not count"),
    ("n", "write a note into the session's record (Esc leaves it)"),
    ("a", "abort the session for good: type abort and, if you like, why"),
    ("q", "quit for now: continue later with palpate resume"),
)
MARKS = {"live": ("LIVE", "bold white on dark_green"), "rehearsal": ("REHEARSAL", "bold black on yellow")}
ASKING = {"note": "note", "block": "type block", "abort": "type abort, a blank and the reason", "number": "number"}


def page(view: View, t_ns: int, width: int, height: int = 30) -> Layout:
    """Return the whole page at session time t_ns, for a terminal of so many columns and rows.

    The demand takes up to five lines more than one.
    """
    prompted = view.prompt is not None and not view.status.paused
    further = cell_len(view.prompt.text) // max(width - 8, 20) if view.prompt is not None and prompted else 0
    keys = Text(" ", no_wrap=True, overflow="ellipsis")
    for key, meaning in (pair for pair in KEYS if pair[0] != "B" or view.status.has_blocks):
        keys.append(key, style="bold").append(f" {meaning}  ", style="dim")
    layout = Layout()
    layout.split_column(
        Layout(_title(view.status), size=1),
        Layout(_demand(view), size=4 + min(further, 5)),
        Layout(_progress(view.status, t_ns), size=3),
        Layout(_help() if view.help else _middle(view, t_ns, width, height)),
        Layout(keys, size=1),
        Layout(entry_line(view.entry, view.hint, width), size=1),
    )
    return layout


def entry_line(entry: Entry, hint: str, width: int) -> Text:
    """Return the last line: the end of the text being typed, or a hint to the typist."""
    if not entry.typing:
        return Text(f" {hint}", style="yellow", no_wrap=True)
    label = f" {ASKING[entry.kind]}: "
    shown = entry.text
    while cell_len(label) + cell_len(shown) + 1 > width and shown:
        shown = shown[1:]
    return Text.assemble((label, "bold cyan"), shown, ("█", "blink"), no_wrap=True)


def _title(status: SessionStatus) -> RenderableType:
    study, who = status.plan.study, status.plan.who
    rig = status.header.get("rig", {})
    mark, style = MARKS.get(rig.get("kind", ""), ("", ""))
    simulated = ", ".join(need.replace("_", " ") for need in rig.get("twins", ()))
    row = Table.grid(expand=True)
    row.add_column(ratio=1, no_wrap=True)
    row.add_column(justify="right", no_wrap=True)
    left = Text.assemble((f" {mark} ", style), "  ", (study.title or study.study, "bold"))
    if simulated:
        left.append(f"   simulated: {simulated}", style="yellow")
    if status.plan.study.blind:
        left.append(f"   blind: {', '.join(status.plan.study.blind)}", style="yellow")
    group = f"  group {who.group}" if who.group is not None else ""
    row.add_row(left, f"{who.participant}{group}  row {who.row}  session {status.header.get('session', 1)} ")
    return row


def _demand(view: View) -> RenderableType:
    status = view.status
    if view.prompt is not None and not status.paused:
        text = Text.assemble((view.prompt.text, "bold bright_yellow"), "\n", (how_to_answer(view.prompt), "dim"))
        return Panel(text, title="your turn", title_align="left", border_style="bright_yellow", box=box.HEAVY)
    if status.pause is not None:
        state = "Paused. The participant sees the pause page.\np continues"
        if status.pause.by_participant:
            state = "The participant rests, and continues when ready.\np ends the rest"
        text = Text(state, style="bold yellow")
        return Panel(
            text,
            title="resting" if status.pause.by_participant else "paused",
            title_align="left",
            border_style="yellow",
            box=box.ROUNDED,
        )
    state = "The session is over." if status.ended is not None else "Nothing to do for you now."
    return Panel(Text(state, style="dim"), border_style="bright_black", box=box.ROUNDED)


def _progress(status: SessionStatus, t_ns: int) -> RenderableType:
    line = Table.grid(expand=True, padding=(0, 1))
    line.add_column(no_wrap=True)
    line.add_column(ratio=1)
    line.add_column(justify="right", no_wrap=True)
    share = f"{len(status.done) / status.total:.0%}"
    line.add_row(
        f" {standing(status)}",
        ProgressBar(status.total, len(status.done), style="grey37", complete_style="cyan", finished_style="cyan"),
        f"{share} ",
    )
    times = Text(f" {clock(t_ns / NS)} since the start, {about(status.left_s(t_ns))}", style="dim")
    if status.pause is not None:
        times.append(f"   paused for {clock((t_ns - status.pause.started_ns) / NS)}", style="yellow")
    return Padding(Group(line, times), (0, 0, 1, 0))


def _middle(view: View, t_ns: int, width: int, height: int) -> RenderableType:
    """Return the panels that fit: all four, the upper two, or the stimuli alone."""
    participant = Layout(_panel("participant", _participant(view, t_ns)))
    stimuli = Layout(_panel("stimuli", _stimuli(view.status)))
    if height < 20:
        return stimuli
    middle, upper, lower = Layout(), Layout(size=5), Layout()
    if width < 70 or height < 22:
        middle.split_column(participant, stimuli)
        return middle
    upper.split_row(participant, stimuli)
    lower.split_row(
        Layout(_panel("window and devices", _states(view))), Layout(_panel("remarks", _remarks(view.status)))
    )
    middle.split_column(upper, lower)
    return middle


def _panel(title: str, inside: RenderableType) -> Panel:
    return Panel(inside, title=title, title_align="left", border_style="bright_black", box=box.ROUNDED)


def _participant(view: View, t_ns: int) -> RenderableType:
    status = view.status
    if status.doing is None:
        return Text()
    felt = str(view.states.get("window", "")).startswith("interval ")
    text = doing_now(status, waits=view.prompt is not None and not felt)
    return Text.assemble((text, "bold"), "\n", (f"for {clock(status.doing_s(t_ns))}", "dim"))


def _stimuli(status: SessionStatus) -> RenderableType:
    rows = Table.grid(padding=(0, 1))
    rows.add_column(style="dim", no_wrap=True, min_width=4)
    rows.add_column(overflow="ellipsis", no_wrap=True)
    trial, blind = status.current(), status.plan.study.blind
    if trial is not None:
        rows.add_row("now", Text(about_trial(trial, blind), style="bold"))
    for name, coming in zip(("next", "then"), status.coming(2), strict=False):
        rest = "  (after a rest)" if coming.rest_before else ""
        rows.add_row(name, f"{about_trial(coming, blind)}{rest}")
    if not status.coming(1):
        rows.add_row("next", Text("none: this is the last", style="dim"))
    return rows


def _states(view: View) -> RenderableType:
    rows = Table.grid(padding=(0, 1))
    rows.add_column(style="dim", no_wrap=True, min_width=4)
    rows.add_column(overflow="ellipsis", no_wrap=True)
    for key, value in view.states.items():
        text = f"{value:.4g}" if isinstance(value, float) else str(value).replace("_", " ")
        rows.add_row(key.replace("_", " "), Text(text))
    return rows


def _remarks(status: SessionStatus) -> RenderableType:
    rows = Table.grid(padding=(0, 1))
    rows.add_column(style="dim", no_wrap=True, justify="right")
    rows.add_column()
    for remark in reversed(status.remarks):
        rows.add_row(clock(remark.t_ns / NS), Text(remark.text))
    return rows


def _help() -> RenderableType:
    rows = Table.grid(padding=(0, 2))
    rows.add_column(style="bold", no_wrap=True, justify="right")
    rows.add_column()
    for key, meaning in HELP:
        rows.add_row(key, meaning)
    return _panel("keys: any key closes this", rows)


BETWEEN_PAGES_S = 0.25
"""Least seconds between two drawings of the page; the line being typed is drawn at once."""
AT_LEAST_EVERY_S = 1.0
"""Most seconds between two drawings, where only the shown times have changed."""


@dataclass
class Painter:
    """A display that draws the page on the terminal's alternate screen, and restores the terminal afterwards."""

    stream: TextIO
    now_ns: Callable[[], int]
    clock: Callable[[], float] = time.monotonic
    pages: int = 0
    _view: View | None = None
    _behind: bool = False
    _written: object = None
    _changed: threading.Event = field(default_factory=threading.Event)
    _over: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        self._console = Console(file=self.stream, force_terminal=True)
        self._thread = threading.Thread(target=self._paint, name="console-output", daemon=True)
        self._thread.start()

    def show(self, view: View) -> None:
        """Draw this view as soon as a page is due."""
        self._view = view
        self._changed.set()

    def say(self, line: str) -> None:
        """Do nothing: the page shows what happens."""

    def close(self) -> None:
        """Stop drawing and switch back to the terminal's normal screen."""
        self._over.set()
        self._changed.set()
        self._thread.join(timeout=2)

    def _paint(self) -> None:
        with suppress(OSError, ValueError):  # the terminal is gone: the session goes on unseen
            self._console.control(Control.alt_screen(True), Control.show_cursor(False))
            try:
                due_s = self.clock()
                while not self._over.is_set():
                    due_s = self._turn(due_s)
            finally:
                self._console.control(Control.show_cursor(True), Control.alt_screen(False))

    def _turn(self, due_s: float) -> float:
        """Wait for a change, draw the page if it is due, else only the entry line; return when the next is due."""
        if self._changed.wait(max(due_s - self.clock(), 0.0) if self._behind else AT_LEAST_EVERY_S):
            self._changed.clear()
            self._behind = True
        view = self._view
        if view is None or self._over.is_set():
            return due_s
        if self.clock() < due_s:
            self._write_entry(view)
            return due_s
        self._draw(view)
        self._behind = False
        return self.clock() + BETWEEN_PAGES_S

    def _draw(self, view: View) -> None:
        laid_out = page(view, self.now_ns(), *self._console.size)
        self._console.control(Control.home())
        self._console.print(Screen(laid_out), end="")
        self._written = (view.entry, view.hint)
        self.pages += 1

    def _write_entry(self, view: View) -> None:
        if (view.entry, view.hint) == self._written:
            return
        width, height = self._console.size
        self._console.control(Control.move_to(0, height - 1), Control((ControlType.ERASE_IN_LINE, 2)))
        self._console.print(entry_line(view.entry, view.hint, width), end="", no_wrap=True, overflow="crop")
        self._written = (view.entry, view.hint)
