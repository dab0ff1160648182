"""The designer's window on a display of its own, with a real pointer and keyboard, playing on the door's twin.

What it holds is read from the file that it keeps at every change; what it shows, from the display's pixels.
"""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from PIL import Image

from benchmarks.window.display import virtual_display
from benchmarks.window.hand import Hand
from palpate.devices.author.designs import KEPT, designs_folder, read_design
from palpate.devices.author.pages import RecoverScreen
from palpate.devices.author.screen import DesignerScreen
from palpate.devices.author.view import DesignerStatus, DesignerView
from palpate.devices.author.work import History, Work, neutral
from palpate.devices.door.link.device import Settings, make
from palpate.devices.window.commands_calibrate import USUAL_PX_PER_MM
from palpate.signals.doors.profile_file import read_profile
from tests.devices.author.fakes import FakeMaker
from tests.devices.author.windows_for_tests import page_for

pytestmark = pytest.mark.needs("psychopy", "xvfb")

SIZE = (1280, 720)
PATIENCE_S = 60.0
NEUTRAL = Work(neutral(7))


@dataclass
class Window:
    """The window's process, a hand at it, and the same screen painted here."""

    hand: Hand
    lab: Path
    process: subprocess.Popen

    def __post_init__(self):
        self.page = page_for(px_per_mm=USUAL_PX_PER_MM)
        self.view = DesignerView(self.page, FakeMaker())

    def until(self, condition):
        limit = time.monotonic() + PATIENCE_S
        while not (result := condition()):
            if time.monotonic() > limit:
                self.hand.picture().save(self.lab / "seen.png")
                raise AssertionError(f"nothing came of it: {self.lab / 'seen.png'}")
            assert self.process.poll() is None, "the window has ended"
            time.sleep(0.02)
        return result

    def saved(self):
        path = designs_folder(self.lab) / KEPT
        return json.loads(path.read_text()) if path.exists() else None

    def wishes(self):
        work = self.saved()
        return None if work is None else work["a" if work["on"] == "A" else "b"]["wish"]

    def expected(self, work, status=None):
        """The pixels that the window must show."""
        state = self.page.texts("state_rest", name=self.page.texts("twin"))
        screen = DesignerScreen(self.page, self.view, History(work))
        screen.show_status(status or DesignerStatus(door=state))
        image = Image.new("RGB", SIZE)
        screen.paint(image)
        return image

    def box(self, name, work):
        screen = DesignerScreen(self.page, self.view, History(work))
        return next(element.box for element in screen.placed() if element.name == name)

    def click(self, name, work):
        self.hand.click(*self.box(name, work).middle)

    def shows(self, work, status=None):
        """Return whether the display shows this door and this status."""
        expected, actual = self.expected(work, status), self.hand.picture()
        door = self.view.layout.door.grown(-3)
        part = (door.left, door.top, door.right, door.bottom)
        return actual.crop(part).tobytes() == expected.crop(part).tobytes()

    def asks_about_work(self):
        expected = Image.new("RGB", SIZE)
        RecoverScreen(self.page, "").paint(expected)
        return self.hand.picture().tobytes() == expected.tobytes()


@contextmanager
def window_on(display, lab):
    hand = Hand(display)
    command = [sys.executable, "-W", "error", "-m", "tests.devices.author.program", str(lab)]
    process = subprocess.Popen(command, env={**os.environ, "DISPLAY": display}, stderr=subprocess.PIPE)
    window = Window(hand, lab, process)
    try:
        window.until(lambda: hand.windows("Palpate"))
        yield window
    finally:
        process.kill()
        process.communicate()
        hand.close()


@pytest.fixture(scope="module")
def display():
    with virtual_display(*SIZE) as opened:
        yield opened


@pytest.fixture(scope="module")
def opened(display, tmp_path_factory):
    with window_on(display, tmp_path_factory.mktemp("lab")) as window:
        window.until(lambda: window.shows(NEUTRAL))
        yield window


