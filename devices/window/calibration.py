"""The pixels per millimetre of a station's screen, measured with a ruler and stored in the lab by host name."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from palpate.devices.stations import station_folder
from palpate.devices.window.geometry import Metrics, WindowError
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.files import write_text
from palpate.protocols.shell_command import shell_command
from palpate.protocols.yaml_text import load

NOMINAL_MM = 127.0
"""The length of the line that is drawn and measured, that of the thesis' slider."""
TOLERANCE_MM = 0.5
"""Greatest deviation of the ruler's reading from the nominal length."""
DENSITIES = (1.0, 40.0)
"""Plausible pixels per millimetre: from a wall of light bulbs to a telephone."""
SIZES = (320, 16384)
AGAIN = "palpate window calibrate"


@dataclass(frozen=True)
class Calibration:
    """A screen with its size in pixels and its density, as an experimenter confirmed them with a ruler."""

    size_px: tuple[int, int]
    px_per_mm: float
    screen: int
    confirmed_at: str
    nominal_mm: float = NOMINAL_MM

    @property
    def metrics(self) -> Metrics:
        """Return the screen's size and density for layout."""
        return Metrics(*self.size_px, self.px_per_mm)

    def definition(self) -> dict[str, Any]:
        """Return the calibration as JSON data, for the ledger."""
        return asdict(self) | {"size_px": list(self.size_px)}

    @classmethod
    def from_definition(cls, data: Mapping[str, Any], where: str = "calibration") -> Calibration:
        """Return the calibration in a ledger or file. Raises WindowError that names the invalid key."""
        for key in data:
            if key not in KEYS:
                raise WindowError(f"{where}: unknown key {key!r}, {nearest(str(key), KEYS)}")
        for key, (right, expected) in KEYS.items():
            if key not in data:
                raise WindowError(f"{where}: {key} is missing: {expected}; write it again: {AGAIN}")
            if not right(data[key]):
                raise WindowError(
                    f"{where}: {key} = {data[key]!r:.60}: {expected} is expected; write it again: {AGAIN}"
                )
        width, height = data["size_px"]
        numbers = float(data["px_per_mm"]), data["screen"], data["confirmed_at"], float(data["nominal_mm"])
        return cls((width, height), *numbers)

    def demand_size(self, found: tuple[int, int]) -> None:
        """Raise WindowError unless the window has the size of the calibrated screen."""
        if found != self.size_px:
            now, then = f"{found[0]}x{found[1]}", f"{self.size_px[0]}x{self.size_px[1]}"
            raise WindowError(f"calibrated at {then} px, the screen has {now}: set it back, or measure again: {AGAIN}")


def demand_reading(read_mm: float, nominal_mm: float) -> None:
    """Raise WindowError if the ruler's reading of the drawn line differs from its nominal length."""
    if not abs(read_mm - nominal_mm) <= TOLERANCE_MM:
        raise WindowError(
            f"the bar of {nominal_mm:g} mm measures {read_mm:g} mm on the screen; at most {TOLERANCE_MM:g} mm off is "
            f"allowed: measure the line once more, or measure the screen again: {AGAIN}"
        )


def density_from(bar_px: int, read_mm: float) -> float:
    """Return the pixels per millimetre if a bar of `bar_px` pixels measures `read_mm`. Raises WindowError."""
    if not (math.isfinite(read_mm) and read_mm > 0 and _dense(bar_px / read_mm)):
        low, high = DENSITIES
        raise WindowError(
            f"a bar of {bar_px} px that measures {read_mm:g} mm: a reading from {bar_px / high:.0f} to "
            f"{bar_px / low:.0f} mm is expected; read the ruler in millimetres"
        )
    return bar_px / read_mm


def station_file(lab: Path, host: str | None = None) -> Path:
    """Return the path of a station's calibration: LAB/stations/HOST/window.yaml."""
    return station_folder(lab, host) / "window.yaml"


def read_calibration(lab: Path, host: str | None = None) -> Calibration:
    """Return this station's calibration. Raises WindowError if there is none, or with line and key of an error."""
    file = station_file(lab, host)
    if not file.is_file():
        raise WindowError(f"{file}: this station's screen is not calibrated; do it first: {_command(lab)}")
    document = load(file.read_bytes(), str(file))
    if not isinstance(document.data, dict):
        raise WindowError(f"{file}: keys with values are expected; write it again: {_command(lab)}")
    wrong = [key for key, value in document.data.items() if key not in KEYS or not KEYS[key][0](value)]
    return Calibration.from_definition(
        document.data, f"{file}: line {document.lines[(wrong[0],)]}" if wrong else str(file)
    )


def _command(lab: Path) -> str:
    return shell_command("window", "calibrate", "--lab", lab)


def write_calibration(lab: Path, calibration: Calibration, host: str | None = None) -> Path:
    """Save this station's calibration, replacing an earlier one."""
    width, height = calibration.size_px
    text = (
        f"# The participant's screen at this station, measured with a ruler. Made by: {AGAIN}\n"
        f"screen: {calibration.screen}\nsize_px: [{width}, {height}]\npx_per_mm: {calibration.px_per_mm!r}\n"
        f'nominal_mm: {calibration.nominal_mm!r}\nconfirmed_at: "{calibration.confirmed_at}"\n'
    )
    return write_text(station_file(lab, host), text)


def _number(value: Any) -> bool:
    return type(value) in (int, float) and math.isfinite(value)


def _dense(value: Any) -> bool:
    return _number(value) and DENSITIES[0] <= value <= DENSITIES[1]


def _size(value: Any) -> bool:
    sizes = isinstance(value, list | tuple) and len(value) == 2
    return sizes and all(type(side) is int and SIZES[0] <= side <= SIZES[1] for side in value)


KEYS: Mapping[str, tuple[Callable[[Any], bool], str]] = {
    "screen": (lambda value: type(value) is int and 0 <= value < 16, "the screen's number, from 0"),
    "size_px": (_size, f"[width, height] in pixels, each from {SIZES[0]} to {SIZES[1]}"),
    "px_per_mm": (_dense, f"a number from {DENSITIES[0]:g} to {DENSITIES[1]:g}"),
    "nominal_mm": (lambda value: _number(value) and 10 <= value <= 1000, "the bar's length, from 10 to 1000 mm"),
    "confirmed_at": (lambda value: isinstance(value, str) and len(value) >= 10, "the date and time of measuring"),
}
"""Every key of a calibration: a check of its value, and the message if it fails."""
