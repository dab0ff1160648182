"""Where questions about the person stand: each on a card, its text to the left, what answers it to the right."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from palpate.devices.window.geometry import Box, WindowError
from palpate.devices.window.paint_text import BLANK, Laid, lay
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.cards import dealt, sheets_of, stacked
from palpate.devices.window.screens.elements import Card, Element, Label, rounding
from palpate.devices.window.screens.frame import STEPS, fitted
from palpate.devices.window.screens.targets import Dot
from palpate.protocols.forms import Question

WIDEST = 300.0
ASKED_SHARE = 0.40
NUMBER, TEXT = 34.0, 84.0
"""Widths of fields, in the design's millimetres."""
PAD = 1.6
NONE = "none"


@dataclass(frozen=True)
class Option:
    """Something to choose: an answer, or None for preferring not to say."""

    name: str
    value: str | None
    dot: Dot


@dataclass(frozen=True)
class Asked:
    """One question's place; `field` is where its field stands, if it has one."""

    number: int
    fixed: tuple[Element, ...]
    options: tuple[Option, ...]
    field: Box | None
    size: int


@dataclass(frozen=True)
class _Cell:
    """Something in the right column, before it has a place there: `name` is empty for a plain text."""

    name: str
    width: int
    laid: Laid | None = None
    value: str | None = None


@dataclass(frozen=True)
class _Set:
    question: Question
    text: Laid
    lines: tuple[tuple[_Cell, ...], ...]
    size: int
    height: int


def questions_on(page: Page, questions: Sequence[Question], room: Box) -> list[list[Asked]]:
    """The questions of every sheet. Raises WindowError where a text does not fit."""
    width = min(room.width, page.metrics.unit(WIDEST))

    def sets(size: int) -> list[_Set] | None:
        found = [_set(page, question, size, width) for question in questions]
        return None if None in found else [each for each in found if each is not None]

    def heights(size: int) -> list[int] | None:
        found = sets(size)
        return None if found is None else [each.height for each in found]

    chosen = sheets_of(page, room, len(questions), heights)
    if chosen is None or (found := sets(chosen[1])) is None:
        raise _refusal(page, questions, width)
    sheets, number = [], 0
    for sheet in dealt(found, chosen[0]):
        boxes = stacked(page, room, width, [each.height for each in sheet])
        sheets.append(
            [_asked(page, each, box, number + n) for n, (each, box) in enumerate(zip(sheet, boxes, strict=True))]
        )
        number += len(sheet)
    return sheets


def _set(page: Page, question: Question, size: int, width: int) -> _Set | None:
    unit = page.metrics.unit
    text = lay(page.fonts, page.say(question.text), size, _asked_px(page, width), even=True)
    lines = _flowed(page, list(_cells(page, question, size)), width - _asked_px(page, width) - 4 * unit(3))
    if text is None or lines is None:
        return None
    tall = len(lines) * page.metrics.target(10) + (len(lines) - 1) * unit(1.2)
    return _Set(question, text, lines, size, max(text.height, tall) + 2 * unit(PAD))


def _cells(page: Page, question: Question, size: int) -> Iterator[_Cell]:
    """What stands in the right column, in order."""
    unit = page.metrics.unit
    if question.kind != "choice":
        yield _Cell("field", unit(NUMBER if question.kind == "number" else TEXT))
        if question.unit:
            laid = Laid((page.say(question.unit),), size, 0)
            yield _Cell("", round(page.fonts.width(laid.text, size)) + unit(4), laid)
    for n, (value, label) in enumerate(question.levels if question.kind == "choice" else ()):
        yield _option(page, f"option {n}", page.say(label), value, size)
    if question.optional:
        yield _option(page, NONE, page.texts("prefer_not_to_say"), None, size)


def _option(page: Page, name: str, label: str, value: str | None, size: int) -> _Cell:
    laid = lay(page.fonts, label, size) or Laid((label,), size, 0)
    probe = Dot("", Box(0, 0, 10_000, page.metrics.target(10)), laid=laid)
    beside = 10_000 - probe.text_box(page).width
    return _Cell(name, laid.width + beside + page.metrics.unit(2), laid, value)


def _flowed(page: Page, cells: list[_Cell], width: int) -> tuple[tuple[_Cell, ...], ...] | None:
    """The cells in lines no wider than the column, or None where one alone is wider."""
    gap = page.metrics.unit(2)
    lines: list[list[_Cell]] = [[]]
    for cell in cells:
        if cell.width > width:
            return None
        used = sum(each.width + gap for each in lines[-1])
        if lines[-1] and used + cell.width > width:
            lines.append([])
        lines[-1].append(cell)
    return tuple(tuple(line) for line in lines)


def _asked(page: Page, texts: _Set, card: Box, number: int) -> Asked:
    unit, name = page.metrics.unit, f"question {number}"
    height, gap = page.metrics.target(10), unit(1.2)
    block = len(texts.lines) * height + (len(texts.lines) - 1) * gap
    left, top = card.left + 2 * unit(3) + _asked_px(page, card.width), card.top + (card.height - block) // 2
    fixed: list[Element] = [
        Card(name, card, radius=rounding(page)),
        Label(
            f"{name} text",
            Box(card.left + unit(4), card.top, _asked_px(page, card.width), card.height),
            name,
            texts.text,
        ),
    ]
    options, field = [], None
    for line in texts.lines:
        x = left
        for cell in line:
            box = Box(x, top, cell.width, height)
            if cell.name == "field":
                field = box
            elif not cell.name:
                fixed.append(Label(f"{name} unit", box, name, cell.laid or BLANK))
            else:
                dot = Dot(f"{name} {cell.name}", box, name, laid=cell.laid)
                options.append(Option(dot.name, cell.value, dot))
            x += cell.width + unit(2)
        top += height + gap
    return Asked(number, tuple(fixed), tuple(options), field, texts.size)


def _asked_px(page: Page, width: int) -> int:
    return round(ASKED_SHARE * width) - page.metrics.unit(4)


def _refusal(page: Page, questions: Sequence[Question], width: int) -> WindowError:
    """Which text is at fault. Raises WindowError itself where it is one alone."""
    column = width - _asked_px(page, width) - 6 * page.metrics.unit(3)
    for question in questions:
        fitted(page, page.say(question.text), _asked_px(page, width), page.metrics.height_px // 2, STEPS)
        for _, label in question.levels:
            fitted(page, page.say(label), column, page.metrics.target(10), STEPS)
    return WindowError(f"the questions do not fit on a screen of {page.metrics}; shorten them or take a larger one")