@pytest.fixture
def window(opened):
    """The one window of the module, with every wish in the middle again."""
    opened.click("reset", NEUTRAL)
    opened.until(lambda: opened.shows(NEUTRAL))
    return opened


def drag_all(window, values):
    """Every slider dragged from the middle to a value, by way of both ends."""
    for number, value in enumerate(values):
        slider = window.view.slider(NEUTRAL, number)
        x = slider.box.middle[0]
        window.hand.drag([(x, slider.row(position)) for position in (50, 0, 100, value)])
    window.until(lambda: window.wishes() == [float(value) for value in values])
    return NEUTRAL.put(type(neutral(7))(tuple(map(float, values))))


def test_every_slider_is_dragged_compared_undone_saved_and_exported(window):
    values = (20, 35, 50, 65, 80, 5, 95)
    work = drag_all(window, values)
    window.until(lambda: window.shows(work))

    window.hand.key("u")
    window.until(lambda: window.wishes() == [*values[:6], 50.0])
    window.hand.key("r")
    window.until(lambda: window.wishes() == list(values))

    window.click("compare", work)
    window.until(lambda: window.saved()["on"] == "B")
    window.click("side A", work.compared())
    window.until(lambda: window.saved()["on"] == "A")
    window.hand.key("c")
    window.until(lambda: window.saved()["b"] is None)

    window.hand.key("s")
    window.until(lambda: not window.shows(work))
    for letter in "first":
        window.hand.key(letter)
    window.hand.key("enter")
    saved = designs_folder(window.lab) / "first.json"
    window.until(saved.exists)
    assert list(read_design(saved).wish.values()) == list(values)

    window.until(lambda: window.saved()["name"] == "first")
    window.hand.key("e")
    exported = designs_folder(window.lab) / "first.csv"
    window.until(exported.exists)
    door = make("door", Settings(kind="door", driver="twin"), window.lab)
    assert door.check(read_profile(exported), "first").end_deg == 62.0


def test_the_keyboard_alone_makes_a_door(window):
    for key in ("right", "up", "right", "pageup", "right", "end", "right", "home"):
        window.hand.key(key)
    window.until(lambda: window.wishes() == [51, 60, 100, 0, 50, 50, 50])


def test_the_door_is_played_on_the_twin_and_brought_back(window):
    work = drag_all(window, (60, 50, 40, 50, 50, 50, 50))
    texts = window.page.texts
    window.hand.key("p")
    rest = texts("state_rest", name=texts("twin"))
    window.until(lambda: window.shows(work, DesignerStatus(notice=texts("played"), door=rest)))
    window.hand.key("p")
    playing = texts("state_playing", name=texts("twin"))
    stop = window.box("play", work)

    def says_stop():
        pixels = window.expected(work, DesignerStatus(door=playing, play="stop"))
        part = (stop.left, stop.top, stop.right, stop.bottom)
        return window.hand.picture().crop(part).tobytes() == pixels.crop(part).tobytes()

    window.until(says_stop)
    window.hand.click(*stop.middle)
    window.until(lambda: window.shows(work, DesignerStatus(notice=texts("stopped"), door=rest)))


@pytest.fixture
def other_display():
    with virtual_display(*SIZE) as opened:
        yield opened


def test_a_killed_window_loses_nothing_and_offers_it_again(other_display, tmp_path):
    display = other_display
    with window_on(display, tmp_path) as window:
        window.until(lambda: window.shows(NEUTRAL))
        work = drag_all(window, (70, 50, 50, 50, 50, 50, 30))
        os.kill(window.process.pid, signal.SIGKILL)
        window.process.wait(PATIENCE_S)
    with window_on(display, tmp_path) as again:
        again.until(again.asks_about_work)
        again.hand.key("enter")
        again.until(lambda: again.shows(work))
        again.hand.key("q")
        assert again.process.wait(PATIENCE_S) == 0 and again.process.stderr.read() == b""
        assert again.wishes()[0] == 70
