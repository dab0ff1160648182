"""The renderer's window on a display of its own, with a real pointer and keyboard, playing on the actuator's twin."""

import os
import subprocess
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest

from benchmarks.window.display import virtual_display
from benchmarks.window.hand import Hand
from palpate.devices.render.texture_models import available
from palpate.devices.render.window.choice import Choice, beside, render_texts
from palpate.devices.render.window.elements import COURSE
from palpate.devices.render.window.screen import RendererScreen
from palpate.devices.render.window.view import RendererView
from palpate.devices.window.commands_calibrate import USUAL_PX_PER_MM
from palpate.devices.window.fonts import find_fonts
from palpate.devices.window.geometry import Metrics
from palpate.devices.window.screen import Page
from tests.devices.render.made import model, write

pytestmark = pytest.mark.needs("psychopy", "xvfb")

SIZE = (1280, 720)
PATIENCE_S = 90.0


class Window:
    """The window's process and a hand at it; what it plays is read from the course that it draws."""

    def __init__(self, hand, lab, process):
        self.hand, self.lab, self.process = hand, lab, process
        page = Page(Metrics(*SIZE, USUAL_PX_PER_MM), render_texts(), find_fonts())
        self.screen = RendererScreen(page, RendererView(page, available(lab)), Choice("cloth", "ar"))

    def box(self, name):
        return next(element.box for element in self.screen.placed() if element.name == name)

    def course(self):
        """How many of the course's columns leave the middle."""
        box = self.box("wave")
        seen = np.asarray(self.hand.picture(box.left, box.top, box.width, box.height)).astype(int)
        drawn = np.abs(seen - np.array(COURSE)).sum(axis=2) < 40
        middle = box.height // 2
        drawn[middle - 4 : middle + 5] = False
        return int(drawn.any(axis=0).sum())

    def chosen(self, name):
        """Whether a choice is shown as the one that is on."""
        box = self.box(name)
        pixel = self.hand.picture(box.left + 4, box.middle[1], 2, 2).getpixel((0, 0))
        return max(abs(a - b) for a, b in zip(pixel, COURSE, strict=True)) < 10

    def until(self, condition, meanwhile=lambda: None):
        limit = time.monotonic() + PATIENCE_S
        while not condition():
            if time.monotonic() > limit:
                self.hand.picture().save(self.lab / "seen.png")
                raise AssertionError(f"nothing came of it: {self.lab / 'seen.png'}")
            assert self.process.poll() is None, self.process.communicate()[1].decode()
            meanwhile()
            time.sleep(0.01)

    def stroke(self):
        """To and fro over the picture, once."""
        left, right = self.box("picture").left + 20, self.box("picture").right - 20
        y = self.box("picture").middle[1]
        steps = [left + (right - left) * place // 40 for place in range(41)]
        for x in (*steps, *reversed(steps)):
            self.hand.move(x, y)
            time.sleep(0.008)


@contextmanager
def window_on(display, lab):
    hand = Hand(display)
    command = [sys.executable, "-W", "error", "-m", "palpate", "render", "cloth", "--method", "ar", "--twins", "--lab",
               str(lab)]  # fmt: skip
    process = subprocess.Popen(command, env={**os.environ, "DISPLAY": display}, stderr=subprocess.PIPE)
    window = Window(hand, lab, process)
    try:
        window.until(lambda: hand.windows("Palpate"))
        yield window
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()
        hand.close()


@pytest.fixture
def lab(tmp_path):
    write(tmp_path / "models", model())
    write(tmp_path / "models", model(name="texture-rubber-ar", id="rubber", label="Rubber"))
    return tmp_path


def test_a_stroke_sounds_a_rest_is_silent_and_another_texture_is_chosen_by_hand(lab):
    with virtual_display(*SIZE) as display, window_on(display, lab) as window:
        window.until(lambda: window.chosen("texture cloth"))
        window.hand.move(*window.box("picture").middle)
        window.hand.press()
        window.until(lambda: window.course() > 100, window.stroke)
        window.hand.release()
        window.until(lambda: window.course() == 0)
        window.hand.click(*window.box("texture rubber").middle)
        window.screen.choose(Choice("rubber", "ar"))
        window.until(lambda: window.chosen("texture rubber"))
        window.hand.move(*window.box("picture").middle)
        window.hand.press()
        window.until(lambda: window.course() > 100, window.stroke)
        window.hand.release()
        before = beside(tuple(available(lab)), "rubber", -1)
        window.hand.key("left")
        window.screen.choose(window.screen.choice.of_texture(before, available(lab)))
        window.until(lambda: window.chosen(f"texture {before}"))
        window.hand.key("q")
        assert window.process.wait(PATIENCE_S) == 0, window.process.stderr.read().decode()
