"""Questions about the person: numbers, texts and choices; a voluntary question can be left out explicitly.

Each question is on a card, its text on the left, its answer on the right.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

from palpate.devices.window.geometry import Box, WindowError
from palpate.devices.window.inputs import Key, Pressed
from palpate.devices.window.paint_text import BLANK, Laid, lay
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base, Missing, back_and_next
from palpate.devices.window.screens.cards import dealt, sheets_of, stacked
from palpate.devices.window.screens.elements import Card, Element, Label, rounding
from palpate.devices.window.screens.frame import STEPS, fitted, trial_frame
from palpate.devices.window.screens.targets import Dot
from palpate.devices.window.screens.writing import FieldOn, with_hangul
from palpate.protocols.events import Ask
from palpate.protocols.forms import Demographics, Eligibility, Question

STEP = {"left": -1, "up": -1, "right": 1, "down": 1}
WIDEST = 300.0
QUESTION_SHARE = 0.40
NUMBER, TEXT = 34.0, 84.0
"""Widths of fields, in the design's millimetres."""
PAD = 1.6
NONE = "none"


class DemographicsScreen(Base):
    """A form with one card for each question."""

    kind = "demographics"

    def __init__(self, ask: Ask, form: Demographics, page: Page) -> None:
        left, right = back_and_next(page)
        hint, writes = page.texts(f"{self.kind}_hint"), any(item.kind == "text" for item in form.questions)
        hint = with_hangul(page, hint) if writes else hint
        frame = trial_frame(page, ask, f"{self.kind}_prompt", hint, left, right)
        self.form = form
        self._sheets = questions_on(page, form.questions, frame.body)
        super().__init__(frame, len(self._sheets), ask.may_go_back)
        self.picked: dict[str, str | None] = {}
        self.fields = {place.number: self._field(place) for sheet in self._sheets for place in sheet if place.field}
        self.show(ask.previous or {})

    def body(self) -> Iterator[Element]:
        for place in self._sheets[self.sheet]:
            yield from place.fixed
            name = self._question(place).name
            if place.number in self.fields:
                field = self.fields[place.number]
                yield field.element(self.focus == field.name, off=self._unsaid(name))
            for option in place.options:
                chosen = name in self.picked and self.picked[name] == option.value
                yield replace(option.dot, chosen=chosen, stop=self._is_stop(place, option))

    def missing(self) -> Sequence[Missing]:
        faults = [(place, self._fault(place)) for place in self._sheets[self.sheet]]
        return [(self._first_of(place), self.page.say(self._question(place).text)) for place, fault in faults if fault]

    def complain(self, missing: Sequence[Missing], /, key: str = "fill_field") -> None:
        super().complain(missing[:1], key)
        place = next(place for place in self._sheets[self.sheet] if self._fault(place))
        field = self.fields.get(place.number)
        if field is not None and field.writing.text.strip():
            question = self._question(place)
            self.notice = (
                f"{self.page.say(question.text)} {_expected(self.page, question)}",
                _expected(self.page, question),
            )

    def value(self) -> dict[str, Any]:
        questions = enumerate(self.form.questions)
        return {"answers": {question.name: self._answer(number, question) for number, question in questions}}

    def show(self, answers: Mapping[str, Any]) -> None:
        for number, question in enumerate(self.form.questions):
            if question.name not in answers:
                continue
            answer = answers[question.name]
            if answer is None or question.kind == "choice":
                self.picked[question.name] = answer
            else:
                field = self.fields[number].writing
                field.text = f"{answer:g}" if isinstance(answer, int | float) else str(answer)
                field.caret = len(field.text)

    def pressed(self, name: str, event: Pressed) -> None:
        for place in self._sheets[self.sheet]:
            for option in place.options:
                if option.name == name:
                    self._pick(place, option)
            field = self.fields.get(place.number)
            if field is not None and field.name == name:
                field.press(event.x, event.y)

    def typed(self, name: str | None, text: str) -> None:
        for place in self._sheets[self.sheet]:
            field = self.fields.get(place.number)
            if field is not None and field.name == name:
                field.type(text)
                self.picked.pop(self._question(place).name, None)
                self.notice = ()

    def key(self, name: str | None, event: Key) -> bool:
        for place in self._sheets[self.sheet]:
            field = self.fields.get(place.number)
            if field is not None and field.name == name:
                return event.name != "enter" and field.key(event)
            names = [option.name for option in place.options]
            if name in names:
                return self._key_on(place, names.index(name), event)
        return False

    def _key_on(self, place: PlacedQuestion, number: int, event: Key) -> bool:
        """Choose an option with the arrow keys, or the focused one with the space bar; return whether the key did."""
        if event.name in STEP:
            number = (number + STEP[event.name]) % len(place.options)
            self.focus = place.options[number].name
        elif event.name != "space":
            return False
        self._pick(place, place.options[number])
        return True

    def _pick(self, place: PlacedQuestion, option: Option) -> None:
        """Choose an option; choosing "rather not say" about a field again takes it back."""
        name = self._question(place).name
        if option.value is None and self._unsaid(name) and place.number in self.fields:
            del self.picked[name]
        else:
            self.picked[name] = option.value
        self.notice = ()

    def _answer(self, number: int, question: Question) -> Any:
        """Return the answer; None means no answer, which only a voluntary question accepts."""
        if question.name in self.picked or question.kind == "choice":
            return self.picked.get(question.name)
        text = " ".join(self.fields[number].writing.text.split())
        return number_in(text) if question.kind == "number" else text or None

    def _fault(self, place: PlacedQuestion) -> bool:
        """Return whether the question still needs an answer: leaving it out must be chosen explicitly."""
        question = self._question(place)
        if self._unsaid(question.name):
            return False
        answer = self._answer(place.number, question)
        return answer is None or question.problem(answer) is not None

    def _unsaid(self, name: str) -> bool:
        return name in self.picked and self.picked[name] is None

    def _is_stop(self, place: PlacedQuestion, option: Option) -> bool:
        """Return whether the focus stops at this option: it has the focus, is chosen, or comes first."""
        names = [item.name for item in place.options]
        if self.focus in names:
            return option.name == self.focus
        name = self._question(place).name
        chosen = [item.name for item in place.options if name in self.picked and self.picked[name] == item.value]
        return option.name == (chosen or names)[0]

    def _first_of(self, place: PlacedQuestion) -> str:
        field = self.fields.get(place.number)
        return field.name if field is not None else place.options[0].name

    def _field(self, place: PlacedQuestion) -> FieldOn:
        box = place.field or self.frame.body
        return FieldOn(self.page, f"question {place.number} field", box, place.size, within=f"question {place.number}")

    def _question(self, place: PlacedQuestion) -> Question:
        return self.form.questions[place.number]


