"""Keys and lines on Windows, where a console cannot be waited for together with anything else."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import TextIO

from studies.console.listening import Heard, drained

BETWEEN_LOOKS_S = 0.02


@dataclass
class WindowsListener:
    """A daemon thread that looks for keys of the console, or reads lines of anything else."""

    stream: TextIO
    heard: SimpleQueue[Heard] = field(default_factory=SimpleQueue)
    _over: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        self.by_line = not self.stream.isatty()
        listening = self._lines if self.by_line else self._keys
        threading.Thread(target=listening, name="console-input", daemon=True).start()

    def take(self) -> list[Heard]:
        """What has come since the last time."""
        return drained(self.heard)

    def close(self) -> None:
        """End the thread at its next look; a console needs no restoring."""
        self._over.set()

    def _lines(self) -> None:
        for line in self.stream:
            self.heard.put(Heard(line.rstrip("\n"), time.monotonic()))

    def _keys(self) -> None:
        import msvcrt

        while not self._over.wait(BETWEEN_LOOKS_S):
            while msvcrt.kbhit():  # type: ignore[attr-defined]
                key = msvcrt.getwch()  # type: ignore[attr-defined]
                if key in ("\0", "\xe0"):  # the first half of an arrow or function key
                    msvcrt.getwch()  # type: ignore[attr-defined]
                else:
                    self.heard.put(Heard(key, time.monotonic()))
