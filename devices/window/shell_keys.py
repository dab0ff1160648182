"""Which of pyglet's keys is which of ours. Imported only with an open window."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

from palpate.devices.window.inputs import KeyName
from palpate.devices.window.shell_ears import Keys

X_SYMBOLS: dict[int, KeyName] = {0xFF09: "tab", 0xFF31: "hangul"}
"""X11's symbols of Tab and of a Korean keyboard's Hangul key."""
X_HANGUL_TOO: dict[str, KeyName] = {"F9": "hangul", "RALT": "hangul"}
"""Where no input method composes Hangul, these keys switch it as well."""
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
"""Escape is left out: it does nothing for a participant."""


def keys_of(key: Any, handle: Any) -> Keys:
    """The keys by the numbers of `key` (pyglet.window.key), for the window of `handle`."""

    def numbered(names: Mapping[str, KeyName]) -> dict[int, KeyName]:
        return {int(getattr(key, name)): ours for name, ours in names.items() if hasattr(key, name)}

    if sys.platform in ("win32", "darwin") or not hasattr(handle, "_x_display"):
        return Keys(numbered(PLAIN), numbered(MOTIONS), numbered(REPEATING))
    plain = numbered(PLAIN | X_HANGUL_TOO) | _by_code(key, handle)
    return Keys(plain, numbered(MOTIONS), numbered(REPEATING))


def _by_code(key: Any, handle: Any) -> dict[int, KeyName]:
    """X11 has symbols that pyglet does not know, as that of Shift-Tab; it then reports the physical key."""
    from pyglet.libs.x11 import xlib

    found: dict[int, KeyName] = {}
    for symbol, name in X_SYMBOLS.items():
        code = xlib.XKeysymToKeycode(handle._x_display, symbol)
        if number := int.from_bytes(code, "little") if isinstance(code, bytes) else int(code):
            found[int(key.user_key(number))] = name
    return found
