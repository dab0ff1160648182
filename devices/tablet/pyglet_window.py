"""A tablet through pyglet's window, as PsychoPy opens it: Wintab on Windows, XInput under X11 (pyglet 1.5).

pyglet does not time reports: a report counts from when the window's events are handled, usually once per frame. Reports
of one frame come bunched then, which the pipeline allows for; if the system can read the tablet itself, prefer that.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

from palpate.devices.device import DeviceError, DeviceFault
from palpate.devices.source import Elapsed
from palpate.devices.tablet.reports import Batch, Report

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

KEPT = 4096
"""Greatest number of reports that wait for a reader; beyond it the oldest are dropped and counted."""


@dataclass
class PygletTablet:
    """A listener to the tablet of a pyglet window (`window.winHandle` of PsychoPy's).

    Without a window it opens a small one of its own and handles its events itself, in the thread that opened it, for a
    check of the tablet. `px_per_mm` comes from the screen's calibration.
    """

    name: str
    px_per_mm: float
    aligned: bool = True
    window: Any = None
    own: Any = None
    canvas: Any = None
    elapsed_s: Elapsed | None = None
    opener: int = 0
    dropped: int = 0
    waiting: deque[Report] = field(default_factory=lambda: deque(maxlen=KEPT))
    came: threading.Event = field(default_factory=threading.Event)

    def open(self) -> Mapping[str, str]:
        """Find the tablet and listen to it.

        Raises:
            DeviceError: no pyglet, or no tablet that it can find or open.
        """
        try:
            tablets = import_module("pyglet.input").get_tablets()
            if not tablets:
                raise DeviceError(
                    f"{self.name}: pyglet sees no tablet. On Windows it needs the maker's Wintab driver (Microsoft's"
                    " own pen driver has none), under X11 a Wacom-like device; on macOS pyglet 1.5 has no tablets. On"
                    " Linux use the driver `evdev`."
                )
            window = self.window or self._own_window()
            self.canvas = tablets[0].open(window)
        except DeviceError:
            raise
        except Exception as problem:  # pyglet raises what the platform's library raises
            self.close()
            raise DeviceError(f"{self.name}: pyglet cannot open the tablet: {problem!r}") from None
        self.canvas.push_handlers(on_motion=self.on_motion, on_leave=self.on_leave)
        self.opener = threading.get_ident()
        several = f"{len(tablets)}, the first is used" if len(tablets) > 1 else "1"
        return {"tablet": str(getattr(tablets[0], "name", "tablet")), "tablets": several}

    def expect(self, scene: Scene | None) -> None:
        """Do nothing: a real stylus follows a real hand."""

    def start(self, elapsed_s: Elapsed) -> None:
        """Begin to sample. Raises DeviceError if it is not open."""
        if self.canvas is None:
            raise DeviceError(f"{self.name} is not open.")
        self.waiting.clear()
        self.dropped, self.elapsed_s = 0, elapsed_s

    def pull(self, timeout_s: float) -> Batch:
        """Return the reports of the window since the last pull.

        Raises:
            DeviceFault: `refused` for its own window in another thread, which would never get reports.
        """
        if self.own is not None:
            if threading.get_ident() != self.opener:
                message = (
                    "without the participant's window (`Tablet.attach`) pyglet's reports can be checked, not recorded"
                )
                raise DeviceFault(self.name, "refused", f"{self.name}: {message}; on Linux use the driver `evdev`.")
            self.own.dispatch_events()
        if not self.waiting:
            self.came.wait(timeout_s)
        self.came.clear()
        dropped, self.dropped = self.dropped, 0
        return Batch([self.waiting.popleft() for _ in range(len(self.waiting))], dropped)

    def stop(self) -> None:
        """Stop taking reports."""
        self.elapsed_s = None
        self.came.set()

    def close(self) -> None:
        """Release the tablet and its own window."""
        self.stop()
        for one in (self.canvas, self.own):
            if one is not None:
                one.close()
        self.canvas = self.own = None

    def on_motion(self, cursor: Any, x: float, y: float, pressure: float, tilt_x: float, tilt_y: float) -> None:  # noqa: ARG002
        """Handle pyglet's event of a motion, in pixels from the bottom left of the window."""
        height = float((self.window or self.own).height)
        self._take(float(x) / self.px_per_mm, (height - float(y)) / self.px_per_mm, float(pressure), away=False)

    def on_leave(self, cursor: Any) -> None:  # noqa: ARG002
        """Handle pyglet's event that the stylus is out of reach."""
        self._take(math.nan, math.nan, 0.0, away=True)

    def _take(self, x_mm: float, y_mm: float, pressure: float, *, away: bool) -> None:
        elapsed_s = self.elapsed_s
        if elapsed_s is None:
            return
        self.dropped += len(self.waiting) == KEPT
        self.waiting.append(Report(elapsed_s(), x_mm, y_mm, pressure, pressure > 0, away))
        self.came.set()

    def _own_window(self) -> Any:
        self.own = import_module("pyglet.window").Window(width=480, height=320, caption="Palpate: the tablet")
        return self.own
