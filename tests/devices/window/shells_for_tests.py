"""A shell without a window, on a clock of its own, and a desk without an experimenter."""

from collections import deque
from dataclasses import dataclass, field, replace

from palpate.devices.window.fonts import find_fonts
from palpate.devices.window.geometry import Metrics
from palpate.devices.window.screen import Page
from palpate.devices.window.texts import load_texts
from palpate.protocols.events import NS

FRAME_S = 0.01
SIZE = (1280, 720)


@dataclass
class FakeShell:
    """Inputs are played in turns: one list of inputs for each look at the window; then `after` is done, if anything."""

    turns: deque = field(default_factory=deque)
    size: tuple = SIZE
    renderer: str = "none"
    clock_s: float = 100.0
    shown: list = field(default_factory=list)
    forgotten: int = 0
    closed: bool = False
    rests: int = 0

    def now_s(self):
        return self.clock_s

    def gather(self):
        self.clock_s += FRAME_S
        if not self.turns:
            return []
        turn = self.turns.popleft()
        return [replace(input_event, t_s=self.clock_s) for input_event in turn]

    def forget(self):
        self.forgotten += 1

    def show(self, picture, boxes):
        self.shown.append((picture.copy(), tuple(boxes)))

    def rest(self, seconds):
        self.rests += 1
        self.clock_s += seconds

    def close(self):
        self.closed = True

    def now_ns(self):
        """Session time: the shell's clock, from a beginning of its own."""
        return round((self.clock_s - 60.0) * NS)


@dataclass
class FakeDesk:
    """Asides and answers come at the looks at the desk that they are listed for, counted from 1."""

    asides: dict = field(default_factory=dict)
    answers: deque = field(default_factory=deque)
    looks: int = 0
    demands: list = field(default_factory=list)
    statuses: list = field(default_factory=list)

    def poll(self):
        self.looks += 1
        return self.asides.pop(self.looks, None)

    def demand(self, prompt):
        if not self.demands or self.demands[-1] != prompt:
            self.demands.append(prompt)

    def answer(self):
        return self.answers.popleft() if self.answers and self.demands[-1] is not None else None

    def tell(self, state):
        self.statuses.append(dict(state))


def page(language="en", **more):
    return Page(Metrics(*SIZE, 3.6), load_texts(language), find_fonts(language), **more)


def do(room, *inputs):
    """Give an app its inputs, each in a turn of its own."""
    for input_event in inputs:
        room.shell.turns.append([input_event])
        room.turn()
    room.turn()
