import os
import subprocess
import sys

import pytest

from benchmarks.window.display import virtual_display
from benchmarks.window.hand import Hand
from palpate.devices.window.calibration import read_calibration

pytestmark = pytest.mark.needs("psychopy", "xvfb")

VERB = "from palpate.devices.window.commands import window; window()"


@pytest.fixture(scope="module")
def display():
    with virtual_display(1280, 720) as opened:
        yield opened


def run(display, *arguments, typed=""):
    return subprocess.run(
        [sys.executable, "-c", VERB, *map(str, arguments)], input=typed, capture_output=True, text=True, check=False,
        env={**os.environ, "DISPLAY": display}, timeout=60,
    )  # fmt: skip


def test_a_screen_is_calibrated_by_what_the_ruler_reads(display, tmp_path):
    done = run(display, "calibrate", "--lab", tmp_path, "--width-mm", 320, typed="138.5\n127\n")
    calibration = read_calibration(tmp_path)
    drawn_px = round(127 * 1280 / 320)

    assert done.returncode == 0
    assert done.stderr == ""
    assert calibration.size_px == (1280, 720)
    assert calibration.px_per_mm == pytest.approx(drawn_px / 138.5)
    assert "corrected to" in done.stdout


def test_the_line_is_on_the_screen_while_the_terminal_waits(display, tmp_path):
    hand, before = Hand(display), None
    verb = subprocess.Popen(
        [sys.executable, "-c", VERB, "calibrate", "--lab", str(tmp_path)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, env={**os.environ, "DISPLAY": display},
    )  # fmt: skip
    with verb:
        output = b""
        while b"[127]" not in output:
            output += verb.stdout.read(1)
        before = hand.picture()
        verb.stdin.write(b"127.0\n")
        verb.stdin.close()
        assert verb.wait(30) == 0
    hand.close()

    row = before.convert("L").crop((0, 200, 1280, 420))
    dark = [x for x in range(1280) if min(row.crop((x, 0, x + 1, 220)).getdata()) < 80]
    assert max(dark) - min(dark) + 1 == pytest.approx(127 * 96 / 25.4, abs=1)


def test_a_reading_given_beforehand_needs_nobody(display, tmp_path):
    done = run(display, "calibrate", "--lab", tmp_path, "--measured", 127 * 96 / 25.4 / 4)

    assert done.returncode == 0
    assert read_calibration(tmp_path).px_per_mm == pytest.approx(4.0)


def test_check_agrees_with_the_screen_that_was_calibrated(display, tmp_path):
    run(display, "calibrate", "--lab", tmp_path, "--measured", 127)
    good = run(display, "check", "--lab", tmp_path)
    with virtual_display(1920, 1080) as other:
        bad = run(other, "check", "--lab", tmp_path)

    assert good.returncode == 0
    assert "a window can be opened here" in good.stdout
    assert bad.returncode == 1
    assert "PROBLEM      calibrated at 1280x720 px, the screen has 1920x1080" in bad.stdout
