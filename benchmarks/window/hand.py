"""A hand at the mouse and the keyboard of an X display (XTEST), which also captures its picture."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from PIL import Image

NAMES = {
    "left": "Left", "right": "Right", "up": "Up", "down": "Down", "home": "Home", "end": "End",
    "pageup": "Prior", "pagedown": "Next", "tab": "Tab", "enter": "Return", "space": "space",
    "backspace": "BackSpace", "delete": "Delete", "escape": "Escape", "shift": "Shift_L", "alt": "Alt_L", "f4": "F4",
}  # fmt: skip
"""X's names of Palpate's keys."""
UNICODE = 0x0100_0000
"""X's symbol of a character is its code point plus this; for Latin 1 it is the code point."""


class Hand:
    """A hand that acts on a display as a person would; an act has reached the X server when its method returns."""

    def __init__(self, display: str) -> None:
        from Xlib import XK, X
        from Xlib.display import Display
        from Xlib.ext import xtest

        self._x, self._xk, self._fake = X, XK, xtest.fake_input
        self.display = Display(display)
        self._spare = [code for code in range(255, 8, -1) if not self.display.keycode_to_keysym(code, 0)]
        self._key_codes: dict[int, int] = {}

    def move(self, x: float, y: float) -> None:
        """Move the pointer."""
        self._do(self._motion(x, y))

    def press(self, button: int = 1) -> None:
        """Press a button: 1 left, 2 middle, 3 right."""
        self._do([(self._x.ButtonPress, {"detail": button})])

    def release(self, button: int = 1) -> None:
        """Release a button."""
        self._do([(self._x.ButtonRelease, {"detail": button})])

    def click(self, x: float, y: float) -> None:
        """Move, press and release, one after the other."""
        self.move(x, y)
        self.press()
        self.release()

    def tap(self, x: float, y: float) -> None:
        """Press and release in one packet, with no frame between them."""
        press, release = (self._x.ButtonPress, {"detail": 1}), (self._x.ButtonRelease, {"detail": 1})
        self._do([*self._motion(x, y), press, release])

    def drag(self, path: Sequence[tuple[float, float]]) -> None:
        """Press at the first point, move through the others, release at the last."""
        self.move(*path[0])
        self.press()
        for x, y in path[1:]:
            self.move(x, y)
        self.release()

    def key(self, *names: str) -> None:
        """Press keys together, such as `shift`, `tab`; release them in reverse order."""
        codes = [self.display.keysym_to_keycode(self._xk.string_to_keysym(NAMES.get(name, name))) for name in names]
        self._do([(self._x.KeyPress, {"detail": code}) for code in codes])
        self._do([(self._x.KeyRelease, {"detail": code}) for code in reversed(codes)])

    def hold(self, code: int) -> None:
        """Press the key with a code and keep it down: the server repeats it."""
        self._do([(self._x.KeyPress, {"detail": code})])

    def let_go(self, code: int) -> None:
        """Release the key with a code."""
        self._do([(self._x.KeyRelease, {"detail": code})])

    def add_keys_for(self, text: str) -> None:
        """Assign a key to every character of the text; windows that open later know these keys."""
        for character in sorted(set(text) - {chr(symbol) for symbol in self._key_codes}):
            code = self._spare.pop()
            self.display.change_keyboard_mapping(code, [[_symbol(character)] * 4])
            self._key_codes[ord(character)] = code
        self.display.sync()

    def type(self, text: str) -> None:
        """Press the key of every character, as assigned by `add_keys_for`."""
        for character in text:
            code = self._key_codes[ord(character)]
            self._do([(self._x.KeyPress, {"detail": code}), (self._x.KeyRelease, {"detail": code})])

    def picture(self, left: int = 0, top: int = 0, width: int = 0, height: int = 0) -> Image.Image:
        """Return the display's picture in RGB, by default all of it."""
        from PIL import Image

        screen = self.display.screen()
        size = width or screen.width_in_pixels, height or screen.height_in_pixels
        image = screen.root.get_image(left, top, *size, self._x.ZPixmap, 0xFFFFFFFF)
        return Image.frombytes("RGB", size, image.data, "raw", "BGRX")

    def windows(self, title: str) -> list[Any]:
        """Return the top-level windows with this title."""
        return [window for window in self.display.screen().root.query_tree().children if window.get_wm_name() == title]

    def close(self) -> None:
        """Close the connection to the display."""
        self.display.close()

    def _motion(self, x: float, y: float) -> list[tuple[int, dict[str, int]]]:
        return [(self._x.MotionNotify, {"x": round(x), "y": round(y)})]

    def _do(self, acts: Iterable[tuple[int, dict[str, int]]]) -> None:
        for kind, details in acts:
            self._fake(self.display, kind, **details)
        self.display.sync()


def _symbol(character: str) -> int:
    return ord(character) if ord(character) < 0x100 else UNICODE + ord(character)
