"""One texture on a contact sheet: its picture, its name, and where it lies on each attribute."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from palpate.analysis.figures.style import FAINT, INK, PAPER, SOFT
from palpate.modeling.library.entries import Z90, Felt
from palpate.modeling.library.lettering import Pen

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

WIDE, GAP = 288, 22
"""Pixels of a tile and of what is between two."""
FINE = 3
"""Everything but the pictures is drawn so many times larger, and then made small: lines without steps."""
NAME, LINE, ROW = 46, 8, 19
"""Pixels of height: the name with its class, the bar of the fit, a row of an attribute."""
TRACK = (78, 210)
"""Where an attribute's scale begins and ends."""
WISHED, DOT, PREDICTED = "#bfe3d5", "#0072B2", "#D55E00"


@dataclass(frozen=True)
class Tile:
    """What is drawn of a texture. `fit` is the share of the bar that is filled; None: there is no bar."""

    name: str
    below: str
    beside: str
    fit: float | None
    attributes: Sequence[tuple[tuple[str, str], Felt | None, tuple[float, float] | None]]
    """Both words, the value, and the values that were wished for."""


def height_of(attributes: int) -> int:
    """Pixels below a tile's picture."""
    return NAME + LINE + 6 + ROW * attributes + 4


def draw_below(pen: Pen, tile: Tile, left: float, top: float) -> None:
    """All that stands below the picture; `left` and `top` in small pixels."""
    room = WIDE - pen.width(tile.beside, 13 * FINE, bold=True) / FINE - 10
    name = pen.fitted(tile.name, room * FINE, 14 * FINE, bold=True)
    pen.write((left * FINE, (top + 19) * FINE), name, 14 * FINE, INK, bold=True)
    beside = ((left + WIDE) * FINE, (top + 19) * FINE)
    pen.write(beside, tile.beside, 13 * FINE, INK, bold=True, anchor="rs")
    below = pen.fitted(tile.below, WIDE * FINE, 11 * FINE)
    pen.write((left * FINE, (top + 36) * FINE), below, 11 * FINE, SOFT)
    if tile.fit is not None:
        _bar(pen.draw, left, top + NAME, WIDE, 4, FAINT)
        _bar(pen.draw, left, top + NAME, WIDE * tile.fit, 4, INK)
    for place, (words, found, wished) in enumerate(tile.attributes):
        _attribute(pen, words, found, wished, left, top + NAME + LINE + 6 + ROW * place)


def draw_empty(pen: Pen, name: str, left: float, top: float) -> None:
    """In place of a picture that there is not: a plain field with the texture's name."""
    box = (left * FINE, top * FINE, (left + WIDE) * FINE - 1, (top + WIDE) * FINE - 1)
    pen.draw.rectangle(box, fill="#f0f2f4", outline=FAINT, width=FINE)
    middle = (left + WIDE / 2) * FINE
    shown = pen.fitted(name, (WIDE - 40) * FINE, 30 * FINE, bold=True)
    pen.write((middle, (top + WIDE / 2) * FINE), shown, 30 * FINE, SOFT, bold=True, anchor="ms")
    pen.write((middle, (top + WIDE / 2 + 26) * FINE), "no picture", 12 * FINE, SOFT, anchor="ms")


def _attribute(
    pen: Pen, words: tuple[str, str], found: Felt | None, wished: tuple[float, float] | None, left: float, top: float
) -> None:
    """Both words, the scale between them, the wished part of it, and the value with what holds 90 %."""
    start, end = (left + place for place in TRACK)
    middle, size = top + ROW / 2, 11 * FINE
    for word, place, anchor in ((words[0], start - 8, "rm"), (words[1], end + 8, "lm")):
        shown = pen.fitted(word, (TRACK[0] - 8) * FINE, size)
        pen.write((place * FINE, middle * FINE), shown, size, INK, anchor=anchor)
    if wished is not None:
        low, high = (_at(each, start, end) for each in wished)
        _bar(pen.draw, low, middle - 6, high - low, 12, WISHED)
    _bar(pen.draw, start, middle - 0.5, end - start, 1, SOFT)
    _bar(pen.draw, (start + end) / 2 - 0.5, middle - 3, 1, 6, SOFT)
    if found is not None:
        mark_value(pen.draw, found, middle, (start, end))


def mark_value(draw: ImageDraw, found: Felt, middle: float, track: tuple[float, float]) -> None:
    """The value: a disc where people rated, a ring where a model predicted; a bar holds 90 %."""
    colour = DOT if found.kind == "rated" else PREDICTED
    low, high, at = (_at(found.value + way * Z90 * found.sd, *track) for way in (-1, 1, 0))
    _bar(draw, low, middle - 1, high - low, 2, colour)
    box = ((at - 4) * FINE, (middle - 4) * FINE, (at + 4) * FINE, (middle + 4) * FINE)
    draw.ellipse(box, fill=colour if found.kind == "rated" else PAPER, outline=colour, width=2 * FINE - 1)


def _at(value: float, start: float, end: float) -> float:
    return start + (end - start) * min(100.0, max(0.0, value)) / 100


def _bar(draw: ImageDraw, left: float, top: float, wide: float, high: float, colour: str) -> None:
    if wide > 0:
        box = (left * FINE, top * FINE, max(left * FINE, (left + wide) * FINE - 1), (top + high) * FINE - 1)
        draw.rectangle(box, fill=colour)
