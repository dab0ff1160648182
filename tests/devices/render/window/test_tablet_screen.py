"""The tablet's screen: the picture is as large as the sample, where the rig file says, and gone when it should be."""

import os

import numpy as np
import pytest
from PIL import Image

from benchmarks.window.display import virtual_display
from benchmarks.window.hand import Hand
from palpate.devices.render.window.photo import PICTURES
from palpate.devices.render.window.tablet_screen import GROUND, Canvas, TabletScreen
from palpate.devices.tablet.device import Display
from palpate.signals.textures.sounds import RenderError
from tests.devices.window.shells_for_tests import FakeShell

CLOTH = PICTURES / "cloth.jpg"


def extent(picture):
    """(left, top, width, height) in px of what is not the ground."""
    seen = np.argwhere(np.abs(np.asarray(picture.convert("RGB")).astype(int) - GROUND).sum(axis=2) > 40)
    if not len(seen):
        return None
    (top, left), (bottom, right) = seen.min(axis=0), seen.max(axis=0)
    return left, top, right - left + 1, bottom - top + 1


@pytest.mark.parametrize(
    ("px_per_mm", "middle", "expected"),
    [
        (4.0, (640, 360), (440, 160, 400, 400)),
        (2.5, (300, 200), (175, 75, 250, 250)),
        (9.0, (640, 360), (190, 0, 901, 720)),  # no room for all of it: its middle
    ],
)
def test_a_millimetre_of_the_sample_is_a_millimetre_of_the_screen(px_per_mm, middle, expected):
    shell = FakeShell()
    canvas = Canvas(shell, Image.new("RGB", shell.size, "white"), px_per_mm, middle)
    canvas.show(CLOTH)
    assert np.allclose(extent(shell.shown[-1][0]), expected, atol=2)
    canvas.show(None)
    assert extent(shell.shown[-1][0]) is None


@pytest.mark.long
@pytest.mark.needs("psychopy", "xvfb")
def test_the_window_shows_the_picture_and_lets_it_go(tmp_path, monkeypatch):
    with virtual_display(1280, 720) as display:
        monkeypatch.setenv("DISPLAY", display)
        hand = Hand(display)
        with TabletScreen(Display(number=0, px_per_mm=4.0, middle_mm=(100.0, 90.0))) as screen:
            assert extent(hand.picture()) is None
            screen.show(CLOTH)
            shot = hand.picture()
            assert np.allclose(extent(shot), (200, 160, 400, 400), atol=2)
            shot.save(os.environ.get("PALPATE_SHOT", tmp_path / "shot.png"))
            with pytest.raises(RenderError, match=r"no\.png: cannot be read as a picture"):
                screen.show(tmp_path / "no.png")
            screen.show(None)
            assert extent(hand.picture()) is None
        with pytest.raises(RenderError, match="not open"):
            screen.show(None)
        with pytest.raises(RenderError, match="there is no screen 3"):
            TabletScreen(Display(number=3, px_per_mm=4.0)).__enter__()
        hand.close()
