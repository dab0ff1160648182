import os
import signal
import subprocess
import sys
from dataclasses import replace

import pytest

from benchmarks.window.display import virtual_display
from benchmarks.window.hand import Hand
from benchmarks.window.stagehand import StageError, stage_on
from palpate.devices.desk import Prompt
from palpate.protocols.events import Aside, Confirm, Reply
from tests.devices.window.real.conftest import CALIBRATION, SETTING, theatre_of
from tests.devices.window.real.forms import FORMS, ask

pytestmark = pytest.mark.needs("psychopy", "xvfb")

NAMES = FORMS["sliders"].items()
OPEN_ONE = """
import sys
from pathlib import Path
from palpate.devices.window.calibration import Calibration
from palpate.devices.window.presenter_window import open_presenter
from tests.devices.window.real.forms import STUDY
try:
    open_presenter(STUDY, Calibration((1280, 720), 3.6, int(sys.argv[1]), "2026-11-21T10:00:00"), "en", Path()).close()
except ValueError as error:
    print(type(error).__name__, error)
"""


def message(theatre, *numbers):
    """Send the window's own client a message of the window manager's."""
    from Xlib import X
    from Xlib.protocol.event import ClientMessage

    [window] = theatre.hand.windows("Palpate")
    atoms = [theatre.hand.display.intern_atom(number) if isinstance(number, str) else number for number in numbers]
    data = (32, [*atoms, X.CurrentTime, 0, 0, 0, 0][:5])
    protocols = theatre.hand.display.intern_atom("WM_PROTOCOLS")
    window.send_event(ClientMessage(window=window, client_type=protocols, data=data))
    theatre.hand.display.sync()


def test_a_pause_covers_the_form_and_stops_its_time(theatre):
    placed = theatre.put_on(ask("sliders"))
    theatre.hand.tap(*placed["slider 0.line"].box.middle)
    form, _, _ = theatre.picture()
    theatre.aside(do="pause")
    theatre.on_again()
    pause, painted, wrong = theatre.picture()
    for row in range(len(NAMES)):
        theatre.hand.tap(*placed[f"slider {row}.line"].box.middle)
    theatre.until(lambda: theatre.stage.look()["seconds"] > 1.5)
    theatre.aside(do="go_on")
    theatre.on_again()
    again, _, _ = theatre.picture()
    seen = theatre.stage.look()
    theatre.leave()

    assert pause.tobytes() == painted.tobytes() != form.tobytes()
    assert wrong == []
    assert again.tobytes() == form.tobytes()
    assert seen["on"] == "sliders"
    assert seen["seconds"] < 1.5


def test_the_participant_cannot_close_the_window(theatre):
    placed = theatre.put_on(ask("suggestions"))
    message(theatre, "WM_DELETE_WINDOW")
    theatre.keys(("alt", "f4"), ("escape",))
    theatre.stage.look()
    theatre.hand.click(*placed["next"].box.middle)

    assert theatre.stage.result().value["answers"] == {"words": []}


def test_a_window_that_was_covered_is_drawn_again(theatre):
    theatre.put_on(ask("likert"))
    before, _, _ = theatre.picture()
    root = theatre.hand.display.screen().root
    other = root.create_window(100, 100, 600, 400, 0, 24, background_pixel=0xFF0000)
    other.map()
    theatre.until(lambda: theatre.hand.picture(300, 300, 1, 1).getpixel((0, 0)) == (255, 0, 0))
    other.destroy()
    theatre.hand.display.sync()

    theatre.until(lambda: theatre.hand.picture().tobytes() == before.tobytes())
    theatre.leave()


def test_the_ruler_confirms_what_is_drawn(theatre):
    theatre.put_on(Confirm("calibration"))
    prompt = theatre.stage.look()["prompt"]
    ruler = theatre.stage.placed()["ruler"].box
    theatre.stage.send_message("give", 127.3)

    assert prompt.kind == "number"
    assert ruler.width == CALIBRATION.metrics.mm(127.0)
    assert theatre.stage.result() == Reply({"measured_mm": 127.3, "nominal_mm": 127.0})


