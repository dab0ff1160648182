"""Putting the window together: its screen, the models, the rig's stylus and actuator or what stands in for them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.devices.render.asked import Asked
from palpate.devices.render.found import available
from palpate.devices.render.job import Job
from palpate.devices.render.opened import NEED
from palpate.devices.render.process import Rendering
from palpate.devices.render.window.board import Board
from palpate.devices.render.window.choice import Choice
from palpate.devices.render.window.words import render_texts
from palpate.devices.tablet.device import Tablet
from palpate.devices.tablet.pipeline import Shape
from palpate.devices.tablet.pyglet_window import PygletTablet
from palpate.devices.tablet.reports import Report
from palpate.devices.window.at_hand import NEVER, calibration_at_hand
from palpate.devices.window.calibration import Calibration
from palpate.signals.textures.sounds import Sounds

if TYPE_CHECKING:
    from palpate.devices.render.window.room import Plays, Room
    from palpate.devices.window.geometry import Box
    from palpate.devices.window.shell import Shell

MOUSE = Shape(report_hz=60.0)
"""A mouse as a stylus: windows report it once a frame at the slowest."""


@dataclass(frozen=True)
class Hands:
    """Where strokes come from. `hand`: the shape of reports that the window pushes, None: the rig's tablet, read by
    the loop itself. `tablet`: a pen tablet that only a window hears."""

    rig: Path | None
    hand: Shape | None
    tablet: PygletTablet | None = None


@dataclass
class Begun:
    """What was started, to be ended with the window."""

    running: list[Rendering] = field(default_factory=list)

    def begin(self, job: Job) -> Plays:
        """Start to play. Raises RenderError."""
        self.end()
        made = Rendering(job)
        made.__enter__()
        self.running.append(made)
        return made

    def end(self) -> None:
        """Silence, and no process left."""
        while self.running:
            self.running.pop().__exit__()


def run_window(asked: Asked) -> None:
    """Show the window until it is closed. Raises WindowError, RigFileError, DeviceError, ModelFileError."""
    from palpate.devices.window.shell import open_shell

    calibration, hands = calibration_at_hand(asked.lab, asked.screen, asked.windowed), hands_for(asked)
    screen = calibration.screen if asked.screen is None else asked.screen
    shell, begun = open_shell(calibration, screen, asked.windowed is None), Begun()
    try:
        room = room_on(shell, calibration, asked, hands, begun)
        room.stylus = _listening(hands, shell, room.board.layout.picture, calibration.px_per_mm, room.epoch_s)
        room.run()
    finally:
        begun.end()
        if hands.tablet is not None:
            hands.tablet.close()
        shell.close()


def room_on(shell: Shell, calibration: Calibration, asked: Asked, hands: Hands, begun: Begun) -> Room:
    """The window's room on an open shell."""
    import sys

    from PIL import Image

    from palpate.devices.render.window.room import Room
    from palpate.devices.window.fonts import find_fonts
    from palpate.devices.window.hangul import needed
    from palpate.devices.window.screen import Page

    page = Page(calibration.metrics, render_texts(asked.language), find_fonts(asked.language),
                hangul=needed(asked.language, sys.platform))  # fmt: skip
    board = Board(page, available(asked.lab), by_mouse=hands.hand is not None and hands.tablet is None)
    job = Job(None, hands.hand, hands.rig, asked.ahead, asked.real_time, epoch_s=time.monotonic())
    notes = (("not_measured", calibration.confirmed_at == NEVER), ("twins", hands.rig is None))
    return Room(
        shell, page, Image.new("RGB", calibration.size_px, "white"), board, Choice(asked.texture, asked.method),
        lambda sounds: begun.begin(replace(job, sounds=sounds)),
        lambda card: Sounds(card, asked.seed, asked.sampled, asked.accept_missed),
        shell.now_s(), " ".join(page.texts(key) for key, said in notes if said),
        curve=hands.hand.force if hands.hand is not None else MOUSE.force,
    )  # fmt: skip


def hands_for(asked: Asked) -> Hands:
    """The rig's stylus and actuator; the mouse where the tablet is a twin, a twin's actuator where there is no rig.

    Raises RigFileError, DeviceError.
    """
    from palpate.devices.rig.file import read_rig, rig_path
    from palpate.devices.rig.kinds import made

    path = asked.rig or rig_path(asked.lab)
    if asked.twins or (asked.rig is None and not path.is_file()):
        return Hands(None, MOUSE)
    file = read_rig(path)
    name = next(each for each in file.names_for(NEED) if file.kind(each) == "tablet")
    tablet: Any = made(file.kind(name), name, file.devices[name], file.path.parent)
    if not isinstance(tablet, Tablet) or tablet.settings.driver == "twin":
        return Hands(path, MOUSE)
    if isinstance(tablet.source, PygletTablet):
        return Hands(path, tablet.shape, tablet.source)
    return Hands(path, None)


def _listening(
    hands: Hands, shell: Any, picture: Box, px_per_mm: float, epoch_s: float
) -> Callable[[], Sequence[Report]] | None:
    """The reports of a tablet that only this window hears, those on the picture as touches. Raises DeviceError."""
    tablet = hands.tablet
    if tablet is None:
        return None
    tablet.window, tablet.px_per_mm = shell.window.winHandle, px_per_mm
    tablet.open()
    tablet.start(lambda: shell.now_s() - epoch_s)
    return lambda: [on_picture(each, picture, px_per_mm) for each in tablet.pull(0.0).reports]


def on_picture(report: Report, picture: Box, px_per_mm: float) -> Report:
    """The report; off the picture nothing is touched (thesis 4.5.3)."""
    inside = not report.away and picture.holds(report.x_mm * px_per_mm, report.y_mm * px_per_mm)
    return report if inside else report._replace(pressure=0.0, touching=False)
