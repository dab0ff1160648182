"""The tablet's own screen: a texture's picture at true size under the stylus (thesis 4.5.3, 4.7.1).

The window has a process of its own, so that it never delays the participant's window or takes its keys.
"""

from __future__ import annotations

import multiprocessing
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.devices.device import closed_on_failure
from palpate.devices.render.priority import by_itself
from palpate.devices.render.window.photo import at_true_size, read_photo
from palpate.devices.window.geometry import Box, WindowError
from palpate.protocols.interrupts import uninterrupted
from palpate.signals.textures.sounds import RenderError

if TYPE_CHECKING:
    from PIL import Image

    from palpate.devices.tablet.device import Display
    from palpate.devices.window.shell import Shell

READY_S, ANSWER_S, GONE_S = 60.0, 10.0, 5.0
TURN_S = 0.02
GROUND = (24, 24, 24)
"""Colour of the screen around the picture, and of all of it if none is shown."""


class TabletScreen:
    """A window that fills the tablet's screen. Use it in a `with` block, or close it; from one thread.

    Raises RenderError, on entering, if the screen is not available.
    """

    def __init__(self, display: Display) -> None:
        """Take the display without opening anything."""
        self.display = display
        self._process: BaseProcess | None = None
        self._talk: Connection | None = None

    def __enter__(self) -> TabletScreen:
        spawn = multiprocessing.get_context("spawn")
        self._talk, theirs = spawn.Pipe()
        self._process = spawn.Process(target=_serve, args=(self.display, theirs), daemon=True)
        with closed_on_failure(self.close):
            with uninterrupted():
                self._process.start()
            theirs.close()
            self._answer(READY_S)
        return self

    def __exit__(self, *_raised: object) -> None:
        self.close()

    def show(self, picture: Path | None) -> None:
        """Show the picture, or nothing, and return once it is visible. Raises RenderError."""
        try:
            if self._talk is None:
                raise RenderError("the tablet's screen is not open")
            self._talk.send(picture)
        except OSError:
            raise RenderError("the window on the tablet's screen has ended") from None
        self._answer(ANSWER_S)

    def close(self) -> None:
        """Close the window; a second call does nothing."""
        process, self._process = self._process, None
        if self._talk is not None:
            self._talk.close()  # its end of the pipe hears that, and ends
            self._talk = None
        if process is None or process.pid is None:
            return
        process.join(GONE_S)
        if process.is_alive():
            process.kill()
            process.join()

    def _answer(self, timeout_s: float) -> None:
        try:
            if self._talk is None or not self._talk.poll(timeout_s):
                raise RenderError(f"the tablet's screen did not answer within {timeout_s:g} s")
            trouble = self._talk.recv()
        except (EOFError, OSError):
            raise RenderError("the window on the tablet's screen has ended") from None
        if trouble:
            raise RenderError(f"the tablet's screen: {trouble}")


@dataclass
class Canvas:
    """The whole screen as a picture, painted for a shell; `middle_px` is the position of the texture's middle."""

    shell: Shell
    image: Image.Image
    px_per_mm: float
    middle_px: tuple[int, int]

    def show(self, picture: Path | None) -> None:
        """Paint the picture at true size, or only the background, and show it. Raises WindowError."""
        width, height = self.image.size
        self.image.paste(GROUND, (0, 0, width, height))
        if picture is not None:
            x, y = self.middle_px
            room = 2 * min(x, self.image.width - x), 2 * min(y, self.image.height - y)
            shown = at_true_size(read_photo(picture), self.px_per_mm, room)
            self.image.paste(shown, (x - shown.width // 2, y - shown.height // 2))
        self.shell.show(self.image, [Box(0, 0, width, height)])


def _serve(display: Display, talk: Connection) -> None:
    """Run the other process: open the window, report that, and show requested pictures until the other end closes."""
    by_itself()
    try:
        canvas = _opened(display)
    except (WindowError, OSError) as error:
        with suppress(OSError):
            talk.send(str(error))
        return
    try:
        talk.send("")
        _listen(canvas, talk)
    finally:
        canvas.shell.close()


def _listen(canvas: Canvas, talk: Connection) -> None:
    while True:
        try:
            if talk.poll(TURN_S):
                talk.send(_done(canvas, talk.recv()))
            canvas.shell.gather()
        except (EOFError, OSError, WindowError):
            return


def _done(canvas: Canvas, picture: Path | None) -> str:
    """Show the picture; return the error message, or ""."""
    try:
        canvas.show(picture)
    except WindowError as error:
        return str(error)
    return ""


def _opened(display: Display) -> Canvas:
    """Return the window on the tablet's screen, dark. Raises WindowError if there is none."""
    from PIL import Image

    from palpate.devices.window.app import NEVER
    from palpate.devices.window.calibration import Calibration
    from palpate.devices.window.shell import open_shell, screen_sizes
    from palpate.devices.window.shell_checks import demand_screen

    sizes = screen_sizes()
    demand_screen(sizes, display.number, None)
    size = sizes[display.number]
    shell = open_shell(Calibration(size, display.px_per_mm, display.number, NEVER), display.number, fullscreen=True)
    middle_mm = display.middle_mm
    middle = (size[0] // 2, size[1] // 2)
    if middle_mm is not None:
        middle = round(middle_mm[0] * display.px_per_mm), round(middle_mm[1] * display.px_per_mm)
    if not (0 < middle[0] < size[0] and 0 < middle[1] < size[1]):
        shell.close()
        raise WindowError(f"middle_mm: {list(middle_mm or ())} does not lie on the screen of {size[0]}x{size[1]} px")
    shell.window.winHandle.set_mouse_visible(False)
    canvas = Canvas(shell, Image.new("RGB", size, GROUND), display.px_per_mm, middle)
    canvas.show(None)
    return canvas
