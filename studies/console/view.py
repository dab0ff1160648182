"""What a display is given to show, and what it must be able to do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from palpate.devices.desk import Prompt
from palpate.studies.console.board import Board
from palpate.studies.console.entry import IDLE, Entry


@dataclass(frozen=True)
class View:
    """The board, and around it: the demand that stands, the line being typed, a word to the typist, devices' states."""

    board: Board
    prompt: Prompt | None = None
    entry: Entry = IDLE
    hint: str = ""
    states: Mapping[str, Any] = field(default_factory=dict)
    help: bool = False


class Display(Protocol):
    """Where the experimenter looks. Every method returns at once; a thread of the display's own does the work."""

    def show(self, view: View) -> None:
        """Show this from now on."""

    def say(self, line: str) -> None:
        """Tell what happened, where there is a line for it."""

    def close(self) -> None:
        """Leave the terminal as it was found; again does nothing."""
