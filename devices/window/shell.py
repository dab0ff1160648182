"""The real window: PsychoPy's, with one picture, and handlers for all events. Imported only to open a window.

The whole-screen picture is one texture on the graphics card, drawn pixel for pixel. A flip makes the drawn picture
visible or, if the processor renders, only the changes are copied to the front.
"""

from __future__ import annotations

import gc
import select
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import reduce
from typing import TYPE_CHECKING, Any, Protocol

from palpate.devices.device import closed_on_failure
from palpate.devices.window.calibration import Calibration
from palpate.devices.window.geometry import Box, WindowError
from palpate.devices.window.inputs import Input
from palpate.devices.window.shell_checks import demand_display, demand_screen, demand_unscaled
from palpate.devices.window.shell_ears import Ears, keys_of

if TYPE_CHECKING:
    from PIL import Image

TITLE = "Palpate"
VIEWING_CM = 60.0
AWAKE_S, SIZE_S = 20.0, 0.5
SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software rasterizer")
"""Names of renderers that draw with the processor."""
EXTENSION = "GLX_MESA_copy_sub_buffer"
Copy = Callable[[Box], None]


class Shell(Protocol):
    """The shell of the screens: it shows a picture and returns the participant's inputs."""

    size: tuple[int, int]
    renderer: str

    def now_s(self) -> float:
        """Return the seconds of the clock that times inputs."""

    def gather(self) -> list[Input]:
        """Return the participant's inputs since the last call, timed on the shell's clock.

        Raises WindowError if the window is no longer as calibrated.
        """

    def forget(self) -> None:
        """Drop the inputs until now, and the repeats of a key that is held now: they belong to no screen."""

    def show(self, picture: Image.Image, boxes: Sequence[Box]) -> None:
        """Update these boxes of the whole-screen picture, and show them."""

    def rest(self, seconds: float) -> None:
        """Wait for some seconds, or until something may have happened."""

    def close(self) -> None:
        """Close the window; it cannot be opened again."""


@dataclass
class PsychopyShell:
    """A PsychoPy window (pyglet), redrawn only if something is to be shown, or if it was uncovered.

    `copy` copies a part of the drawn picture to the screen; None: all of it is drawn and flipped each time.
    """

    window: Any
    ears: Ears
    texture: Texture
    size: tuple[int, int]
    renderer: str
    copy: Copy | None = None
    closed: bool = False
    checked_s: dict[str, float] = field(default_factory=dict)

    def now_s(self) -> float:
        """Return the seconds of a clock that never decreases."""
        return time.perf_counter()

    def gather(self) -> list[Input]:
        """Dispatch the window system's events, and return the inputs."""
        self.window.winHandle.dispatch_events()
        if self._due("size", SIZE_S):
            self.ears.resized(*_true_size(self.window.winHandle))
        if self.ears.trouble is not None:
            raise WindowError(self.ears.trouble)
        if self.ears.uncovered:
            self._draw([])
        return self.ears.hand_over()

    def forget(self) -> None:
        """Drop the inputs so far."""
        self.gather()
        self.ears.forget()

    def show(self, picture: Image.Image, boxes: Sequence[Box]) -> None:
        """Upload the boxes and show them on the screen."""
        self.window.backend.setCurrent()
        inside = [box.common(self._whole) for box in boxes if box.overlaps(self._whole)]
        for box in inside:
            self.texture.upload(picture, box)
        self._draw(inside)

    def rest(self, seconds: float) -> None:
        """Wait; under X11 an event ends the waiting."""
        if self._due("awake", AWAKE_S):
            # Keep the screen saver away while a participant feels rather than types.
            if hasattr(self.window.winHandle, "_x_display"):
                from pyglet.libs.x11 import xlib

                xlib.XResetScreenSaver(self.window.winHandle._x_display)
            elif sys.platform in ("win32", "darwin"):
                from psychopy import platform_specific

                platform_specific.sendStayAwake()
        if hasattr(self.window.winHandle, "_x_display"):
            select.select([int(self.window.winHandle.display.fileno())], [], [], seconds)
        else:
            time.sleep(seconds)

    def close(self) -> None:
        """Close the window and show the pointer again."""
        if not self.closed:
            self.closed = True
            self.window.close()

    @property
    def _whole(self) -> Box:
        return Box(0, 0, *self.size)

    def _draw(self, boxes: Sequence[Box]) -> None:
        """Draw the changes, or everything if needed, and show them at once."""
        if self.copy is None or self.ears.uncovered:
            boxes = [self._whole]
        self.ears.uncovered = False
        self.texture.draw(boxes)
        if self.copy is None:
            self.window.flip(clearBuffer=False)
        elif boxes:
            self.copy(reduce(Box.joined, boxes))  # one copy, so that nobody ever sees a part of what changed

    def _due(self, what: str, every_s: float) -> bool:
        now = self.now_s()
        due = now - self.checked_s.get(what, 0.0) >= every_s
        if due:
            self.checked_s[what] = now
        return due


