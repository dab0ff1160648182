"""The console where there is no terminal to draw on: one line for each thing that happens."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import TextIO

from palpate.studies.console.view import View


@dataclass
class Plain:
    """Lines on a stream, written by a thread: a reader that is slow or gone does not hold the session up."""

    stream: TextIO
    _lines: SimpleQueue[str | None] = field(default_factory=SimpleQueue)
    _closed: bool = False

    def __post_init__(self) -> None:
        self._thread = threading.Thread(target=self._write, name="console-output", daemon=True)
        self._thread.start()

    def show(self, view: View) -> None:
        """Nothing: what matters is said in lines."""

    def say(self, line: str) -> None:
        """Write a line."""
        self._lines.put(line)

    def close(self) -> None:
        """Write what is left."""
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
