"""A participant's inputs by mouse and keyboard, as a screen gets them.

Pixels count from the top left, y down. t_s are seconds since the screen was shown, pauses excluded.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

KeyName = Literal[
    "left", "right", "up", "down", "home", "end", "pageup", "pagedown",
    "tab", "enter", "space", "backspace", "delete", "escape", "hangul",
]  # fmt: skip


@dataclass(frozen=True)
class Pressed:
    """A press of the left button."""

    x: float
    y: float
    t_s: float


@dataclass(frozen=True)
class Moved:
    """A move of the pointer while the button was held."""

    x: float
    y: float
    t_s: float


@dataclass(frozen=True)
class Released:
    """A release of the left button."""

    x: float
    y: float
    t_s: float


@dataclass(frozen=True)
class Key:
    """A press or repeat of a key that does not write; the space bar gives both this and Typed(" ")."""

    name: KeyName
    shift: bool
    t_s: float


@dataclass(frozen=True)
class Typed:
    """Text that was entered, one character or more, composed by the system's input method."""

    text: str
    t_s: float


Input = Pressed | Moved | Released | Key | Typed
