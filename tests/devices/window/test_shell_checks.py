import sys

import pytest

from palpate.devices.window.calibration import Calibration
from palpate.devices.window.geometry import WindowError
from palpate.devices.window.shell_checks import demand_display, demand_screen, demand_unscaled

CALIBRATION = Calibration((1920, 1080), 3.6, 1, "2026-11-21T10:00:00+00:00")


@pytest.fixture
def linux(monkeypatch):
    monkeypatch.setattr("palpate.devices.window.shell_checks.demand_packages", lambda *_: None)
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    return monkeypatch


def test_without_a_display_nothing_is_opened(linux):
    with pytest.raises(WindowError, match="DISPLAY is not set. Run this at the participant's computer.*xvfb-run"):
        demand_display()


def test_wayland_alone_is_not_enough(linux):
    linux.setenv("WAYLAND_DISPLAY", "wayland-0")
    with pytest.raises(WindowError, match="start XWayland"):
        demand_display()


def test_windows_needs_no_display_variable(linux):
    linux.setattr("sys.platform", "win32")
    demand_display()


def test_a_missing_psychopy_is_named_with_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "psychopy", None)
    with pytest.raises(WindowError, match=r"a window needs psychopy, .*: pip install 'palpate\[lab\]'"):
        demand_display()


def test_the_calibrated_screen_must_be_there_and_of_its_size():
    demand_screen([(1280, 720), (1920, 1080)], 1, CALIBRATION)
    with pytest.raises(WindowError, match="there is no screen 1; there are 0: 1280x720"):
        demand_screen([(1280, 720)], 1, CALIBRATION)
    with pytest.raises(WindowError, match="calibrated at 1920x1080 px, the screen has 1280x720"):
        demand_screen([(1920, 1080), (1280, 720)], 1, CALIBRATION)


@pytest.mark.parametrize(("ratio", "dpi", "message"), [(2.0, 96, "200%"), (1.0, 144, "150%"), (1.25, 96, "125%")])
def test_a_scaled_display_is_refused(ratio, dpi, message):
    demand_unscaled(1.0, 96)
    with pytest.raises(WindowError, match=f"scaled to {message}; 100 % is needed"):
        demand_unscaled(ratio, dpi)
