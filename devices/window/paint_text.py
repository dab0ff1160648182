"""Text in lines: measured, wrapped, and drawn run by run on a common baseline."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from palpate.devices.window.fonts import Fonts, Run
from palpate.devices.window.geometry import Box
from palpate.devices.window.paint import Colour

if TYPE_CHECKING:
    from PIL import Image

LEADING = 1.42
"""Height of a line in ems, with room for the marks above and below the letters of every script."""
BASELINE = 1.04
BEARING = 0.1
"""Free space, in ems, on either side of a line: some letters extend beyond their width."""
Align = Literal["left", "centre", "right"]
EVENING = (0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6, 0.55, 0.5)
"""Shares of the width that lines are narrowed to, for lines of similar length."""
_SPACE = r"[^\S\u00a0\u202f]"
_PIECES = re.compile(rf"{_SPACE}+|(?:(?!{_SPACE})[^/\-–—])+[/\-–—]*|[/\-–—]+")
_UNSPACED = ((0x2E80, 0x312F), (0x31A0, 0x9FFF), (0xF900, 0xFAFF), (0xFF00, 0xFF60), (0x20000, 0x3FFFF))
"""Chinese and Japanese characters, between any two of which a line can break."""


@dataclass(frozen=True)
class Laid:
    """Text broken into lines at an em size in pixels."""

    lines: tuple[str, ...]
    size: int
    width: int
    bold: bool = False

    @property
    def leading(self) -> int:
        """Return the height of one line."""
        return round(LEADING * self.size)

    @property
    def height(self) -> int:
        """Return the height of all lines."""
        return self.leading * len(self.lines)

    @property
    def text(self) -> str:
        """Return the text, for error messages."""
        return " ".join(self.lines)


BLANK = Laid((), 1, 0)


def lay(
    fonts: Fonts, text: str, size: int, width: int | None = None, bold: bool = False, even: bool = False
) -> Laid | None:
    """Return the text wrapped to a width in pixels, or None if a word is wider; line breaks are kept.

    `even` makes lines of similar length, for labels.
    """
    key = text, size, width, bold, even
    if key not in fonts.laid:
        fonts.laid[key] = _laid(fonts, *key)
    laid: Laid | None = fonts.laid[key]
    return laid


def _laid(fonts: Fonts, text: str, size: int, width: int | None, bold: bool, even: bool) -> Laid | None:
    text = unicodedata.normalize("NFC", text)
    beside = 2 * bearing(size)
    width = None if width is None else width - beside
    lines: list[str] = []
    for part in text.split("\n"):
        wrap = _evened if even else _wrapped
        wrapped = [part] if width is None else wrap(fonts, part, size, width, bold)
        if wrapped is None:
            return None
        lines += wrapped
    widest = max((ceiled(fonts.width(line, size, bold)) for line in lines), default=0)
    return Laid(tuple(lines), size, widest + beside, bold)


def draw(image: Image.Image, fonts: Fonts, laid: Laid, box: Box, colour: Colour, align: Align = "left") -> None:
    """Draw the lines into the box, vertically centred."""
    for run, x, baseline in _placed_runs(fonts, laid, box, align):
        mask = fonts.mask(run.face, laid.size, run.text)
        image.paste(colour, (round(x) + mask.left, baseline + mask.top), mask.image)


def ink(fonts: Fonts, laid: Laid, box: Box, align: Align = "left") -> Box | None:
    """Return the pixels that `draw` covers; None if nothing is visible."""
    covered: Box | None = None
    for run, x, baseline in _placed_runs(fonts, laid, box, align):
        bounds = fonts.font(run.face, laid.size).getbbox(run.text, anchor="ls")
        left, top, right, bottom = (round(edge) for edge in bounds)
        if right > left and bottom > top:
            one = Box(round(x) + left, baseline + top, right - left, bottom - top)
            covered = one if covered is None else covered.joined(one)
    return covered


def bearing(size: int) -> int:
    """Return the free space on either side of a line at an em size, in pixels."""
    return round(BEARING * size)


def ceiled(width: float) -> int:
    """Return a width in whole pixels, rounded up."""
    return int(-(-width // 1))


def _placed_runs(fonts: Fonts, laid: Laid, box: Box, align: Align) -> Iterator[tuple[Run, float, int]]:
    """Yield (run, x, baseline) of every run of every line."""
    for line, start, baseline in _places(fonts, laid, box, align):
        x = start
        for run in fonts.runs(line, laid.bold):
            yield run, x, baseline
            x += float(fonts.font(run.face, laid.size).getlength(run.text))


def _places(fonts: Fonts, laid: Laid, box: Box, align: Align) -> Iterator[tuple[str, float, int]]:
    """Yield (line, x, baseline) of every line."""
    top = box.top + (box.height - laid.height) // 2
    for number, line in enumerate(laid.lines):
        spare = box.width - fonts.width(line, laid.size, laid.bold)
        side = bearing(laid.size)
        indent = {"left": float(side), "centre": spare / 2, "right": spare - side}[align]
        yield line, float(round(box.left + indent)), top + laid.leading * number + round(BASELINE * laid.size)


def _wrapped(fonts: Fonts, text: str, size: int, width: int, bold: bool) -> list[str] | None:
    lines, line = [], ""
    # What stays together on a line: words, with dashes and slashes at their ends, and single ideographs.
    for piece in [part for word in _PIECES.findall(text) for part in _split_unspaced(word)]:
        if line and ceiled(fonts.width((line + piece).rstrip(), size, bold)) > width:
            lines.append(line.rstrip())
            line = ""
        line = line + piece if line else piece.lstrip()
        if ceiled(fonts.width(line.rstrip(), size, bold)) > width:
            return None
    return [*lines, line.rstrip()]


def _evened(fonts: Fonts, text: str, size: int, width: int, bold: bool) -> list[str] | None:
    """Return lines of similar length, as few as possible; None if a word is too wide."""
    lines = _wrapped(fonts, text, size, width, bold)
    if lines is None or len(lines) < 2:
        return lines
    for share in EVENING:
        other = _wrapped(fonts, text, size, round(share * width), bold)
        if other is None or len(other) > len(lines):
            break
        lines = other
    return lines


def _split_unspaced(piece: str) -> list[str]:
    parts = [""]
    for character in piece:
        alone = any(first <= ord(character) <= last for first, last in _UNSPACED)
        if alone and parts[-1] and unicodedata.category(character) not in ("Pe", "Po", "Pf"):
            parts.append("")
        parts[-1] += character
    return [part for part in parts if part]
