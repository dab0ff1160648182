"""Checks before a window is opened; each error says what is wrong and what to do."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from palpate.devices.window.calibration import Calibration
from palpate.devices.window.geometry import WindowError
from palpate.protocols.extras import ExtraMissing, demand_packages

WINDOWS_DPI = 96


def demand_display() -> None:
    """Raise WindowError if PsychoPy is missing, or there is no display for a window."""
    try:
        demand_packages("a window", "psychopy")
    except ExtraMissing as error:
        raise WindowError(str(error)) from None
    unix = sys.platform not in ("win32", "darwin")
    if unix and not os.environ.get("DISPLAY"):
        wayland = ": Wayland alone is not enough, start XWayland" if os.environ.get("WAYLAND_DISPLAY") else ""
        raise WindowError(
            f"no display: DISPLAY is not set{wayland}. Run this at the participant's computer, in its graphical "
            "session, or on a virtual one: xvfb-run -s '-screen 0 1920x1080x24'"
        )


def demand_screen(sizes: Sequence[tuple[int, int]], screen: int, calibration: Calibration | None) -> None:
    """Raise WindowError unless the screen exists and has the size of its calibration."""
    if screen >= len(sizes):
        there = ", ".join(f"{number}: {width}x{height}" for number, (width, height) in enumerate(sizes))
        raise WindowError(f"there is no screen {screen}; there are {there}: choose one with --screen")
    if calibration is not None:
        calibration.demand_size(sizes[screen])


def demand_unscaled(pixel_ratio: float, dpi: int | None = None) -> None:
    """Raise WindowError if the system scales windows, which would make millimetres wrong."""
    dpi = _system_dpi() if dpi is None else dpi
    scale = max(pixel_ratio, dpi / WINDOWS_DPI)
    if abs(scale - 1.0) > 0.001:
        raise WindowError(
            f"the display is scaled to {scale:.0%}; 100 % is needed: set it in the system's display settings"
        )


def _system_dpi() -> int:
    """Return the dots per inch by which Windows scales; on other systems the unscaled value."""
    if sys.platform == "win32":
        from ctypes import windll

        return int(windll.user32.GetDpiForSystem())
    return WINDOWS_DPI
