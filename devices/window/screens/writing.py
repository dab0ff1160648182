"""A text field on a screen: its place, its text, and its mouse and keyboard handling."""

from __future__ import annotations

from dataclasses import dataclass, field

from palpate.devices.window.fields import View, Writing, place_at, step, view
from palpate.devices.window.geometry import Box
from palpate.devices.window.hangul import KEYS, joined, shortened
from palpate.devices.window.inputs import Key
from palpate.devices.window.paint_text import LEADING, Laid, bearing
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.targets import TextBox, inside


@dataclass
class FieldOn:
    """A text field with its place; `size` is the em size of its text."""

    page: Page
    name: str
    box: Box
    size: int
    writing: Writing = field(default_factory=Writing)
    within: str = ""
    placeholder: Laid | None = None
    hangul_on: bool = True
    composed_to: int | None = None
    """Position of the caret while the character before it is being composed; None otherwise."""

    @property
    def pad(self) -> int:
        """Return the padding between frame and text."""
        return self.page.metrics.unit(3 if self.writing.many_lines else 2)

    @property
    def _inner(self) -> Box:
        return inside(self.box, self.pad, round(LEADING * self.size))

    @property
    def _view(self) -> View:
        inner = self._inner
        lines = max(1, inner.height // round(LEADING * self.size)) if self.writing.many_lines else 1
        return view(self.page.fonts, self.writing, self.size, self._width, lines)

    @property
    def _width(self) -> int:
        """Return the width of a line, with a little room for the caret."""
        return self._inner.width - self.size // 3

    def element(self, focused: bool, off: bool = False) -> TextBox:
        """Return the field as it looks now, with the caret."""
        seen = self._view
        empty = self.placeholder if not self.writing.text else None
        return TextBox(
            self.name, self.box, self.within, focused=focused, lines=seen.lines, size=self.size,
            caret=seen.caret if focused else None, pad=self.pad, off=off, placeholder=empty,
        )  # fmt: skip

    def press(self, x: float, y: float) -> None:
        """Move the caret to where the field was pressed."""
        self.composed_to = None
        inner = self._inner
        line = int((y - inner.top) // round(LEADING * self.size)) if self.writing.many_lines else 0
        self.writing.caret = place_at(self.page.fonts, self._view, self.size, line, x - inner.left - bearing(self.size))

    def type(self, text: str) -> None:
        """Insert typed text; if Hangul is composed here and on, Latin keys write it."""
        if not (self.page.hangul and self.hangul_on):
            self.writing.insert(text)
            return
        for character in text:
            # Write one key's letter, joined to the syllable that is being composed; anything else ends that.
            jamo, composing = KEYS.get(character), self._composing
            if jamo is not None and composing:
                self.writing.replace_last(joined(composing, jamo))
            else:
                self.writing.insert(jamo or character)
            self.composed_to = None if jamo is None else self.writing.caret

    def key(self, event: Key) -> bool:
        """Handle a key while writing; return False for a key that the screen handles."""
        composing, self.composed_to = self._composing, None
        match event.name:
            case "hangul":
                self.hangul_on = not self.hangul_on
            case "backspace" if composing:
                left = shortened(composing)
                self.writing.replace_last(left)
                self.composed_to = self.writing.caret if left else None
            case "backspace":
                self.writing.backspace()
            case "delete":
                self.writing.delete()
            case "enter":
                return self.writing.new_line() or self.writing.many_lines
            case "up" | "down" if self.writing.many_lines:
                step(self.page.fonts, self.writing, self.size, self._width, -1 if event.name == "up" else 1)
            case "space":
                return True
            case _:
                return self.writing.move(event.name)
        return True

    @property
    def _composing(self) -> str:
        """Return the character that is being composed, or ""."""
        caret = self.writing.caret
        return self.writing.text[caret - 1 : caret] if self.composed_to == caret > 0 else ""


def with_hangul(page: Page, hint: str) -> str:
    """Return a hint, with the key that switches between Hangul and Latin if there is one."""
    return f"{hint}   {page.texts('hangul_hint')}" if page.hangul else hint