class EligibilityScreen(DemographicsScreen):
    """Questions to be answered by yes or no; the reply is only whether all answers are as required."""

    kind = "eligibility"

    def __init__(self, ask: Ask, form: Eligibility, page: Page) -> None:
        self.criteria = form.criteria
        levels = tuple((answer, page.texts(answer)) for answer in ("yes", "no"))
        questions = (Question(item.name, item.text, "choice", levels, optional=False) for item in form.criteria)
        super().__init__(ask, Demographics(tuple(questions)), page)

    def value(self) -> dict[str, Any]:
        fits = all(self.picked.get(criterion.name) == criterion.answer for criterion in self.criteria)
        return {"answers": {"eligible": fits}}

    def show(self, answers: Mapping[str, Any]) -> None:
        if answers.get("eligible"):
            self.picked = {criterion.name: criterion.answer for criterion in self.criteria}


def number_in(text: str) -> int | float | None:
    """Return the number in a text, with point or comma; None if there is none."""
    plain = text.strip().replace(",", ".")
    try:
        return int(plain)
    except ValueError:
        pass
    try:
        number = float(plain)
    except ValueError:
        return None
    return number if isfinite(number) else None


def _expected(page: Page, question: Question) -> str:
    """Return what kind of number is expected, in the participant's language."""
    low, high = (f"{bound:g}" if bound is not None else "" for bound in (question.low, question.high))
    key = {(True, True): "number_range", (True, False): "number_least", (False, True): "number_most"}
    return page.texts(key.get((bool(low), bool(high)), "number_any")).format(low=low, high=high)


