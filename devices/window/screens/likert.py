"""Statements, each rated on a row of round buttons between two labelled ends."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from palpate.devices.window.geometry import NEAREST_TARGETS_MM, Box, WindowError
from palpate.devices.window.inputs import Key, Pressed
from palpate.devices.window.paint import QUIET
from palpate.devices.window.paint_text import Laid, lay
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base, Missing, back_and_next
from palpate.devices.window.screens.cards import dealt, sheets_of, stacked
from palpate.devices.window.screens.elements import Card, Element, Label, rounding
from palpate.devices.window.screens.frame import STEPS, fitted, trial_frame
from palpate.devices.window.screens.targets import Points
from palpate.protocols.events import Ask
from palpate.protocols.forms import Likert
from palpate.protocols.study import Questionnaire

WIDEST = 290.0
PITCH, TALL = 15.0, 12.0
PAD = 1.0
SMALLER = 0.86


class LikertScreen(Base):
    """A form of statements without numbers; a press chooses the nearest button of the row."""

    def __init__(self, ask: Ask, form: Likert, page: Page) -> None:
        left, right = back_and_next(page)
        frame = trial_frame(page, ask, "likert_prompt", page.texts("likert_hint"), left, right)
        self.form = form
        self._sheets = statements(page, form.questionnaire, frame.body)
        super().__init__(frame, len(self._sheets), ask.may_go_back)
        self.answers: dict[str, int] = {}
        self.at_s: dict[str, float] = {}
        self.show(ask.previous or {})

    def body(self) -> Iterator[Element]:
        for row in self._sheets[self.sheet]:
            answer = self.answers.get(self._item(row.points.name))
            yield from row.fixed
            yield replace(row.points, at=None if answer is None else answer - 1)

    def missing(self) -> Sequence[Missing]:
        texts = {item.name: self.page.say(item.text) for item in self.form.questionnaire.items}
        items = [(row.points.name, self._item(row.points.name)) for row in self._sheets[self.sheet]]
        short = {item: text if len(text) <= 40 else text[:38].rstrip() + " …" for item, text in texts.items()}
        return [(name, f"“{short[item]}”") for name, item in items if item not in self.answers]

    def value(self) -> dict[str, Any]:
        answered = [item for item in self.form.items() if item in self.answers]
        at_s = {item: self.at_s[item] for item in answered if item in self.at_s}
        return {"answers": {item: self.answers[item] for item in answered}, "at_s": at_s}

    def show(self, answers: Mapping[str, Any]) -> None:
        self.answers = dict(answers)

    def pressed(self, name: str, event: Pressed) -> None:
        row = next((row for row in self._sheets[self.sheet] if row.points.name == name), None)
        if row is not None:
            self._choose(name, row.points.nearest(event.x) + 1)

    def key(self, name: str | None, event: Key) -> bool:
        names = [row.points.name for row in self._sheets[self.sheet]]
        if event.name in ("up", "down"):
            self.move_focus(1 if event.name == "down" else -1, names)
            return True
        points = self.form.questionnaire.points
        before = self.answers.get(self._item(name)) if name is not None and name in names else None
        middle = (points + 1) // 2
        places = {"left": (before or middle + 1) - 1, "right": (before or middle - 1) + 1, "home": 1, "end": points}
        if event.name not in places or (name is not None and name not in names):
            return False
        self.focus = chosen = name or names[0]
        self._choose(chosen, min(max(places[event.name], 1), points))
        return True

    def _choose(self, name: str, answer: int) -> None:
        item = self._item(name)
        self.answers[item], self.at_s[item] = answer, round(self.now_s, 3)
        self.notice = ()

    def _item(self, name: str) -> str:
        return self.form.questionnaire.items[int(name.removeprefix("item "))].name


@dataclass(frozen=True)
class PlacedStatement:
    """A statement's place."""

    fixed: tuple[Element, ...]
    points: Points


@dataclass(frozen=True)
class _Set:
    text: Laid
    height: int


def statements(page: Page, questionnaire: Questionnaire, room: Box) -> list[list[PlacedStatement]]:
    """Return the rows of every sheet. Raises WindowError if a statement or a label does not fit."""
    unit = page.metrics.unit
    width = min(room.width, unit(WIDEST))
    pitch = max(unit(PITCH), page.metrics.target() + page.metrics.mm(NEAREST_TARGETS_MM) + 2)
    ends_px = (width - 2 * unit(3) - questionnaire.points * pitch) // 2 - unit(3)
    tall = page.metrics.target(TALL)

    def sets(size: int) -> list[_Set] | None:
        small = max(round(SMALLER * size), page.metrics.text(0))
        ends = [lay(page.fonts, page.say(end), small, ends_px, even=True) for end in questionnaire.ends]
        texts = [
            lay(page.fonts, page.say(item.text), size, width - 2 * unit(3), even=True) for item in questionnaire.items
        ]
        if None in ends or None in texts:
            return None
        row = max(tall, *(end.height for end in ends if end is not None))
        return [_Set(text, text.height + row + 2 * unit(PAD)) for text in texts if text is not None]

    def heights(size: int) -> list[int] | None:
        sets_at_size = sets(size)
        return None if sets_at_size is None else [placed.height for placed in sets_at_size]

    chosen = sheets_of(page, room, len(questionnaire.items), heights)
    if ends_px < unit(20) or chosen is None or (sets_at_size := sets(chosen[1])) is None:
        for text in questionnaire.ends:
            fitted(page, page.say(text), max(1, ends_px), room.height // 3, STEPS)
        raise WindowError(f"the statements do not fit on a screen of {page.metrics}; shorten them")
    rows, number = [], 0
    for sheet in dealt(sets_at_size, chosen[0]):
        boxes = stacked(page, room, width, [statement.height for statement in sheet])
        rows.append(
            [
                _row(page, questionnaire, statement.text, box, number + n, pitch)
                for n, (statement, box) in enumerate(zip(sheet, boxes, strict=True))
            ]
        )
        number += len(sheet)
    return rows


def _row(page: Page, questionnaire: Questionnaire, text: Laid, card: Box, number: int, pitch: int) -> PlacedStatement:
    unit, name = page.metrics.unit, f"card {number}"
    spare = card.height - text.height - page.metrics.target(TALL) - 2 * unit(PAD)
    place = Box(card.left + unit(3), card.top + unit(PAD) + max(0, spare) // 3, card.width - 2 * unit(3), text.height)
    lower = Box(card.left, place.bottom, card.width, card.bottom - unit(PAD) - place.bottom)
    wide = questionnaire.points * pitch
    height = min(lower.height, page.metrics.target(TALL))
    points = Box(card.left + (card.width - wide) // 2, lower.top + (lower.height - height) // 2, wide, height)
    side = points.left - unit(3) - place.left
    small = max(round(SMALLER * text.size), page.metrics.text(0))
    low, high = (lay(page.fonts, page.say(end), small, side, even=True) or text for end in questionnaire.ends)
    left = Box(place.left, lower.top, side, lower.height)
    fixed = (
        Card(name, card, radius=rounding(page)),
        Label(f"{name} text", place, name, text, align="centre"),
        Label(f"{name} low", left, name, low, QUIET, "right"),
        Label(f"{name} high", left.moved(points.right + unit(3) - left.left, 0), name, high, QUIET),
    )
    return PlacedStatement(fixed, Points(f"item {number}", points, name, count=questionnaire.points))