def screen_sizes() -> list[tuple[int, int]]:
    """Return the sizes of this machine's screens, in pixels. Raises WindowError: no display, PsychoPy missing."""
    demand_display()
    with _quiet_import():
        return _screens(_psychopy()[2])


def open_shell(calibration: Calibration, screen: int, fullscreen: bool) -> PsychopyShell:
    """Open the window on a screen; if not full-screen, it is as large as the calibrated screen (for tests).

    Raises WindowError: no display, PsychoPy missing, another size than calibrated, a scaled display.
    """
    demand_display()
    with _quiet_import():
        visual, monitors, pyglet = _psychopy()
    demand_screen(_screens(pyglet), screen, calibration if fullscreen else None)
    # The calibration as PsychoPy's monitor, in memory only.
    monitor = monitors.Monitor("__blank__", distance=VIEWING_CM, autoLog=False)
    monitor.setWidth(calibration.size_px[0] / calibration.px_per_mm / 10.0)
    monitor.setSizePix(calibration.size_px)
    window = visual.Window(
        calibration.size_px, fullscr=fullscreen, screen=screen, winType="pyglet", units="pix", title=TITLE,
        monitor=monitor, color=(1, 1, 1), allowGUI=False, allowStencil=False,
        waitBlanking=True, checkTiming=False, autoLog=False, gammaErrorPolicy="ignore",
    )  # fmt: skip
    with closed_on_failure(window.close):
        # The opened window with its texture and ears, checked against the calibration.
        handle, size = window.winHandle, calibration.size_px
        demand_unscaled(handle.get_pixel_ratio())
        calibration.demand_size((int(window.size[0]), int(window.size[1])))
        ears = Ears(size, keys_of(pyglet.window.key, handle), time.perf_counter)
        handle.push_handlers(**ears.handlers())
        handle.set_mouse_visible(True)
        handle.activate()
        renderer = str(window.backend._driver)
        copy = copier(handle, renderer, size[1])
        return PsychopyShell(window, ears, Texture(pyglet.gl, size), size, renderer, copy)


@contextmanager
def _quiet_import() -> Iterator[None]:
    """Silence the warnings of PsychoPy's modules while they are imported, without garbage collection.

    Collecting garbage between thousands of new modules finds none and takes a tenth of the time.
    """
    collecting = gc.isenabled()
    gc.disable()
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "'locale.getdefaultlocale' is deprecated", DeprecationWarning)
            warnings.filterwarnings("ignore", category=SyntaxWarning)
            yield
    finally:
        if collecting:
            gc.enable()


def _psychopy() -> tuple[Any, Any, Any]:
    """Import PsychoPy's windows and monitors, and pyglet, only here. Raises WindowError."""
    try:
        from psychopy import logging

        logging.console.setLevel(logging.CRITICAL)
        import pyglet
        from psychopy import monitors, visual

        visual.Window  # noqa: B018  (PsychoPy imports its parts when they are first named)
    except ImportError as error:
        raise WindowError(f"PsychoPy is not whole ({error}): install it again: pip install 'palpate[lab]'") from error
    except Exception as error:
        if "display" not in f"{type(error).__name__} {error}".lower():
            raise
        raise WindowError(
            f"no display can be reached ({error}): run this at the participant's computer, in its graphical session"
        ) from error
    return visual, monitors, pyglet


def _screens(pyglet: Any) -> list[tuple[int, int]]:
    return [(screen.width, screen.height) for screen in pyglet.canvas.get_display().get_screens()]


def _true_size(handle: Any) -> tuple[int, int]:
    """Return the window system's size of the window: pyglet is not notified of full-screen sizes under X11."""
    if not hasattr(handle, "_x_display"):
        width, height = handle.get_size()
        return int(width), int(height)
    from ctypes import byref

    from pyglet.libs.x11 import xlib

    attributes = xlib.XWindowAttributes()
    xlib.XGetWindowAttributes(handle._x_display, handle._window, byref(attributes))
    return int(attributes.width), int(attributes.height)


