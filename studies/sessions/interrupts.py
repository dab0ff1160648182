"""Signals (Ctrl-C, SIGTERM) that end a session once, between two writes and never within one.

kill -9 cannot be caught and need not be: see `ledger`.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name))
"""Ctrl-C, a request to terminate, a closed terminal; Ctrl-Break on Windows."""


class Interrupted(BaseException):
    """A signal asked the session to end. No Exception, since a driver that retries on errors must not swallow it."""


def interrupt_behind(error: BaseException) -> Interrupted | None:
    """Return the interrupt during whose handling an error was raised, if there is one.

    A signal that comes while another unwinds the stack can break the cleaning up there, such as the release of a lock.
    """
    behind: BaseException | None = error
    while behind is not None and not isinstance(behind, Interrupted):
        behind = behind.__context__
    return behind


@dataclass
class Guard:
    """A signal handler that raises Interrupted at once, or at the end of the write that a signal falls into.

    Signals are held back until `listen` is called, so that the session is set up completely or not at all.
    """

    depth: int = 1
    pending: int | None = None
    over: bool = False

    def listen(self) -> None:
        """Let signals end the session from now on."""
        self._leave()

    @contextmanager
    def shield(self) -> Iterator[None]:
        """Hold signals back until the block ends."""
        self.depth += 1
        try:
            yield
        except BaseException:
            self.depth -= 1
            raise
        self._leave()

    def on_signal(self, number: int, _frame: FrameType | None) -> None:
        """Handle a signal; once the session is over, signals are ignored until the rest is done."""
        if self.over:
            return
        if self.depth:
            self.pending = number
        else:
            self._raise(number)

    def _leave(self) -> None:
        self.depth -= 1
        if self.depth == 0 and self.pending is not None and not self.over:
            self._raise(self.pending)

    def _raise(self, number: int) -> None:
        self.pending = None
        raise Interrupted(signal.Signals(number).name)


@contextmanager
def guarded() -> Iterator[Guard]:
    """Install the guard for the duration of a session; only the main thread can do this."""
    guard = Guard()
    before = {number: signal.signal(number, guard.on_signal) for number in ENDING}
    try:
        yield guard
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
