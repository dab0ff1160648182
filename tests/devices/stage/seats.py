"""A desk and a window for tests of devices: virtual time, scripted confirmations and asides."""

from collections.abc import Callable
from dataclasses import dataclass, field

from palpate.protocols.plan import compile_plan
from palpate.protocols.trial import ParticipantRow
from tests.protocols.studies_for_tests import toy

TURN_NS = 50_000_000
STIMULI = [
    {"id": "T07", "columns": {"material": "sandpaper P60", "position": "box 3"}},
    {"id": "T12", "columns": {"material": "cork", "barcode": "8801234567893"}},
]


def trial_of(stimulus):
    study = toy(needs=["samples", "window"], stimuli=STIMULI, simulation={"latents": {}}, rest=None)
    plan = compile_plan(study, ParticipantRow("P001"))
    return next(trial for trial in plan.trials if trial.stimulus.id == stimulus)


@dataclass
class Clock:
    t_ns: int = 0

    def __call__(self):
        return self.t_ns


@dataclass
class Desk:
    """`confirms` are the seconds after each new demand when it is confirmed; a text is typed instead of a key."""

    confirms: list = field(default_factory=list)
    asides: list = field(default_factory=list)
    typed: str | None = None
    clock: Clock | None = None
    demands: list = field(default_factory=list)
    statuses: dict = field(default_factory=dict)
    standing: object = None
    demanded_ns: int = 0

    def poll(self):
        return self.asides.pop(0) if self.asides else None

    def demand(self, prompt):
        if prompt == self.standing:
            return
        self.standing = prompt
        if prompt is not None:
            self.demands.append(prompt.text)
            self.demanded_ns = None

    def answer(self):
        if self.typed is not None:
            typed, self.typed = self.typed, None
            return typed
        if self.standing is None or not self.confirms or self.clock is None:
            return None
        if self.demanded_ns is None:
            self.demanded_ns = self.clock.t_ns
        if self.clock.t_ns - self.demanded_ns >= self.confirms[0] * 1e9:
            self.confirms.pop(0)
            self.standing = None
            return True
        return None

    def tell(self, state):
        self.statuses.update(state)


@dataclass
class Window:
    """Shows pages in virtual time; gives up after a minute, so that a test that hangs fails."""

    clock: Clock
    each_turn: Callable[[], None] = lambda: None
    pages: list = field(default_factory=list)

    def wait_for(self, key, desk, ready):
        getattr(desk, "desk", desk).clock = self.clock
        self.pages.append(key)
        for _ in range(round(60e9 / TURN_NS)):
            if aside := desk.poll():
                return aside
            if ready():
                return None
            self.clock.t_ns += TURN_NS
            self.each_turn()
        raise AssertionError(f"the page {key} never ended")
