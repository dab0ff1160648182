"""The console on a terminal: drawn by a thread, at most four times a second, and only when it has changed."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TextIO

from rich.console import Console
from rich.control import Control
from rich.screen import Screen
from rich.segment import ControlType

from palpate.studies.console.page import entry_line, page
from palpate.studies.console.view import View

BETWEEN_PAGES_S = 0.25
"""The page is drawn no more often; the line being typed alone is, as it is typed."""
AT_LEAST_EVERY_S = 1.0
"""How often it is looked whether the shown seconds have changed."""


@dataclass
class Painter:
    """The page on the terminal's second screen; what stood on the terminal is there again afterwards."""

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
        """Draw this as soon as a page is due."""
        self._view = view
        self._changed.set()

    def say(self, line: str) -> None:
        """Nothing: the page shows it."""

    def close(self) -> None:
        """Draw no more and give the terminal's first screen back."""
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
        """Wait for a change, then draw the page if that is due, else the entry line alone; when the next is due."""
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
        width, height = self._console.size
        laid_out = page(view, self.now_ns(), width, height)
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
