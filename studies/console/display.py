"""What a display shows and can do, and a display of lines for use without a terminal."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import Any, Protocol, TextIO

from palpate.devices.desk import Prompt
from palpate.studies.console.orders import IDLE, Entry
from palpate.studies.console.status import SessionStatus


@dataclass(frozen=True)
class View:
    """The session's status, the present demand, the line being typed, a hint to the typist, and devices' states."""

    status: SessionStatus
    prompt: Prompt | None = None
    entry: Entry = IDLE
    hint: str = ""
    states: Mapping[str, Any] = field(default_factory=dict)
    help: bool = False


class Display(Protocol):
    """Where the experimenter looks. Every method returns at once; a thread of the display's own does the work."""

    def show(self, view: View) -> None:
        """Show this from now on."""

    def say(self, line: str) -> None:
        """Print a line of what happened, if the display has lines."""

    def close(self) -> None:
        """Leave the terminal as it was before; a second call does nothing."""


@dataclass
class Plain:
    """A display of lines on a stream, written by a thread: a slow or closed reader does not hold up the session."""

    stream: TextIO
    _lines: SimpleQueue[str | None] = field(default_factory=SimpleQueue)
    _closed: bool = False

    def __post_init__(self) -> None:
        self._thread = threading.Thread(target=self._write, name="console-output", daemon=True)
        self._thread.start()

    def show(self, view: View) -> None:
        """Do nothing: what matters is said in lines."""

    def say(self, line: str) -> None:
        """Write a line."""
        self._lines.put(line)

    def close(self) -> None:
        """Write the remaining lines."""
        if not self._closed:
            self._closed = True
            self._lines.put(None)
            self._thread.join(timeout=2)

    def _write(self) -> None:
        try:
            while (line := self._lines.get()) is not None:
                self.stream.write(line + "\n")
                self.stream.flush()
        except (OSError, ValueError):  # the reader is gone, or the stream is closed: the session goes on unheard
            return
