"""Cards of the composite form: the text of each question above what answers it, on as many sheets as needed.

What answers a question is laid out by its kind: buttons, a line, round buttons, or a field to write in.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from palpate.devices.window.geometry import NEAREST_TARGETS_MM, Box, WindowError
from palpate.devices.window.paint import QUIET
from palpate.devices.window.paint_text import BLANK, Laid, lay
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.cards import dealt, sheets_of, stacked
from palpate.devices.window.screens.elements import Card, Element, Label, rounding
from palpate.devices.window.screens.field_buttons import ButtonRow, button_row, key_pad
from palpate.devices.window.screens.field_words import ShownQuestion
from palpate.devices.window.screens.frame import STEPS, fitted
from palpate.devices.window.screens.sliders import SMALLER, Across, Track, across, labels_below, share_of
from palpate.devices.window.screens.targets import Points, Target
from palpate.protocols.fields import Choice, Confidence, NumberQuestion, ScaleQuestion
from palpate.protocols.study import Scale

WIDEST = 290.0
"""Width of the cards, in the design's millimetres."""
NUMBER, TEXT, TEXT_LINES = 44.0, 180.0, 3
"""Widths of fields in the design's millimetres, and how many lines a long text has."""
FEW, LARGE_STEPS = 3, (7.0, 6.4, 5.8, *STEPS)
"""Up to so many questions have larger texts and buttons where there is room; these are the em sizes.

Their numbers have keys to press, too.
"""
ERASE = "←"
"""The key that takes back the last character of a number."""
PAD, BETWEEN = 2.0, 1.6
BAND, PITCH, NARROWEST_ENDS, FIELD = 10.0, 17.0, 20.0, 12.0


@dataclass(frozen=True)
class PlacedField:
    """A question's place: `fixed` never changes, `targets` are its buttons or its line, `field` is its field's box."""

    number: int
    fixed: tuple[Element, ...]
    targets: tuple[Target, ...] = ()
    field: Box | None = None
    size: int = 0


class Control(Protocol):
    """What answers a question, at one size of text."""

    @property
    def height(self) -> int:
        """Return the least height."""

    def place(self, page: Page, room: Box, name: str) -> PlacedField:
        """Place it in the room; `name` is that of its card."""


@dataclass(frozen=True)
class _Buttons:
    row: ButtonRow

    @property
    def height(self) -> int:
        return self.row.height

    def place(self, page: Page, room: Box, name: str) -> PlacedField:
        return PlacedField(0, (), self.row.placed(page, room, name))


