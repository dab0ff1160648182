import time
from contextlib import contextmanager
from dataclasses import dataclass

import pytest

from benchmarks.window.display import virtual_display
from benchmarks.window.hand import Hand
from benchmarks.window.stage import Setting
from benchmarks.window.stagehand import Stage, stage_on
from palpate.devices.window.calibration import Calibration
from palpate.devices.window.geometry import Metrics, problems
from palpate.protocols.events import Aside
from tests.devices.window.real.forms import KOREAN, STUDY

SIZE = (1280, 720)
CALIBRATION = Calibration(SIZE, 3.6, 0, "2026-11-21T10:00:00+00:00")
SETTING = Setting(STUDY, CALIBRATION, fullscreen=True)
PATIENCE_S = 20.0


@dataclass
class Theatre:
    """The real window in a process of its own, on a display of its own, and a hand at its mouse and keyboard."""

    display: str
    hand: Hand
    stage: Stage

    def put_on(self, request):
        """The elements of the request's screen by name, once it is before the participant."""
        self.stage.put_on(request)
        return self.stage.placed()

    def picture(self):
        """What the display shows, what was painted, and what is wrong with the layout."""
        seen = self.stage.look(painted=True)
        return self.hand.picture(), seen["picture"], problems(seen["placed"], Metrics(*SIZE, CALIBRATION.px_per_mm))

    def keys(self, *strokes):
        for stroke in strokes:
            self.hand.key(*stroke)

    def aside(self, **value):
        """The experimenter does something; it comes back as an aside."""
        self.stage.send_message("aside", value)
        assert self.stage.result() == Aside(value)

    def on_again(self):
        """The request that was broken into is performed on."""
        self.stage.send_message("perform again")
        self.stage.wait_for_message("shown")

    def leave(self):
        """What is on is taken off unanswered."""
        self.aside(do="abort", text="test")

    def until(self, condition):
        """Wait, within bounds, for something that another process brings about."""
        limit = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < limit, "nothing came of it"
            time.sleep(0.01)


@contextmanager
def theatre_of(setting=SETTING, size=SIZE, errors=None):
    with virtual_display(*size) as display:
        hand = Hand(display)
        hand.add_keys_for("".join(KOREAN) + "é")
        try:
            with stage_on(display, setting, "-W", "error", errors=errors) as stage:
                yield Theatre(display, hand, stage)
        finally:
            hand.close()


@pytest.fixture(scope="module")
def theatre():
    """One window for the tests of a module; each takes off what it put on."""
    with theatre_of() as opened:
        yield opened
