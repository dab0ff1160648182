"""The window system's events, recorded at once with their times: nothing is polled, so no tap is too short.

pyglet's keys are mapped to our names once a window is open.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from palpate.devices.window.inputs import Input, Key, KeyName, Moved, Pressed, Released, Typed

LEFT, SHIFT = 1, 1
"""Pyglet's numbers for the left button and the shift key."""
Handled = Literal[True]
X_SYMBOLS: dict[int, KeyName] = {0xFF09: "tab", 0xFF31: "hangul"}
"""X11's symbols of Tab and of a Korean keyboard's Hangul key."""
X_HANGUL_TOO: dict[str, KeyName] = {"F9": "hangul", "RALT": "hangul"}
"""Keys that also switch Hangul, if no input method composes it."""
PLAIN: dict[str, KeyName] = {
    "TAB": "tab", "ENTER": "enter", "NUM_ENTER": "enter", "SPACE": "space", "NUM_SPACE": "space",
    "NUM_LEFT": "left", "NUM_RIGHT": "right", "NUM_UP": "up", "NUM_DOWN": "down",
    "NUM_HOME": "home", "NUM_END": "end", "NUM_PAGE_UP": "pageup", "NUM_PAGE_DOWN": "pagedown",
    "NUM_DELETE": "delete",
}  # fmt: skip
MOTIONS: dict[str, KeyName] = {
    "MOTION_LEFT": "left", "MOTION_RIGHT": "right", "MOTION_UP": "up", "MOTION_DOWN": "down",
    "MOTION_PREVIOUS_WORD": "left", "MOTION_NEXT_WORD": "right",
    "MOTION_BEGINNING_OF_LINE": "home", "MOTION_END_OF_LINE": "end",
    "MOTION_BEGINNING_OF_FILE": "home", "MOTION_END_OF_FILE": "end",
    "MOTION_PREVIOUS_PAGE": "pageup", "MOTION_NEXT_PAGE": "pagedown",
    "MOTION_BACKSPACE": "backspace", "MOTION_DELETE": "delete",
}  # fmt: skip
REPEATING: dict[str, KeyName] = {
    "LEFT": "left", "RIGHT": "right", "UP": "up", "DOWN": "down", "HOME": "home", "END": "end",
    "PAGEUP": "pageup", "PAGEDOWN": "pagedown", "BACKSPACE": "backspace", "DELETE": "delete",
}  # fmt: skip
"""Keys that repeat; Escape is left out, as it does nothing for a participant."""


@dataclass(frozen=True)
class Keys:
    """The keys by the window system's numbers.

    The keys in `repeating` are reported as motions, which repeat while such a key is held.
    """

    plain: Mapping[int, KeyName]
    motions: Mapping[int, KeyName]
    repeating: Mapping[int, KeyName]