@dataclass(frozen=True)
class _Line:
    widths: Across
    scale: Scale
    low: Laid
    high: Laid
    labels: tuple[tuple[float, Laid], ...]

    @property
    def labels_px(self) -> int:
        return max((laid.height for _, laid in self.labels), default=0)

    @property
    def height(self) -> int:
        return max(self.widths.page.metrics.target(BAND), self.low.height, self.high.height) + self.labels_px

    def place(self, page: Page, room: Box, name: str) -> PlacedField:
        widths, unit = self.widths, page.metrics.unit
        left, tall = room.left + (room.width - widths.card_px) // 2, room.height - self.labels_px
        words = Box(left + unit(3), room.top, widths.words_px, tall)
        band_px = min(tall, round(1.5 * page.metrics.target(BAND)))
        band = Box(words.right + unit(3), room.top + (tall - band_px) // 2, widths.band_px, band_px)
        ticks = tuple(share_of(self.scale, value) for value in self.scale.ticked)
        track = Track(f"{name} line", band, name, line_px=widths.line_px, ticks=ticks)
        fixed = [
            Label(f"{name} low", words, name, self.low, align="right"),
            Label(f"{name} high", words.moved(band.right + unit(3) - words.left, 0), name, self.high),
        ]
        for n, (share, laid) in enumerate(self.labels):
            middle = track.line.left + round(share * (widths.line_px - 1))
            place = Box(middle - (laid.width + 1) // 2, words.bottom, laid.width + 1, laid.height)
            fixed.append(Label(f"{name} label {n}", place, name, laid, QUIET, "centre"))
        return PlacedField(0, tuple(fixed), (track,))


@dataclass(frozen=True)
class _Points:
    pitch: int
    tall: int
    ends: tuple[Laid, Laid]
    numerals: tuple[Laid, ...]

    @property
    def _beyond(self) -> int:
        """Return how far the words of the ends reach beyond the round buttons, above and below."""
        return max(0, max(end.height for end in self.ends) - self.tall + 1) // 2

    @property
    def height(self) -> int:
        return self._beyond + self.tall + max(self._beyond, self.numerals[0].height)

    def place(self, page: Page, room: Box, name: str) -> PlacedField:
        unit, count, below = page.metrics.unit, len(self.numerals), self.numerals[0].height
        wide, top = count * self.pitch, room.top + self._beyond + (room.height - self.height) // 2
        points = Box(room.left + (room.width - wide) // 2, top, wide, self.tall)
        side = points.left - unit(3) - room.left
        left = Box(room.left, points.top - self._beyond, side, self.tall + 2 * self._beyond)
        places = [Box(points.left + n * self.pitch, points.bottom, self.pitch, below) for n in range(count)]
        numerals = (
            Label(f"{name} numeral {n}", place, name, laid, QUIET, "centre")
            for n, (place, laid) in enumerate(zip(places, self.numerals, strict=True))
        )
        ends = (
            Label(f"{name} low", left, name, self.ends[0], align="right"),
            Label(f"{name} high", left.moved(points.right + unit(3) - left.left, 0), name, self.ends[1]),
        )
        return PlacedField(0, (*ends, *numerals), (Points(f"{name} points", points, name, count=count),))


@dataclass(frozen=True)
class _Field:
    width: int
    tall: int
    size: int
    unit: Laid | None = None
    pad: ButtonRow | None = None
    apart: int = 0

    @property
    def height(self) -> int:
        return self.tall + (0 if self.pad is None else self.apart + self.pad.height)

    def place(self, page: Page, room: Box, name: str) -> PlacedField:
        gap = page.metrics.unit(2)
        beside = 0 if self.unit is None else self.unit.width + gap
        left, top = room.left + (room.width - self.width - beside) // 2, room.top + (room.height - self.height) // 2
        box = Box(left, top, self.width, self.tall)
        fixed = []
        if self.unit is not None:
            fixed.append(Label(f"{name} unit", Box(box.right + gap, top, beside - gap, self.tall), name, self.unit))
        keys: tuple[Target, ...] = ()
        if self.pad is not None:
            below = Box(room.left, box.bottom + self.apart, room.width, self.pad.height)
            keys = self.pad.placed(page, below, name)
        return PlacedField(0, tuple(fixed), keys, box, self.size)


@dataclass(frozen=True)
class _Set:
    """A question at one size of text."""

    text: Laid
    optional: Laid | None
    control: Control
    height: int


def cards_of(page: Page, questions: Sequence[ShownQuestion], room: Box) -> list[list[PlacedField]]:
    """Return the questions of every sheet: one sheet if all fit, at the largest possible size.

    Raises WindowError if a text, or a line, does not fit.
    """
    width = min(room.width, page.metrics.unit(WIDEST))

    def sets(size: int) -> list[_Set] | None:
        sets_at_size = [_set(page, question, size, width, len(questions) <= FEW) for question in questions]
        return None if None in sets_at_size else [item for item in sets_at_size if item is not None]

    def heights(size: int) -> list[int] | None:
        sets_at_size = sets(size)
        return None if sets_at_size is None else [item.height for item in sets_at_size]

    chosen = sheets_of(page, room, len(questions), heights, LARGE_STEPS if len(questions) <= FEW else STEPS)
    if chosen is None or (sets_at_size := sets(chosen[1])) is None:
        raise _refusal(page, questions, width)
    sheets, number = [], 0
    for sheet in dealt(sets_at_size, chosen[0]):
        boxes = stacked(page, room, width, [item.height for item in sheet])
        pairs = zip(sheet, boxes, strict=True)
        sheets.append([_card(page, item, box, n) for n, (item, box) in enumerate(pairs, start=number)])
        number += len(sheet)
    return sheets


def _set(page: Page, question: ShownQuestion, size: int, width: int, few: bool) -> _Set | None:
    unit, inner = page.metrics.unit, width - 2 * page.metrics.unit(4)
    text = lay(page.fonts, question.text, size, inner, bold=True, even=True)
    control = _control(page, question, size, inner, few)
    small = max(round(SMALLER * size), page.metrics.text(0))
    optional = lay(page.fonts, page.texts("optional"), small, inner) if question.asked.optional else None
    if text is None or control is None or (optional is None and question.asked.optional):
        return None
    height = text.height + (0 if optional is None else optional.height) + unit(BETWEEN) + control.height + 2 * unit(PAD)
    return _Set(text, optional, control, height)


def _control(page: Page, question: ShownQuestion, size: int, width: int, few: bool) -> Control | None:
    """Return what answers a question at a size, or None if a text of it does not fit; one of a `few` is large."""
    match question.asked:
        case Choice():
            row = button_row(page, question.labels, size, width)
            return None if row is None else _Buttons(row)
        case ScaleQuestion():
            return _line(page, question, question.asked.scale, size, width)
        case Confidence():
            return _points(page, question, question.asked.points, size, width)
        case _:
            return _field(page, question, size, width, few)


def _line(page: Page, question: ShownQuestion, scale: Scale, size: int, width: int) -> _Line | None:
    widths = across(replace(page, length_mm=scale.length_mm), Box(0, 0, width, page.metrics.height_px))
    low, high = (lay(page.fonts, end, size, widths.words_px, even=True) if end else BLANK for end in question.ends)
    labels = labels_below(widths, scale, size)
    return None if low is None or high is None or labels is None else _Line(widths, scale, low, high, labels)


def _points(page: Page, question: ShownQuestion, points: int, size: int, width: int) -> _Points | None:
    least = page.metrics.target() + page.metrics.mm(NEAREST_TARGETS_MM) + 2
    room = (width - 2 * (page.metrics.unit(NARROWEST_ENDS) + page.metrics.unit(3))) // points
    pitch = max(least, min(page.metrics.unit(PITCH), room))
    ends_px = (width - points * pitch) // 2 - page.metrics.unit(3)
    low, high = (lay(page.fonts, end, size, max(1, ends_px), even=True) for end in question.ends)
    if low is None or high is None:
        return None
    small = max(round(SMALLER * size), page.metrics.text(0))
    numerals = tuple(Laid((str(n + 1),), small, pitch) for n in range(points))
    return _Points(pitch, page.metrics.target(11), (low, high), numerals)


def keys_of(question: NumberQuestion) -> tuple[str, ...]:
    """Return the keys that type an answer to a question: digits, the point, a minus where it may be below 0."""
    negative = (question.low is None and question.above is None) or min(question.low or 0, question.above or 0) < 0
    return (*"1234567890", ".", *(["-"] if negative else []), ERASE)


def _field(page: Page, question: ShownQuestion, size: int, width: int, few: bool) -> _Field | None:
    unit = lay(page.fonts, question.unit, size, width // 3) if question.unit else None
    if question.unit and unit is None:
        return None
    line = Laid(("",), size, 0).leading
    height = page.metrics.target(FIELD)
    if question.many_lines:
        height = max(height, TEXT_LINES * line + 2 * page.metrics.unit(3))
    pad, wide = None, page.metrics.unit(TEXT)
    if isinstance(question.asked, NumberQuestion):
        pad, wide = key_pad(page, keys_of(question.asked), size, width) if few else None, page.metrics.unit(NUMBER)
    return _Field(min(wide, width), height, size, unit, pad, page.metrics.unit(PAD))


def _card(page: Page, item: _Set, card: Box, number: int) -> PlacedField:
    unit, name = page.metrics.unit, f"question {number}"
    spare = card.height - item.height
    inner = Box(card.left + unit(4), card.top, card.width - 2 * unit(4), card.height)
    text = Box(inner.left, card.top + unit(PAD) + spare // 4, inner.width, item.text.height)
    fixed: list[Element] = [
        Card(name, card, radius=rounding(page)),
        Label(f"{name} text", text, name, item.text, align="centre"),
    ]
    bottom = text.bottom
    if item.optional is not None:
        below = Box(inner.left, bottom, inner.width, item.optional.height)
        fixed.append(Label(f"{name} optional", below, name, item.optional, QUIET, "centre"))
        bottom = below.bottom
    top = bottom + unit(BETWEEN)
    placed = item.control.place(
        page, Box(inner.left, top, inner.width, card.bottom - unit(PAD) - spare // 8 - top), name
    )
    return replace(placed, number=number, fixed=(*fixed, *placed.fixed))


def _refusal(page: Page, questions: Sequence[ShownQuestion], width: int) -> WindowError:
    """Return an error that names the text that does not fit; raise it directly if it is a single text."""
    inner, half = width - 2 * page.metrics.unit(4), page.metrics.height_px // 2
    for question in questions:
        fitted(page, question.text, inner, half, STEPS, bold=True)
        for text in (*question.labels, *filter(None, question.ends)):
            fitted(page, text, inner // 3, half, STEPS)
    return WindowError(f"the questions do not fit on a screen of {page.metrics}; shorten them or take a larger one")
