"""Figures to reach for the participant's window in a session: the first question, and an answer on disk."""

from __future__ import annotations

import os
import random
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from tempfile import TemporaryDirectory

from benchmarks.window.display import missing, virtual_display
from benchmarks.window.hand import Hand
from benchmarks.window.screens import cases as window_cases
from benchmarks.window.stagehand import Stage, process_on
from palpate.protocols.bench import Case

SIZE, PX_PER_MM = (1920, 1080), 3.6
ANSWERS, ANSWERS_QUICK = 400, 200
BARE = """
import sys
from psychopy import visual
window = visual.Window(({}, {}), fullscr=True, winType="pyglet", units="pix", allowGUI=False, checkTiming=False)
window.flip()
sys.stdout.write("shown"); sys.stdout.flush(); sys.stdin.read(1)
window.close()
""".format(*SIZE)
"""A program with a PsychoPy window, its first frame, and nothing else."""


def cases(quick: bool) -> Iterator[Case]:
    """Yield every figure of the window, those without a session first."""
    yield from window_cases(quick)
    if missing():
        return
    with virtual_display(*SIZE) as display:
        starts = Starts(display)
        pairs = 3 if quick else 9
        yield _first_frame("PsychoPy alone", starts.bare, lambda _seconds: 1.0)
        yield _first_frame("palpate, a session", starts.session, lambda _seconds: starts.ratio(pairs))
        yield _on_disk(display, ANSWERS_QUICK if quick else ANSWERS)


def _first_frame(method: str, run: Callable[[], float], error: Callable[[float], float]) -> Case:
    return Case("window", "first frame", method, "a whole process, to its end", 1, "times a bare window", run, error, 3)


@dataclass(frozen=True)
class Starts:
    """Processes timed from their start to their first frame: a bare window, and a session's first question."""

    display: str

    def bare(self) -> float:
        """Return the seconds until a bare window's first frame."""
        start = time.perf_counter()
        with _bare_process(self.display) as process:
            return _seconds_until_shown(process, start)

    def session(self) -> float:
        """Return the seconds until the first question of a session of door_ratings with its own ledger."""
        start = time.perf_counter()
        with session_on(self.display) as stage:
            stage.wait_for_message("shown")
            return time.perf_counter() - start

    def ratio(self, pairs: int) -> float:
        """Return the ratio of a session's time to a bare window's: the median of `pairs` pairs."""
        return statistics.median(self.session() / self.bare() for _ in range(pairs))


@contextmanager
def _bare_process(display: str) -> Iterator[subprocess.Popen[bytes]]:
    command, pipe = [sys.executable, "-c", BARE], subprocess.PIPE
    scene = {**os.environ, "DISPLAY": display}
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, env=scene) as process:
        try:
            yield process
        finally:
            process.kill()


def _seconds_until_shown(process: subprocess.Popen[bytes], start: float) -> float:
    if process.stdout is None or process.stdout.read(5) != b"shown":
        raise OSError("a bare PsychoPy window could not be opened")
    return time.perf_counter() - start


@contextmanager
def session_on(display: str) -> Iterator[Stage]:
    """Start a process with a session of door_ratings in the real window, with the real runner and ledger."""
    with (
        TemporaryDirectory() as lab,
        process_on(display, ["-m", "benchmarks.window.session", lab, *map(str, SIZE), str(PX_PER_MM)]) as stage,
    ):
        yield stage


def _on_disk(display: str, count: int) -> Case:
    """Return the case of the 99th percentile of the time until an answer is on disk, as its error in milliseconds."""
    return Case("window", "Next released, answer on disk", "palpate, XTEST to commit",
                f"{count} answers, the 99th percentile", count, "ms",
                lambda: slow_ms(display, count), float, 1)  # fmt: skip


def slow_ms(display: str, count: int) -> float:
    """Return the 99th percentile, in ms, of the time from the button's release at the X server to the commit."""
    hand = Hand(display)
    took: list[float] = []
    try:
        while len(took) < count:
            with session_on(display) as stage:
                took += _one_session(stage, hand, count - len(took))
    finally:
        hand.close()
    return statistics.quantiles(took, n=100)[98]


def _one_session(stage: Stage, hand: Hand, most: int) -> list[float]:
    """Answer every trial with taps; return the milliseconds of each. The press of Next is drawn before its release."""
    took, chance = [], random.Random(1)
    trials = stage.wait_for_message("trials")[1]
    for _ in range(min(most, trials)):
        stage.wait_for_message("shown")
        placed = stage.placed()
        for name, element in placed.items():
            if name.endswith(".line"):
                hand.tap(element.box.left + chance.random() * element.box.width, element.box.middle[1])
        hand.move(*placed["next"].box.middle)
        hand.press()
        stage.look()
        released_ns = time.monotonic_ns()
        hand.release()
        took.append((stage.wait_for_message("on disk")[1] - released_ns) / 1e6)
    return took