def test_a_page_is_shown_until_something_else_is_ready(theatre):
    theatre.stage.send_message("wait for", "changing_sample")
    theatre.stage.wait_for_message("shown")
    assert theatre.stage.look()["on"] == "changing_sample"
    theatre.aside(do="note", text="box 3 is empty")
    theatre.stage.send_message("wait for", "changing_sample")
    theatre.stage.send_message("ready")

    assert theatre.stage.result() is None


def test_the_last_page_waits_for_the_experimenter(theatre):
    theatre.stage.send_message("finish")
    seen = theatre.stage.look()
    theatre.stage.send_message("give", True)

    assert seen["on"] == "end"
    assert isinstance(seen["prompt"], Prompt)
    assert theatre.stage.result() is None


@pytest.mark.parametrize("fullscreen", [True, False])
def test_a_window_of_another_size_ends_the_run_and_says_why(fullscreen):
    with theatre_of(replace(SETTING, fullscreen=fullscreen)) as theatre:
        theatre.put_on(ask("sliders"))
        [window] = theatre.hand.windows("Palpate")
        window.configure(width=1000, height=700)
        theatre.hand.display.sync()

        with pytest.raises(StageError, match="opened at 1280x720 px and now has 1000x700.*palpate resume"):
            theatre.stage.result()
        assert theatre.stage.process.wait(20) == 0
        assert theatre.hand.windows("Palpate") == []


def test_a_screen_of_another_size_than_calibrated_is_refused_before_anything_is_shown():
    with (
        virtual_display(1920, 1080) as display,
        pytest.raises(StageError, match="calibrated at 1280x720 px, the screen has 1920x1080"),
        stage_on(display, SETTING),
    ):
        pass


@pytest.mark.parametrize(
    ("display", "screen", "message"),
    [
        ("", 0, "WindowError no display: DISPLAY is not set"),
        (":77123", 0, "WindowError no display can be reached"),
        (None, 3, "WindowError there is no screen 3; there are 0: 1280x720"),
    ],
)
def test_what_keeps_the_window_from_opening_is_reported_and_nothing_else(display, screen, message, tmp_path):
    with virtual_display(1280, 720) as real:
        done = subprocess.run(
            [sys.executable, "-c", OPEN_ONE, str(screen)], capture_output=True, text=True, check=True,
            env={**os.environ, "DISPLAY": real if display is None else display},
        )  # fmt: skip

    assert done.stdout.startswith(message)
    assert done.stderr == ""


def test_opening_and_closing_says_nothing_and_stays_out_of_the_home_folder(tmp_path):
    with virtual_display(1280, 720) as display:
        for _ in range(2):
            done = subprocess.run(
                [sys.executable, "-c", OPEN_ONE, "0"], capture_output=True, text=True, check=True,
                env={**os.environ, "DISPLAY": display, "HOME": str(tmp_path)},
            )  # fmt: skip

    assert (done.stdout, done.stderr) == ("", "")
    assert {path.name for path in tmp_path.rglob("*.json")} <= {"testMonitor.json"}, "only PsychoPy's own example"


def test_a_rude_end_leaves_the_display_usable_and_a_polite_one_closes_the_window():
    with virtual_display(1280, 720) as display:
        hand = Hand(display)
        with stage_on(display, SETTING) as stage:
            stage.put_on(ask("sliders"))
            stage.process.send_signal(signal.SIGKILL)
            assert stage.process.wait(20) == -signal.SIGKILL
        with stage_on(display, SETTING) as stage:
            stage.put_on(ask("sliders"))
            placed = stage.placed()
            hand.tap(*placed["slider 0.line"].box.middle)
            stage.send_message("aside", {"do": "abort", "text": "test"})
            assert stage.result() == Aside({"do": "abort", "text": "test"})
            stage.put_on(ask("sliders"))
            stage.process.send_signal(signal.SIGTERM)
            assert stage.process.wait(20) == -signal.SIGTERM
        assert hand.windows("Palpate") == []
        hand.close()
