"""Lines typed at the terminal, taken when they are there: a window that waits for its experimenter stays alive."""

from __future__ import annotations

import io
import os
import select
import sys
from dataclasses import dataclass, field

import click


@dataclass
class Lines:
    """Standard input, line by line, without waiting; nobody else may read from it meanwhile."""

    pending: bytearray = field(default_factory=bytearray)

    def poll(self) -> str | None:
        """The next line if it has been typed. Raises click.Abort where the input has come to its end."""
        if b"\n" not in self.pending:
            self.pending += self._piece()
        line, found, rest = self.pending.partition(b"\n")
        if not found:
            return None
        self.pending = rest
        return line.decode("utf-8", "replace")

    def _piece(self) -> bytes:
        if sys.platform == "win32" and sys.stdin.isatty():
            return _from_windows_console()
        try:
            source = sys.stdin.fileno()
        except (io.UnsupportedOperation, AttributeError):
            return _demand(sys.stdin.readline().encode())
        if sys.platform == "win32":
            return _demand(sys.stdin.readline().encode())
        ready, _, _ = select.select([source], [], [], 0)
        return _demand(os.read(source, 4096)) if ready else b""


def _demand(piece: bytes) -> bytes:
    if not piece:
        raise click.Abort
    return piece


def _from_windows_console() -> bytes:
    """What was typed since the last time, echoed as it is typed."""
    import msvcrt

    typed = ""
    while msvcrt.kbhit():  # type: ignore[attr-defined, unused-ignore]
        typed += msvcrt.getwche()  # type: ignore[attr-defined, unused-ignore]
    if "\x03" in typed:
        raise KeyboardInterrupt
    return typed.replace("\r", "\n").encode()
