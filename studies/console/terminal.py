"""A POSIX terminal that hands over single keys, and as it was before."""

from __future__ import annotations

import os
import termios
from collections.abc import Callable
from contextlib import suppress


def single_keys(fd: int) -> Callable[[], None]:
    """Turn off echo and line editing; what is returned puts the terminal back as it was.

    Ctrl-C stays a signal. Ctrl-Z, Ctrl-S and Ctrl-\\ lose their meaning: each would stop a session with nobody asked.
    """
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
