"""The loop at 1 kHz: hand, voice, actuator; it never waits for anything but its clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from palpate.devices.render.deadlines import Deadlines
from palpate.devices.render.hands import Hand
from palpate.devices.render.pace import Pace
from palpate.devices.render.sinks import Sink

STEP_NS = 1_000_000
NEVER = 2**62
"""Milliseconds that nobody plays to the end."""


class Steps(Protocol):
    """What gives the next sample: a renderer, or a voice."""

    def step(self, speed_mm_s: float, force_N: float) -> float:
        """The next sample in m/s^2."""


class Watches(Protocol):
    """Who is told of every sample that was made."""

    def note(self, acceleration_m_s2: float, speed_mm_s: float, force_N: float) -> None:
        """One sample, and what it was made for."""


class Nobody:
    """Looks on."""

    def note(self, acceleration_m_s2: float, speed_mm_s: float, force_N: float) -> None:
        """Nothing."""


@dataclass
class Loop:
    """One turn each millisecond fills the sink's room. After a stall one turn makes up for all that was missed, a
    sample written as soon as it is made: where the turn itself is held up, what it made so far is played.

    `ready` counts from when a step was due to when it was written, `woken` to when its turn began.
    """

    render: Steps
    hand: Hand
    sink: Sink
    pace: Pace
    watch: Watches = field(default_factory=Nobody)
    ready: Deadlines = field(default_factory=Deadlines)
    woken: Deadlines = field(default_factory=Deadlines)
    made: int = 0
    _due_ns: int = 0

    def begin(self) -> None:
        """Fill the sink; the first step is due in a millisecond."""
        self.sink.write([self._next() for _ in range(self.sink.free())])
        self._due_ns = self.pace.now_ns() + STEP_NS

    def turn(self) -> None:
        """Wait for the next step and do it, with all those that are due by then."""
        pace, due_ns = self.pace, self._due_ns
        pace.until(due_ns)
        woken_ns = pace.now_ns()
        self._fill()
        now_ns = pace.now_ns()
        self.woken.note(woken_ns - due_ns)
        self.ready.note(now_ns - due_ns)
        due_ns += STEP_NS
        while due_ns + STEP_NS <= now_ns:
            # Its successor is due as well: this one has been made up for.
            self.woken.skip(woken_ns - due_ns if woken_ns > due_ns else 0)
            self.ready.skip(now_ns - due_ns)
            due_ns += STEP_NS
        self._due_ns = due_ns

    def run(self, steps: int, ended: Callable[[], bool] = lambda: False) -> None:
        """So many milliseconds, or until it has ended."""
        self.begin()
        while self.ready.steps < steps and not ended():
            self.turn()

    def _fill(self) -> None:
        for _ in range(self.sink.free()):
            self.sink.write((self._next(),))

    def _next(self) -> float:
        speed, force = self.hand.at(self.made)
        made = self.render.step(speed, force)
        self.watch.note(made, speed, force)
        self.made += 1
        return made
