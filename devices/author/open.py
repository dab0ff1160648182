"""Putting the window together: its screen, the door that it plays on, and the lab that it works for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.devices.author.designs import DesignError, designs_folder
from palpate.devices.author.making import Maker
from palpate.devices.author.words import author_texts
from palpate.devices.window.at_hand import calibration_at_hand
from palpate.devices.window.calibration import Calibration

if TYPE_CHECKING:
    from palpate.devices.author.room import Room
    from palpate.devices.door.link.simulator import DoorSimulator
    from palpate.devices.window.shell import Shell

LOCK = ".author.lock"


@dataclass(frozen=True)
class Options:
    """How the window is to be had. `rig` None: the station's rig file; `screen` None: as calibrated."""

    lab: Path
    twins: bool = False
    rig: Path | None = None
    language: str = "en"
    screen: int | None = None
    windowed: tuple[int, int] | None = None


def run_window(maker: Maker, options: Options) -> None:
    """Show the window until it is closed. Raises WindowError, DesignError, RigFileError."""
    from palpate.devices.window.shell import open_shell

    calibration = calibration_at_hand(options.lab, options.screen, options.windowed)
    door, why = _door(options)
    with _alone(options.lab):
        screen = calibration.screen if options.screen is None else options.screen
        shell = open_shell(calibration, screen, options.windowed is None)
        room = None
        try:
            room = room_on(shell, calibration, maker, options, door, why)
            room.run()
        finally:
            if room is not None and room.player is not None:
                room.player.close()
            shell.close()


def room_on(
    shell: Shell, calibration: Calibration, maker: Maker, options: Options, door: DoorSimulator | None, no_door: str
) -> Room:
    """The window's room on an open shell."""
    import sys
    import time

    from PIL import Image

    from palpate.devices.author.playing import Player
    from palpate.devices.author.room import Room
    from palpate.devices.window.fonts import find_fonts
    from palpate.devices.window.hangul import needed
    from palpate.devices.window.screen import Page

    page = Page(calibration.metrics, author_texts(options.language), find_fonts(options.language),
                hangul=needed(options.language, sys.platform))  # fmt: skip
    room = Room(shell, page, Image.new("RGB", calibration.size_px, "white"), maker, options.lab, no_door=no_door)
    if door is not None:
        room.player = Player(door, room, time.monotonic_ns)
    return room


def _door(options: Options) -> tuple[DoorSimulator | None, str]:
    """The door to play on, not opened yet; None, and why, where the station has none. Raises RigFileError."""
    from palpate.devices.rig.file import read_rig, rig_path
    from palpate.devices.rig.kinds import made

    if options.twins:
        from palpate.devices.door.link.device import Settings, make

        return make("door", Settings(kind="door", driver="twin"), options.lab), ""
    path = options.rig or rig_path(options.lab)
    if options.rig is None and not path.is_file():
        return None, f"This station has no rig file ({path}): palpate rig simulate, or palpate author --twins"
    file = read_rig(path)
    name = file.names_for("door_generator")[0]
    device = made(file.kind(name), name, file.devices[name], file.path.parent)
    from palpate.devices.door.link.simulator import DoorSimulator

    return (device, "") if isinstance(device, DoorSimulator) else (None, f"{path}: {name} is no door")


@contextmanager
def _alone(lab: Path) -> Iterator[None]:
    """One window for a lab at a time: two would keep their work in one file. Raises DesignError."""
    from filelock import FileLock, Timeout

    folder = designs_folder(lab)
    folder.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder / LOCK, timeout=0)
    try:
        lock.acquire()
    except Timeout:
        raise DesignError(f"{lab}: another window is making a door for this lab; close it first") from None
    try:
        yield
    finally:
        lock.release()
