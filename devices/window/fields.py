"""A text field: its text, its caret, and the visible part."""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass

from palpate.devices.window.fonts import Fonts
from palpate.protocols.forms import LONGEST_WORD, MOST_WORDS

JOINERS = "\u200c\u200d"
PLACEHOLDER = "□"
"""Replaces a character that no font here can draw; the answer keeps the character itself."""


@dataclass
class Writing:
    """A text being written, composed (NFC); the caret is before the character of that number."""

    text: str = ""
    caret: int = 0
    many_lines: bool = False

    def insert(self, text: str) -> bool:
        """Insert text at the caret, without control characters; return False if there is no room."""
        clean = "".join(c for c in text if unicodedata.category(c) != "Cc")
        return self._put(clean) if clean else True

    def new_line(self) -> bool:
        """Break the line at the caret if the field has several lines, and return whether it was broken."""
        return self.many_lines and self._put("\n")

    def backspace(self) -> None:
        """Delete the letter before the caret, including its marks."""
        start = before(self.text, self.caret)
        self.text, self.caret = self.text[:start] + self.text[self.caret :], start

    def replace_last(self, text: str) -> bool:
        """Replace the character before the caret; return False, unchanged, if there is no room."""
        whole, caret = self.text, self.caret
        self.text, self.caret = whole[: caret - 1] + whole[caret:], caret - 1
        if not self._put(text):
            self.text, self.caret = whole, caret
            return False
        return True

    def delete(self) -> None:
        """Delete the letter behind the caret."""
        self.text = self.text[: self.caret] + self.text[after(self.text, self.caret) :]

    def move(self, key: str) -> bool:
        """Move the caret by left, right, home or end; return False for other keys."""
        start = self.text.rfind("\n", 0, self.caret) + 1
        stop = self.text.find("\n", self.caret)
        places = {
            "left": before(self.text, self.caret),
            "right": after(self.text, self.caret),
            "home": start,
            "end": len(self.text) if stop < 0 else stop,
        }
        self.caret = places.get(key, self.caret)
        return key in places

    def words(self, separators: str = "") -> list[str]:
        """Return the entries, one per line or between separators: trimmed, without empty and repeated ones."""
        text = self.text
        for separator in separators:
            text = text.replace(separator, "\n")
        return list(dict.fromkeys(plain for line in text.split("\n") if (plain := " ".join(line.split()))))

    def _put(self, text: str) -> bool:
        head = unicodedata.normalize("NFC", self.text[: self.caret] + text)
        whole = unicodedata.normalize("NFC", head + self.text[self.caret :])
        lines = whole.split("\n")
        if len(lines) > MOST_WORDS or max(map(len, lines)) > LONGEST_WORD:
            return False
        self.text, self.caret = whole, min(len(head), len(whole))
        return True


@dataclass(frozen=True)
class View:
    """The visible lines, each with the number of its first character; `caret` is (line, x in pixels)."""

    lines: tuple[str, ...]
    starts: tuple[int, ...]
    caret: tuple[int, int]


def view(fonts: Fonts, writing: Writing, size: int, width: int, height_lines: int) -> View:
    """Return the visible part of the text: wrapped lines around the caret, or as much of a single line as fits."""
    lines = _wrapped(fonts, writing, size, width) if writing.many_lines else [_window(fonts, writing, size, width)]
    starts = [start for start, _ in lines]
    on = max(n for n, start in enumerate(starts) if start <= writing.caret)
    first = max(0, on - height_lines + 1)
    seen = lines[first : first + height_lines]
    x = round(_width(fonts, writing.text[starts[on] : writing.caret], size))
    return View(
        tuple(shown(fonts, text) for _, text in seen), tuple(starts[first : first + len(seen)]), (on - first, x)
    )


def place_at(fonts: Fonts, seen: View, size: int, line: int, x: float) -> int:
    """Return the position in the text nearest to a point in a visible line."""
    line = min(max(line, 0), len(seen.lines) - 1)
    return seen.starts[line] + _nearest(fonts, seen.lines[line], size, x)


def step(fonts: Fonts, writing: Writing, size: int, width: int, by: int) -> None:
    """Move the caret a line up or down, at the same distance from the left; it stays at the first and last line."""
    lines = _wrapped(fonts, writing, size, width)
    on = max(n for n, (start, _) in enumerate(lines) if start <= writing.caret)
    if 0 <= on + by < len(lines):
        x = _width(fonts, writing.text[lines[on][0] : writing.caret], size)
        start, text = lines[on + by]
        writing.caret = start + _nearest(fonts, text, size, x)


def _nearest(fonts: Fonts, text: str, size: int, x: float) -> int:
    """Return the number of letters to the left of a distance, rounded to the nearest gap."""
    places = [0]
    while places[-1] < len(text):
        places.append(after(text, places[-1]))
    return min(places, key=lambda place: abs(_width(fonts, text[:place], size) - x))


def shown(fonts: Fonts, text: str) -> str:
    """Return the text with a box for every character that no font can draw."""
    return "".join(
        c if unicodedata.category(c) in {"Cf", "Zs"} or fonts.face(c) is not None else PLACEHOLDER for c in text
    )


def before(text: str, place: int) -> int:
    """Return where the letter before a position begins, including its marks and joiners."""
    place = max(0, place - 1)
    while place > 0 and (_joins(text[place]) or text[place - 1] == JOINERS[1]):
        place -= 1
    return place


def after(text: str, place: int) -> int:
    """Return where the letter at a position ends."""
    place = min(len(text), place + 1)
    while place < len(text) and (_joins(text[place]) or text[place - 1] == JOINERS[1]):
        place += 1
    return place


def _joins(character: str) -> bool:
    return character in JOINERS or unicodedata.category(character).startswith("M")


def _width(fonts: Fonts, text: str, size: int) -> float:
    return fonts.width(shown(fonts, text), size)


def _wrapped(fonts: Fonts, writing: Writing, size: int, width: int) -> list[tuple[int, str]]:
    lines, start = [], 0
    for part in writing.text.split("\n"):
        line = part
        # A line is broken after a space where there is one, else between any two letters.
        while _width(fonts, line, size) > width:
            stop = _fitting(fonts, line, size, width)
            stop = line.rfind(" ", 1, stop) + 1 or stop
            lines.append((start, line[:stop]))
            start, line = start + stop, line[stop:]
        lines.append((start, line))
        start += len(line) + 1
    return lines


def _fitting(fonts: Fonts, text: str, size: int, width: int) -> int:
    """Return how many characters fit, at least one letter."""
    stop = after(text, 0)
    while stop < len(text) and _width(fonts, text[: after(text, stop)], size) <= width:
        stop = after(text, stop)
    return stop


def _window(fonts: Fonts, writing: Writing, size: int, width: int) -> tuple[int, str]:
    """Return the part of a single line that holds the caret, and where it begins."""
    start = 0
    while _width(fonts, writing.text[start : writing.caret], size) > width:
        start = after(writing.text, start)
    rest = writing.text[start:]
    return start, rest if _width(fonts, rest, size) <= width else rest[: _fitting(fonts, rest, size, width)]
