"""Ctrl-C and SIGTERM end a session once, between two writes, and never in the middle of one.

kill -9 cannot be caught and need not be: see `ledger`.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name))
"""Ctrl-C, a polite kill, a closed terminal; Ctrl-Break on Windows."""


class Interrupted(BaseException):
    """A signal asked the session to end. No Exception: a driver that retries on errors must not swallow it."""


def interrupt_behind(error: BaseException) -> Interrupted | None:
    """Return the interrupt that an error was raised in handling of, if there is one.

    A signal that comes while another one unwinds the stack can break what cleans up there, as a lock that is left.
    """
    behind: BaseException | None = error
    while behind is not None and not isinstance(behind, Interrupted):
        behind = behind.__context__
    return behind


@dataclass
class Guard:
    """Raises Interrupted where a signal finds the session, or at the end of the write it falls into.

    Signals are held back until `listen` is called, so that the session is set up whole or not at all.
    """

    depth: int = 1
    pending: int | None = None
    over: bool = False

    def listen(self) -> None:
        """From here on a signal may end the session."""
        self._leave()

    @contextmanager
    def shield(self) -> Iterator[None]:
        """Hold signals back until the block is left."""
        self.depth += 1
        try:
            yield
        except BaseException:
            self.depth -= 1
            raise
        self._leave()

    def on_signal(self, number: int, _frame: FrameType | None) -> None:
        """The signal handler; once the session is over, what remains to be done is done in peace."""
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
    """Install the guard for the duration of a session; only the main thread can."""
    guard = Guard()
    before = {number: signal.signal(number, guard.on_signal) for number in ENDING}
    try:
        yield guard
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
