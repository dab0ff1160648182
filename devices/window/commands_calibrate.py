"""Measure a screen with a ruler: a line is drawn by a guess, measured, and redrawn until it has its nominal length.

Lines typed at the terminal are read without blocking, so that the window stays responsive.
"""

from __future__ import annotations

import io
import os
import select
import sys
from contextlib import closing
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import click

from palpate.devices.window.calibration import NOMINAL_MM, TOLERANCE_MM, Calibration, density_from
from palpate.devices.window.geometry import WindowError
from palpate.devices.window.shell_checks import demand_screen

if TYPE_CHECKING:
    from palpate.devices.window.shell import Shell

USUAL_PX_PER_MM = 96 / 25.4
"""The density that systems assume by default."""
MOST_READINGS = 6


def calibrated(
    screen: int, language: str, width_mm: float | None, measured: float | None, windowed: tuple[int, int] | None
) -> Calibration:
    """Return the screen's calibration, from the readings typed at the terminal or from a given width.

    Raises WindowError if the screen or the display is not available, or the readings do not agree.
    """
    from palpate.devices.window.shell import screen_sizes

    sizes = screen_sizes()
    demand_screen(sizes, screen, None)
    size = windowed or sizes[screen]
    density = USUAL_PX_PER_MM if width_mm is None else sizes[screen][0] / width_mm
    first = Calibration(size, density, screen, datetime.now(UTC).isoformat(timespec="seconds"))
    if measured is not None:
        return replace(first, px_per_mm=density_from(first.metrics.mm(NOMINAL_MM), measured))
    from palpate.devices.window.shell import open_shell

    with closing(open_shell(first, screen, fullscreen=windowed is None)) as shell:
        return _read_until_right(shell, first, language)


def describe_calibration(calibration: Calibration) -> str:
    """Return a description of the calibration."""
    width, height = calibration.size_px
    size_mm = f"{width / calibration.px_per_mm:.0f} x {height / calibration.px_per_mm:.0f} mm"
    return f"screen {calibration.screen}: {width}x{height} px, {calibration.px_per_mm:.4f} px per mm ({size_mm})"


def _read_until_right(shell: Shell, guess: Calibration, language: str) -> Calibration:
    """Repeat the measurement until the line measures its nominal length; each reading corrects the density."""
    lines = Lines()
    for _ in range(MOST_READINGS):
        read_mm = _reading(shell, guess, language, lines)
        if abs(read_mm - NOMINAL_MM) <= TOLERANCE_MM:
            return guess
        try:
            guess = replace(guess, px_per_mm=density_from(guess.metrics.mm(NOMINAL_MM), read_mm))
            click.echo(f"corrected to {guess.px_per_mm:.4f} px per mm; the line is redrawn: measure it again")
        except WindowError as error:
            click.echo(str(error))
    raise WindowError(f"{MOST_READINGS} readings and none of {NOMINAL_MM:g} mm: check the ruler, its unit and its zero")


def _reading(shell: Shell, calibration: Calibration, language: str, lines: Lines) -> float:
    """Show the line and wait for a number at the terminal, while the window stays responsive."""
    from PIL import Image

    from palpate.devices.window.build import screen_for
    from palpate.devices.window.fonts import find_fonts
    from palpate.devices.window.scenes import Scene
    from palpate.devices.window.screen import Page
    from palpate.devices.window.texts import load_texts
    from palpate.protocols.events import Confirm

    page = Page(calibration.metrics, load_texts(language), find_fonts(language))
    scene = Scene(screen_for(Confirm("calibration"), page, 0), shell, Image.new("RGB", calibration.size_px, "white"))
    scene.appear()
    while True:
        click.echo(f"How many mm does the line measure, from end to end? [{NOMINAL_MM:g}] ", nl=False)
        while (line := lines.poll()) is None:
            scene.turn()
        try:
            return float(line.strip().replace(",", ".") or NOMINAL_MM)
        except ValueError:
            click.echo(f"{line.strip()!r} is not a number; millimetres are expected, as 126.5")


@dataclass
class Lines:
    """Standard input, read line by line without waiting; nothing else may read from it meanwhile."""

    pending: bytearray = field(default_factory=bytearray)

    def poll(self) -> str | None:
        """Return the next line if it has been typed, else None. Raises click.Abort at the end of the input."""
        if b"\n" not in self.pending:
            self.pending += self._piece()
        line, found, rest = self.pending.partition(b"\n")
        if not found:
            return None
        self.pending = rest
        return line.decode("utf-8", "replace")

    def _piece(self) -> bytes:
        if sys.platform == "win32" and sys.stdin.isatty():
            # What was typed since the last time, echoed as it is typed.
            import msvcrt

            typed = ""
            while msvcrt.kbhit():  # type: ignore[attr-defined, unused-ignore]
                typed += msvcrt.getwche()  # type: ignore[attr-defined, unused-ignore]
            if "\x03" in typed:
                raise KeyboardInterrupt
            return typed.replace("\r", "\n").encode()
        try:
            source = sys.stdin.fileno()
        except (io.UnsupportedOperation, AttributeError):
            return _demand(sys.stdin.readline().encode())
        if sys.platform == "win32":
            return _demand(sys.stdin.readline().encode())
        ready, _, _ = select.select([source], [], [], 0)
        return _demand(os.read(source, 4096)) if ready else b""


def _demand(piece: bytes) -> bytes:
    if not piece:
        raise click.Abort
    return piece
