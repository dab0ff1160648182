"""What is shown is what stands before the eye, whether only what changed is copied there or all of it is flipped."""

import subprocess
import sys
from types import SimpleNamespace

import pytest
from PIL import Image

from benchmarks.window.display import virtual_display
from benchmarks.window.hand import Hand
from palpate.devices.window.shell import copier
from tests.devices.window.real.conftest import SIZE

pytestmark = pytest.mark.needs("psychopy", "xvfb")

SHOWN = """
import sys
from PIL import Image
from palpate.devices.window.calibration import Calibration
from palpate.devices.window.geometry import Box
from palpate.devices.window.shell import open_shell
way, file = sys.argv[1:]
shell = open_shell(Calibration((1280, 720), 3.6, 0, "2026-11-21T10:00:00"), 0, True)
software = shell.copy is not None
if way == "flip":
    shell.copy = None
across, down = (Image.linear_gradient("L").rotate(turn).resize(shell.size) for turn in (0, 90))
picture = Image.merge("RGB", (across, down, Image.new("L", shell.size, 40)))
shell.show(picture, [Box(0, 0, *shell.size)])
for turn in range(3):
    boxes = [Box(30 + turn, 41, 201, 99), Box(700, 300 + turn, 77, 33), Box(1200, 650, 300, 300)]
    for box in boxes:
        picture.paste((250 - turn, 10, 90 + turn), (box.left, box.top, box.right, box.bottom))
    shell.show(picture, boxes)
shell.show(picture, [])
picture.save(file)
print(software, flush=True)
sys.stdin.read()
shell.close()
"""


@pytest.fixture(scope="module")
def display():
    with virtual_display(*SIZE) as opened:
        yield opened


@pytest.mark.parametrize("way", ["copy", "flip"])
def test_each_pixel_is_the_one_that_was_painted(display, way, tmp_path, monkeypatch):
    monkeypatch.setenv("DISPLAY", display)
    program = subprocess.Popen(
        [sys.executable, "-W", "error", "-c", SHOWN, way, str(tmp_path / "painted.png")],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip
    with program:
        line, hand = program.stdout.readline(), Hand(display)
        seen = hand.picture()
        hand.close()
        program.stdin.close()
        assert program.wait(30) == 0

    assert line == b"True\n", "a virtual display draws with the processor"
    assert seen.tobytes() == Image.open(tmp_path / "painted.png").tobytes()


@pytest.mark.parametrize(
    ("renderer", "handle"),
    [("NVIDIA GeForce RTX 4060/PCIe/SSE2", SimpleNamespace(_x_display=1)), ("llvmpipe", SimpleNamespace())],
)
def test_a_graphics_card_flips_and_so_does_a_window_system_that_cannot_copy(renderer, handle):
    assert copier(handle, renderer, 720) is None