def copier(handle: Any, renderer: str, height: int) -> Copy | None:
    """Return a function that copies a box of the drawn picture to the window of `handle` and keeps the drawn picture.

    Return None if only a flip is possible: on a graphics card only a flip waits for the end of a frame, so that no
    frame is half old, and the drawn picture is then lost. A software renderer does not wait, and every pixel that is
    not drawn again saves time.
    """
    if not any(name in renderer.lower() for name in SOFTWARE) or not hasattr(handle, "_x_display"):
        return None
    from pyglet.gl import glFinish
    from pyglet.gl.glx_info import GLXInfo
    from pyglet.gl.glxext_arb import glXCopySubBufferMESA
    from pyglet.libs.x11.xlib import XSync

    display, drawable = handle._x_display, getattr(handle.context, "glx_window", None)
    if drawable is None or not GLXInfo(display).have_extension(EXTENSION):
        return None

    def copy(box: Box) -> None:
        glFinish()
        glXCopySubBufferMESA(display, drawable, box.left, height - box.bottom, box.width, box.height)
        XSync(display, False)

    return copy


class Texture:
    """A texture of the window's size in the window's current context; `gl` is pyglet's."""

    def __init__(self, gl: Any, size: tuple[int, int]) -> None:
        self._gl, self._size = gl, size
        most = gl.GLint()
        gl.glGetIntegerv(gl.GL_MAX_TEXTURE_SIZE, most)
        if most.value < max(size):
            raise WindowError(f"the graphics card draws pictures up to {most.value} px; {size} px are needed")
        self._name = gl.GLuint()
        gl.glGenTextures(1, self._name)
        gl.glBindTexture(gl.GL_TEXTURE_2D, self._name)
        for which in (gl.GL_TEXTURE_MIN_FILTER, gl.GL_TEXTURE_MAG_FILTER):
            gl.glTexParameteri(gl.GL_TEXTURE_2D, which, gl.GL_NEAREST)
        for which in (gl.GL_TEXTURE_WRAP_S, gl.GL_TEXTURE_WRAP_T):
            gl.glTexParameteri(gl.GL_TEXTURE_2D, which, gl.GL_CLAMP_TO_EDGE)
        width, height = size
        gl.glTexImage2D(gl.GL_TEXTURE_2D, 0, gl.GL_RGBA8, width, height, 0, gl.GL_RGBA, gl.GL_UNSIGNED_BYTE, None)

    def upload(self, picture: Image.Image, box: Box) -> None:
        """Update a box of the picture; parts outside the window are left out.

        Pillow stores a pixel of an RGB picture in four bytes, as the texture does, so nothing is converted.
        """
        inside = box.common(Box(0, 0, *self._size))
        if not inside.width or not inside.height:
            return
        gl = self._gl
        part = picture.crop((inside.left, inside.top, inside.right, inside.bottom))
        gl.glBindTexture(gl.GL_TEXTURE_2D, self._name)
        gl.glPixelStorei(gl.GL_UNPACK_ALIGNMENT, 4)
        gl.glTexSubImage2D(
            gl.GL_TEXTURE_2D, 0, inside.left, inside.top, inside.width, inside.height,
            gl.GL_RGBA, gl.GL_UNSIGNED_BYTE, part.tobytes("raw", "RGBX"),
        )  # fmt: skip

    def draw(self, boxes: Iterable[Box]) -> None:
        """Cover these boxes of the window with the texture, the picture's first row at the top."""
        gl = self._gl
        self._plain_state()
        for box in boxes:
            gl.glScissor(box.left, self._size[1] - box.bottom, box.width, box.height)
            gl.glBegin(gl.GL_QUADS)
            for right, top in ((0, 0), (1, 0), (1, 1), (0, 1)):
                gl.glTexCoord2f(right, 1 - top)
                gl.glVertex2f(2 * right - 1, 2 * top - 1)
            gl.glEnd()
        gl.glDisable(gl.GL_TEXTURE_2D)

    def _plain_state(self) -> None:
        """Reset shader, blending and view to the window's own, as PsychoPy changes them."""
        gl = self._gl
        gl.glUseProgram(0)
        for matrix in (gl.GL_PROJECTION, gl.GL_MODELVIEW):
            gl.glMatrixMode(matrix)
            gl.glLoadIdentity()
        for off in (gl.GL_BLEND, gl.GL_DEPTH_TEST, gl.GL_LIGHTING):
            gl.glDisable(off)
        gl.glViewport(0, 0, *self._size)
        gl.glEnable(gl.GL_SCISSOR_TEST)
        gl.glActiveTexture(gl.GL_TEXTURE0)
        gl.glEnable(gl.GL_TEXTURE_2D)
        gl.glBindTexture(gl.GL_TEXTURE_2D, self._name)
        gl.glTexEnvi(gl.GL_TEXTURE_ENV, gl.GL_TEXTURE_ENV_MODE, gl.GL_REPLACE)