@dataclass(frozen=True)
class Option:
    """An answer to choose, or None for "rather not say"."""

    name: str
    value: str | None
    dot: Dot


@dataclass(frozen=True)
class PlacedQuestion:
    """A question's place on the screen; `field` is the place of its field, if it has one."""

    number: int
    fixed: tuple[Element, ...]
    options: tuple[Option, ...]
    field: Box | None
    size: int


@dataclass(frozen=True)
class _Cell:
    """An element of the right column without a place yet: `name` is empty for a plain text."""

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


def questions_on(page: Page, questions: Sequence[Question], room: Box) -> list[list[PlacedQuestion]]:
    """Return the questions of every sheet. Raises WindowError if a text does not fit."""
    width = min(room.width, page.metrics.unit(WIDEST))

    def sets(size: int) -> list[_Set] | None:
        sets_at_size = [_set(page, question, size, width) for question in questions]
        return None if None in sets_at_size else [item for item in sets_at_size if item is not None]

    def heights(size: int) -> list[int] | None:
        sets_at_size = sets(size)
        return None if sets_at_size is None else [item.height for item in sets_at_size]

    chosen = sheets_of(page, room, len(questions), heights)
    if chosen is None or (sets_at_size := sets(chosen[1])) is None:
        raise _refusal(page, questions, width)
    sheets, number = [], 0
    for sheet in dealt(sets_at_size, chosen[0]):
        boxes = stacked(page, room, width, [item.height for item in sheet])
        sheets.append(
            [
                _place_question(page, item, box, number + n)
                for n, (item, box) in enumerate(zip(sheet, boxes, strict=True))
            ]
        )
        number += len(sheet)
    return sheets


def _set(page: Page, question: Question, size: int, width: int) -> _Set | None:
    unit = page.metrics.unit
    text = lay(page.fonts, page.say(question.text), size, _question_px(page, width), even=True)
    lines = _flowed(page, list(_cells(page, question, size)), width - _question_px(page, width) - 4 * unit(3))
    if text is None or lines is None:
        return None
    tall = len(lines) * page.metrics.target(10) + (len(lines) - 1) * unit(1.2)
    return _Set(question, text, lines, size, max(text.height, tall) + 2 * unit(PAD))


def _cells(page: Page, question: Question, size: int) -> Iterator[_Cell]:
    """Yield the cells of the right column, in order."""
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
    """Return the cells in lines no wider than the column, or None if a single one is wider."""
    gap = page.metrics.unit(2)
    lines: list[list[_Cell]] = [[]]
    for cell in cells:
        if cell.width > width:
            return None
        used = sum(item.width + gap for item in lines[-1])
        if lines[-1] and used + cell.width > width:
            lines.append([])
        lines[-1].append(cell)
    return tuple(tuple(line) for line in lines)


def _place_question(page: Page, texts: _Set, card: Box, number: int) -> PlacedQuestion:
    unit, name = page.metrics.unit, f"question {number}"
    height, gap = page.metrics.target(10), unit(1.2)
    block = len(texts.lines) * height + (len(texts.lines) - 1) * gap
    left, top = card.left + 2 * unit(3) + _question_px(page, card.width), card.top + (card.height - block) // 2
    fixed: list[Element] = [
        Card(name, card, radius=rounding(page)),
        Label(
            f"{name} text",
            Box(card.left + unit(4), card.top, _question_px(page, card.width), card.height),
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
    return PlacedQuestion(number, tuple(fixed), tuple(options), field, texts.size)


def _question_px(page: Page, width: int) -> int:
    return round(QUESTION_SHARE * width) - page.metrics.unit(4)


def _refusal(page: Page, questions: Sequence[Question], width: int) -> WindowError:
    """Return an error that names the text that does not fit; raise it directly if it is a single text."""
    column = width - _question_px(page, width) - 6 * page.metrics.unit(3)
    for question in questions:
        fitted(page, page.say(question.text), _question_px(page, width), page.metrics.height_px // 2, STEPS)
        for _, label in question.levels:
            fitted(page, page.say(label), column, page.metrics.target(10), STEPS)
    return WindowError(f"the questions do not fit on a screen of {page.metrics}; shorten them or take a larger one")