@dataclass
class Ears:
    """The handlers of a window's events. Each returns True, so that PsychoPy's own handlers never run.

    Only one press at a time, of the left button, is recorded; others are ignored meanwhile. `trouble` says why the
    window can no longer be used, `uncovered` that it has to be redrawn.
    """

    size: tuple[int, int]
    keys: Keys
    now_s: Callable[[], float]
    heard: list[Input] = field(default_factory=list)
    held: bool = False
    down: set[KeyName] = field(default_factory=set)
    stale: set[KeyName] = field(default_factory=set)
    trouble: str | None = None
    uncovered: bool = False

    def hand_over(self) -> list[Input]:
        """Return the inputs since the last call."""
        heard, self.heard = self.heard, []
        return heard

    def forget(self) -> None:
        """Drop the inputs so far; repeats of a key that is held now are ignored until it is pressed again."""
        self.heard.clear()
        self.stale = set(self.down)

    def handlers(self) -> dict[str, Callable[..., Handled]]:
        """Return the handlers by the names of pyglet's events."""
        heard: dict[str, Callable[..., Handled]] = {
            "on_mouse_press": self.press, "on_mouse_release": self.release,
            "on_mouse_drag": self.drag, "on_mouse_motion": self.motion,
            "on_key_press": self.key, "on_key_release": self.key_up, "on_text": self.text,
            "on_text_motion": self.repeating, "on_text_motion_select": self.repeating_with_shift,
            "on_resize": self.resized, "on_expose": self.expose,
        }  # fmt: skip
        unheard = ("on_close", "on_mouse_scroll", "on_mouse_enter", "on_mouse_leave", "on_move")
        return {**heard, **dict.fromkeys(unheard, self.ignore)}

    def press(self, x: float, y: float, button: int, _modifiers: int) -> Handled:
        """Record that a button was pressed."""
        if button == LEFT and not self.held:
            self.held = True
            self.heard.append(Pressed(x, self._down(y), self.now_s()))
        return True

    def release(self, x: float, y: float, button: int, _modifiers: int) -> Handled:
        """Record that a button was released."""
        if button == LEFT:
            self._let_go(x, y)
        return True

    def drag(self, x: float, y: float, _dx: float, _dy: float, buttons: int, _modifiers: int) -> Handled:
        """Record that the pointer moved with a button held."""
        if not buttons & LEFT:
            self._let_go(x, y)
        elif self.held:
            self.heard.append(Moved(x, self._down(y), self.now_s()))
        return True

    def motion(self, x: float, y: float, _dx: float, _dy: float) -> Handled:
        """Record that the pointer moved with no button held, which also ends a press whose release was lost."""
        self._let_go(x, y)
        return True

    def key(self, symbol: int, modifiers: int) -> Handled:
        """Record that a key was pressed; repeats are reported as motions."""
        if (held := self.keys.repeating.get(symbol)) is not None:
            self.down.add(held)
        if (name := self.keys.plain.get(symbol)) is not None:
            self.heard.append(Key(name, bool(modifiers & SHIFT), self.now_s()))
        return True

    def key_up(self, symbol: int, _modifiers: int) -> Handled:
        """Record that a key was released."""
        if (held := self.keys.repeating.get(symbol)) is not None:
            self.down.discard(held)
            self.stale.discard(held)
        return True

    def text(self, text: str) -> Handled:
        """Record text; keys that do not write are reported as keys."""
        if written := "".join(character for character in text if character.isprintable()):
            self.heard.append(Typed(written, self.now_s()))
        return True

    def repeating(self, motion: int, shift: bool = False) -> Handled:
        """Record that an arrow or similar key was pressed, or repeats."""
        if (name := self.keys.motions.get(motion)) is not None and name not in self.stale:
            self.heard.append(Key(name, shift, self.now_s()))
        return True

    def repeating_with_shift(self, motion: int) -> Handled:
        """Record that such a key was pressed, or repeats, with shift held."""
        return self.repeating(motion, shift=True)

    def resized(self, width: int, height: int) -> Handled:
        """Check the window's size: any other than the calibrated one is trouble."""
        if (width, height) != self.size:
            then, now = f"{self.size[0]}x{self.size[1]}", f"{width}x{height}"
            self.trouble = (
                f"the window was opened at {then} px and now has {now}: the lengths on it would be wrong. Set the "
                "screen back and resume the session (palpate resume), or measure it again (palpate window calibrate)"
            )
        return True

    def expose(self) -> Handled:
        """Record that the window was uncovered."""
        self.uncovered = True
        return True

    def ignore(self, *_details: Any) -> Handled:
        """Ignore the event: a participant cannot close the window."""
        return True

    def _let_go(self, x: float, y: float) -> None:
        if self.held:
            self.held = False
            self.heard.append(Released(x, self._down(y), self.now_s()))

    def _down(self, y: float) -> float:
        """Return the pixels from the top; pyglet counts from the bottom."""
        return self.size[1] - 1 - y


def keys_of(key: Any, handle: Any) -> Keys:
    """Return the keys by the numbers of `key` (pyglet.window.key), for the window of `handle`."""

    def numbered(names: Mapping[str, KeyName]) -> dict[int, KeyName]:
        return {int(getattr(key, name)): ours for name, ours in names.items() if hasattr(key, name)}

    if sys.platform in ("win32", "darwin") or not hasattr(handle, "_x_display"):
        return Keys(numbered(PLAIN), numbered(MOTIONS), numbered(REPEATING))
    plain = numbered(PLAIN | X_HANGUL_TOO) | _by_code(key, handle)
    return Keys(plain, numbered(MOTIONS), numbered(REPEATING))


def _by_code(key: Any, handle: Any) -> dict[int, KeyName]:
    """Return keys by their physical codes, for X11 symbols that pyglet does not know, such as Shift-Tab's."""
    from pyglet.libs.x11 import xlib

    names: dict[int, KeyName] = {}
    for symbol, name in X_SYMBOLS.items():
        code = xlib.XKeysymToKeycode(handle._x_display, symbol)
        if number := int.from_bytes(code, "little") if isinstance(code, bytes) else int(code):
            names[int(key.user_key(number))] = name
    return names
