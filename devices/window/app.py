"""The base of windows that commands open: options, opening, and what their screens have in common."""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from palpate.devices.window.calibration import Calibration, read_calibration, station_file
from palpate.devices.window.fonts import find_fonts
from palpate.devices.window.geometry import Box, Metrics
from palpate.devices.window.hangul import needed
from palpate.devices.window.scenes import Stage
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base
from palpate.devices.window.screens.elements import Label
from palpate.devices.window.screens.frame import Frame
from palpate.devices.window.screens.targets import Button, Target
from palpate.devices.window.texts import MASTER, Texts
from palpate.devices.window.typeset import TITLE_STEPS, Typesetter

if TYPE_CHECKING:
    from palpate.devices.window.shell import Shell

NEVER = "never: not measured"


@dataclass(frozen=True, kw_only=True)
class WindowOptions:
    """The options of the window. `rig` None: the station's rig file; `screen` None: the calibrated screen."""

    lab: Path
    rig: Path | None = None
    twins: bool = False
    language: str = MASTER
    screen: int | None = None
    windowed: tuple[int, int] | None = None


@dataclass(frozen=True, kw_only=True)
class Status:
    """The message beside the window's controls, in the colour of a warning if `wrong`."""

    notice: str = ""
    wrong: bool = False


@dataclass
class WindowApp(Stage, ABC):
    """A window with one main page. It runs until `over`."""

    over: bool = field(default=False, kw_only=True)

    def run(self) -> None:
        """Show the window until it is closed."""
        self.begin()
        while not self.over:
            self.turn()

    @abstractmethod
    def begin(self) -> None:
        """Show the first page."""

    @abstractmethod
    def turn(self) -> None:
        """Handle the inputs since the last turn, and paint what changed."""


class AppScreen(Base):
    """The main page of a window. `requests` are left to the window."""

    LETTERS: ClassVar[Mapping[str, str]]
    """The actions of letters, also while Hangul is on."""
    shows_held = Target

    def __init__(self, page: Page) -> None:
        """Fill the page without the texts and buttons of a frame."""
        self.requests: list[str] = []
        super().__init__(Frame(page, "", "", (), ()))

    def typed(self, _name: str | None, text: str, /) -> None:
        for letter in text.strip().lower():
            if letter in self.LETTERS:
                self.do(self.LETTERS[letter])

    def go_back(self) -> None:
        """Do nothing, as no page comes before this one."""

    def do(self, name: str) -> None:
        """Do what a button or letter means."""
        self.requests.append(name)


@dataclass
class AppView:
    """A builder of the page's elements."""

    page: Page

    @cached_property
    def setter(self) -> Typesetter:
        """Return the typesetter of the page."""
        return Typesetter(self.page)

    def title(self, head: Box) -> Label:
        """Return the window's title, on the left of its head."""
        laid = self.setter.text(
            self.page.texts("title"), self.page.metrics.unit(90), head.height, TITLE_STEPS, bold=True
        )
        return Label("title", Box(head.left, head.top, laid.width, head.height), laid=laid)

    def close_button(self, box: Box) -> Button:
        """Return the button that closes the window."""
        return Button("close", box, laid=self.setter.text(self.page.texts("close"), box.width, box.height))


def calibration_at_hand(options: WindowOptions) -> Calibration:
    """Return the station's calibration; if its screen was never measured, one from the system's information.

    The latter is confirmed `NEVER`.
    """
    if station_file(options.lab).is_file():
        calibration = read_calibration(options.lab)
        return calibration if options.windowed is None else replace(calibration, size_px=options.windowed)
    from palpate.devices.window.commands_calibrate import USUAL_PX_PER_MM
    from palpate.devices.window.shell import screen_sizes
    from palpate.devices.window.shell_checks import demand_screen

    sizes, screen = screen_sizes(), options.screen or 0
    demand_screen(sizes, screen, None)
    return Calibration(options.windowed or sizes[screen], USUAL_PX_PER_MM, screen, NEVER)


@contextmanager
def opened_shell(calibration: Calibration, options: WindowOptions) -> Iterator[Shell]:
    """Open the window, and close it at the end. Raises WindowError."""
    from palpate.devices.window.shell import open_shell

    screen = calibration.screen if options.screen is None else options.screen
    shell = open_shell(calibration, screen, options.windowed is None)
    try:
        yield shell
    finally:
        shell.close()


def app_page(metrics: Metrics, texts: Texts) -> Page:
    """Return the page with these texts, and fonts for their language. Raises WindowError."""
    hangul = needed(texts.language, sys.platform)
    return Page(metrics, texts, find_fonts(texts.language), hangul=hangul)
