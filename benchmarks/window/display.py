"""An X server of any size without a screen, for measuring the real window."""

from __future__ import annotations

import os
import select
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec

from palpate.devices.window.geometry import WindowError

STARTS_WITHIN_S = 30.0
ENDS_WITHIN_S = 10.0


class NoVirtualDisplay(WindowError):
    """A virtual display is not available; the message names what is missing."""


def missing() -> list[str]:
    """Return what is missing on this machine for a window on a virtual display, by name."""
    names = [] if shutil.which("Xvfb") else ["Xvfb (Debian: xvfb)"]
    packages = {"psychopy": "PsychoPy (palpate[lab])", "Xlib": "python-xlib (palpate[lab])"}
    return names + [name for package, name in packages.items() if find_spec(package) is None]


@contextmanager
def virtual_display(width: int, height: int) -> Iterator[str]:
    """Start Xvfb on a free display number; yield the display's name. Raises NoVirtualDisplay."""
    if absent := missing():
        raise NoVirtualDisplay(f"no virtual display: {', '.join(absent)} is not installed")
    server, name = _start(width, height)
    try:
        yield name
    finally:
        server.terminate()
        try:
            server.wait(ENDS_WITHIN_S)
        except subprocess.TimeoutExpired:
            server.kill()
            server.wait()


def _start(width: int, height: int) -> tuple[subprocess.Popen[bytes], str]:
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", f"{width}x{height}x24", "-nolisten", "tcp"]
    try:
        server = subprocess.Popen(
            [*command, "-noreset"], pass_fds=[writing], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        os.close(writing)
        return server, f":{_number(reading, server)}"
    finally:
        os.close(reading)


def _number(reading: int, server: subprocess.Popen[bytes]) -> int:
    """Return the number that the server writes once it is ready."""
    number = b""
    while not number.endswith(b"\n"):
        ready, _, _ = select.select([reading], [], [], STARTS_WITHIN_S)
        piece = os.read(reading, 64) if ready else b""
        if not piece:
            server.kill()
            server.wait()
            raise NoVirtualDisplay("Xvfb did not start; try it by hand: Xvfb :99 -screen 0 1280x720x24")
        number += piece
    return int(number)
