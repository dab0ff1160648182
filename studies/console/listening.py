"""Listeners for the experimenter's input: keys of a terminal, else lines, read by a thread of their own."""

from __future__ import annotations

import codecs
import os
import re
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Protocol, TextIO

_SEQUENCE = re.compile(r"\x1b(?:\[[0-9;?]*[ -/]*[@-~]|O.)")
"""The sequences that arrow and function keys send."""
_UNFINISHED = re.compile(r"\x1b(?:\[[0-9;?]*[ -/]*|O)$")
"""The beginning of a sequence whose end has not come yet."""
BETWEEN_LOOKS_S = 0.02
"""Seconds between two polls on Windows, where a console cannot be waited for together with anything else."""


@dataclass(frozen=True)
class Heard:
    """A key or a line, and the time it came at, in seconds of the listener's clock."""

    text: str
    t_s: float


class Source(Protocol):
    """A source of orders; `by_line` says whether it gives lines rather than keys."""

    by_line: bool

    def take(self) -> list[Heard]:
        """Return at once what has come since the last call."""

    def close(self) -> None:
        """Stop listening and leave the terminal as it was found."""


@dataclass
class Silence:
    """A source that never gives an order, for a process without standard input."""

    by_line: bool = True

    def take(self) -> list[Heard]:
        """Return nothing."""
        return []

    def close(self) -> None:
        """Do nothing: there is nothing to stop."""


class Keys:
    """A parser of a terminal's bytes into keys: whole characters, or a lone escape; escape sequences are no keys."""

    def __init__(self) -> None:
        self._decoder = codecs.getincrementaldecoder("utf-8")("replace")
        self._rest = ""

    def feed(self, data: bytes) -> list[str]:
        """Return the keys that these bytes complete."""
        text = _SEQUENCE.sub("", self._rest + self._decoder.decode(data))
        unfinished = _UNFINISHED.search(text)
        self._rest = unfinished[0] if unfinished is not None else ""
        return list(text[: len(text) - len(self._rest)])

    def end(self) -> list[str]:
        """Return nothing: no key is left."""
        return []


class Lines:
    """A parser of a pipe's bytes into lines; a last line without a line break counts."""

    def __init__(self) -> None:
        self._decoder = codecs.getincrementaldecoder("utf-8")("replace")
        self._rest = ""

    def feed(self, data: bytes) -> list[str]:
        """Return the lines that these bytes complete."""
        *whole, self._rest = (self._rest + self._decoder.decode(data)).split("\n")
        return whole

    def end(self) -> list[str]:
        """Return the last line if it has no line break."""
        return [self._rest] if self._rest else []


def drained(heard: SimpleQueue[Heard]) -> list[Heard]:
    """Take everything out of a queue and return it, without waiting."""
    items = []
    while True:
        try:
            items.append(heard.get_nowait())
        except Empty:
            return items


@dataclass
class Listener:
    """A thread that reads a file descriptor until it ends or is closed; `restore` runs when the listener closes."""

    fd: int
    by_line: bool
    restore: Callable[[], None] = lambda: None
    clock: Callable[[], float] = time.monotonic
    heard: SimpleQueue[Heard] = field(default_factory=SimpleQueue)
    _wake: tuple[int, int] = field(default_factory=os.pipe)
    _closed: bool = False

    def __post_init__(self) -> None:
        self._thread = threading.Thread(target=self._listen, name="console-input", daemon=True)
        self._thread.start()

    def take(self) -> list[Heard]:
        """Return what has come since the last call."""
        return drained(self.heard)

    def close(self) -> None:
        """End the thread and restore the terminal; a second call does nothing."""
        if self._closed:
            return
        self._closed = True
        try:
            os.write(self._wake[1], b"\0")
            self._thread.join(timeout=2)
        finally:
            self.restore()
            for end in self._wake:
                os.close(end)

    def _listen(self) -> None:
        reading: Keys | Lines = Lines() if self.by_line else Keys()
        while data := self._bytes():
            self._hand_over(reading.feed(data))
        self._hand_over(reading.end())

    def _bytes(self) -> bytes:
        """Return the next bytes; none at the end of the input, if the terminal is gone, or when the listener closes."""
        import select

        ready, _, _ = select.select([self.fd, self._wake[0]], [], [])
        if self._wake[0] in ready:
            return b""
        try:
            return os.read(self.fd, 4096)
        except OSError:
            return b""

    def _hand_over(self, texts: list[str]) -> None:
        for text in texts:
            self.heard.put(Heard(text, self.clock()))


@dataclass
class WindowsListener:
    """A daemon thread that polls the keys of a Windows console, or reads lines of anything else."""

    stream: TextIO
    heard: SimpleQueue[Heard] = field(default_factory=SimpleQueue)
    _over: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        self.by_line = not self.stream.isatty()
        listening = self._lines if self.by_line else self._keys
        threading.Thread(target=listening, name="console-input", daemon=True).start()

    def take(self) -> list[Heard]:
        """Return what has come since the last call."""
        return drained(self.heard)

    def close(self) -> None:
        """End the thread at its next poll; a console needs no restoring."""
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


def listen(stream: TextIO | None) -> Source:
    """Return a listener to a stream: keys if it is a terminal, else lines; a silent one if there is no stream."""
    try:
        fd = stream.fileno() if stream is not None else None
    except (OSError, ValueError):
        fd = None
    if fd is None or stream is None:
        return Silence()
    if sys.platform == "win32":
        return WindowsListener(stream)
    if not os.isatty(fd):
        return Listener(fd, by_line=True)

    return Listener(fd, by_line=False, restore=single_keys(fd))


def single_keys(fd: int) -> Callable[[], None]:
    """Turn off echo and line editing of a POSIX terminal; return a function that puts it back as it was.

    Ctrl-C stays a signal. Ctrl-Z, Ctrl-S and Ctrl-\\ lose their meaning: each would stop a session by mistake.
    """
    import termios

    before = termios.tcgetattr(fd)
    mode = termios.tcgetattr(fd)
    mode[0] &= ~termios.IXON
    mode[3] &= ~(termios.ECHO | termios.ICANON)
    none = bytes([os.fpathconf(fd, "PC_VDISABLE") % 256])
    for meaning, value in (
        (termios.VMIN, 1), (termios.VTIME, 0), (termios.VSUSP, none), (termios.VQUIT, none)
    ):  # fmt: skip
        mode[6][meaning] = value
    termios.tcsetattr(fd, termios.TCSANOW, mode)

    def restore() -> None:
        with suppress(termios.error):  # the terminal may be gone
            termios.tcsetattr(fd, termios.TCSANOW, before)

    return restore
