"""The other end of a stage: starts the process with the window, sends it messages, and waits for its answers."""

from __future__ import annotations

import os
import queue
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from benchmarks.window.link import Link, Message, send
from benchmarks.window.stage import Setting
from palpate.devices.window.geometry import Placed, WindowError

PATIENCE_S = 60.0
ROOT = Path(__file__).resolve().parents[2]


class StageError(WindowError):
    """The window's process sent an unexpected message or none, or ended."""


@dataclass
class Stage:
    """A window in a process of its own."""

    process: subprocess.Popen[bytes]
    link: Link

    def send_message(self, *message: Any) -> None:
        """Send a message; see `benchmarks.window.stage`."""
        if self.process.stdin is None:
            raise StageError("the window's process has no input")
        send(self.process.stdin, *message)

    def wait_for_message(self, *names: str, patience_s: float = PATIENCE_S) -> Message:
        """Return the next message with one of these names; skip others with known names."""
        while True:
            try:
                message = self.link.inbox.get(timeout=patience_s)
            except queue.Empty:
                raise StageError(f"the window's process said nothing of {names} in {patience_s:g} s") from None
            if message is None:
                raise StageError(f"the window's process ended ({self.process.wait(PATIENCE_S)}) before {names}")
            if message[0] in names:
                return message
            if message[0] == "failed":
                raise StageError(message[1])

    def put_on(self, request: Any) -> None:
        """Perform a request; return once it is shown to the participant."""
        self.send_message("perform", request)
        self.wait_for_message("shown")

    def result(self) -> Any:
        """Return the result of the performance: a Reply, an Aside, or None."""
        return self.wait_for_message("done")[1]

    def look(self, painted: bool = False) -> Mapping[str, Any]:
        """Return what is shown to the participant after all inputs so far; with its picture if `painted`."""
        self.send_message("look", painted)
        seen: Mapping[str, Any] = self.wait_for_message("seen")[1]
        return seen

    def placed(self) -> dict[str, Placed]:
        """Return the elements on the screen by name."""
        return {element.name: element for element in self.look()["placed"]}

    def cpu_s(self) -> float:
        """Return the processor time that the process has used, in seconds."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def resident_MB(self) -> float:
        """Return the memory that the process holds, in 10^6 bytes."""
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@contextmanager
def process_on(display: str, arguments: Sequence[str], errors: IO[bytes] | None = None) -> Iterator[Stage]:
    """Start a Python process on a display, connected by pipes, and end it when the block ends."""
    scene = {**os.environ, "DISPLAY": display, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, env=scene
    ) as process:
        if process.stdout is None:
            raise StageError("the window's process has no output")
        stage = Stage(process, Link(process.stdout).listen())
        try:
            yield stage
        finally:
            _end(process)


@contextmanager
def stage_on(display: str, setting: Setting, *options: str, errors: IO[bytes] | None = None) -> Iterator[Stage]:
    """Open the window with a setting; `options` are Python's own, `errors` takes its error output."""
    with process_on(display, [*options, "-m", "benchmarks.window.stage"], errors) as stage:
        stage.send_message("open", setting)
        stage.wait_for_message("open")
        yield stage


def _end(process: subprocess.Popen[bytes]) -> None:
    """Close the pipe, which ends the process; kill a process that does not end."""
    if process.stdin is not None:
        with suppress(BrokenPipeError):
            process.stdin.close()
    try:
        process.wait(PATIENCE_S / 4)
    except subprocess.TimeoutExpired:
        process.kill()
