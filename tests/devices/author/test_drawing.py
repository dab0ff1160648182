"""What is drawn is what is made: the line, its axes, the range behind it, and the words of every language."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks.doors.designer_window import line_error_px, painted_s
from palpate.devices.author.elements import FEELS, SIDES
from palpate.devices.author.plotter import FILE, range_text, rated_range
from palpate.devices.author.view import FOLDER, author_texts
from palpate.devices.author.work import Work, neutral
from palpate.devices.window.geometry import Box, Metrics, WindowError, problems
from palpate.devices.window.paint import CARD, GROUND, contrast
from palpate.devices.window.plot import axes_for, line_mask
from palpate.devices.window.texts import placeholders, read_words
from palpate.signals.doors.profile_file import read_profile
from tests.devices.author.fakes import FakeMaker
from tests.devices.author.windows_for_tests import open_author, page_for, typed, wish

PROFILES = Path(__file__).parents[3] / "studies" / "door_ratings" / "profiles"
BOX = Box(0, 0, 700, 400)


@pytest.mark.parametrize("door", ["BC3_g0", "FORD_g0", "MQ4_g0"])
def test_the_line_lies_on_the_profile(door):
    assert line_error_px(np.array(read_profile(PROFILES / f"{door}.csv")), (1920, 1080)) < 1.0


def test_the_line_reaches_the_peaks_and_no_further():
    force = np.zeros(621)
    force[300:320] = 45.0
    axes = axes_for(BOX, force)
    first, mask = line_mask(force, axes, 3.0)
    touched = np.flatnonzero(mask.max(axis=1)) + first
    assert abs(touched.min() - axes.y(45.0)) <= 2 and abs(touched.max() - axes.y(0.0)) <= 2


@pytest.mark.parametrize("force", [np.zeros(621), np.full(621, 60.0), np.linspace(-60, 60, 621)])
def test_axes_hold_every_possible_profile_in_whole_steps(force):
    axes = axes_for(BOX, force)
    assert axes.low_N <= min(-20.0, force.min()) and axes.high_N >= max(50.0, force.max())
    assert axes.forces_N[0] == axes.low_N and axes.forces_N[-1] == axes.high_N and 0.0 in axes.forces_N
    assert axes.y(axes.high_N) == BOX.top and axes.y(axes.low_N) == BOX.bottom - 1
    assert line_mask(force, axes, 3.0)[1].max() == 255


def test_the_range_behind_is_that_of_the_rated_doors():
    profiles = np.array([read_profile(path) for path in sorted(PROFILES.glob("*.csv"))])
    assert FILE.read_text(encoding="utf-8") == range_text(profiles)
    least, most = rated_range()
    assert (least <= profiles.min(axis=0) + 0.01).all() and (most >= profiles.max(axis=0) - 0.01).all()


@pytest.mark.needs("fonts")
@pytest.mark.parametrize(("size", "px_per_mm"), [((1280, 720), 3.6), ((1920, 1080), 3.78), ((1366, 768), 4.0),
                                                 ((1920, 1200), 3.7), ((3840, 2160), 7.0)])  # fmt: skip
@pytest.mark.parametrize("language", ["en", "ko"])
def test_nothing_overlaps_or_is_cut_on_any_screen_in_any_language(size, px_per_mm, language):
    from palpate.devices.author.screen import DesignerScreen
    from palpate.devices.author.view import DesignerStatus, DesignerView
    from palpate.devices.author.work import History

    page = page_for(language, size, px_per_mm)
    begin = Work(neutral(7))
    for work in (begin, begin.put(neutral(7).wished(0, 100)).compared().put(neutral(7).wished(6, 0))):
        for play in ("play", "stop", "confirm"):
            screen = DesignerScreen(page, DesignerView(page, FakeMaker()), History(work))
            screen.show_status(DesignerStatus(door=page.texts("state_playing", name=page.texts("twin")), play=play))
            assert problems(screen.placed(), Metrics(*size, px_per_mm)) == []


def test_only_what_changed_is_painted_and_it_is_what_a_whole_painting_gives(tmp_path):
    room = open_author(tmp_path)
    room.shell.shown.clear()
    wish(room, 2, 83)
    typed(room, "c")
    wish(room, 4, 20)
    boxes = [box for _, touched in room.shell.shown for box in touched]
    assert boxes and all(box.width * box.height < 0.6 * 1280 * 720 for box in boxes)
    whole = Image.new("RGB", (1280, 720))
    room.main.repaint()
    room.main.paint(whole)
    assert whole.tobytes() == room.picture.tobytes()


@pytest.mark.needs("fonts")
def test_a_move_is_drawn_well_within_a_frame_on_an_ordinary_day():
    seconds = painted_s(FakeMaker(), (1280, 720), 60)
    assert np.median(seconds) < 0.1, "twenty times as slow as measured: something is painted that need not be"


def test_every_colour_can_be_read():
    assert all(contrast(colour, ground) >= 4.5 for colour in (FEELS, *SIDES.values()) for ground in (CARD, GROUND))


def test_every_language_has_the_same_keys_and_placeholders():
    english = read_words(FOLDER / "en.yaml")
    for file in FOLDER.glob("*.yaml"):
        words = read_words(file)
        assert list(words) == list(english), file
        assert {key for key in words if placeholders(words[key]) != placeholders(english[key])} == set(), file
    with pytest.raises(WindowError, match="no texts in language 'fr'"):
        author_texts("fr")


def test_the_command_imports_neither_a_window_nor_arrays_to_say_how_it_is_used():
    program = (
        "import sys\nfrom palpate.devices.author.commands import author\n"
        "author(['--help'], standalone_mode=False)\n"
        "print(sorted({'numpy', 'psychopy', 'PIL', 'torch'} & set(sys.modules)))"
    )
    finished = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert finished.stdout.rstrip().endswith("[]") and "seven sliders" in finished.stdout
