"""Messages between a bench and the process that has the window: pickled, in sequence, through a pipe."""

from __future__ import annotations

import os
import pickle
import queue
import sys
import threading
from dataclasses import dataclass, field
from typing import IO, Any

Message = tuple[Any, ...]


def send(pipe: IO[bytes], *message: Any) -> None:
    """Send one message: its name and its values."""
    pickle.dump(message, pipe)
    pipe.flush()


@dataclass
class Link:
    """The receiving end, read by a thread so that the window never waits; None marks the end of all messages."""

    source: IO[bytes]
    inbox: queue.SimpleQueue[Message | None] = field(default_factory=queue.SimpleQueue)

    def listen(self) -> Link:
        """Start reading."""
        threading.Thread(target=self._read, daemon=True).start()
        return self

    @classmethod
    def from_input(cls) -> Link:
        """Return the link at a copy of this process's standard input: Python closes the original at the end."""
        return cls(os.fdopen(os.dup(sys.stdin.fileno()), "rb", closefd=False)).listen()

    def _read(self) -> None:
        while True:
            try:
                self.inbox.put(pickle.load(self.source))
            except (EOFError, OSError, ValueError):
                self.inbox.put(None)
                return
