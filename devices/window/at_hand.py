"""A calibration for a window that may also be had where nobody has measured the screen."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from palpate.devices.window.calibration import Calibration, read_calibration, station_file

NEVER = "never: not measured"


def calibration_at_hand(lab: Path, screen: int | None, windowed: tuple[int, int] | None) -> Calibration:
    """The station's; where its screen was never measured, one by what the system says of it, confirmed `NEVER`."""
    if station_file(lab).is_file():
        found = read_calibration(lab)
        return found if windowed is None else replace(found, size_px=windowed)
    from palpate.devices.window.commands_calibrate import USUAL_PX_PER_MM
    from palpate.devices.window.shell import screen_sizes
    from palpate.devices.window.shell_checks import demand_screen

    sizes, chosen = screen_sizes(), screen or 0
    demand_screen(sizes, chosen, None)
    return Calibration(windowed or sizes[chosen], USUAL_PX_PER_MM, chosen, NEVER)
