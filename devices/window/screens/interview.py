"""Questions with free-text answers, one on each sheet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from palpate.devices.window.fields import Writing
from palpate.devices.window.geometry import Box
from palpate.devices.window.inputs import Key, Pressed
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base, back_and_next
from palpate.devices.window.screens.elements import Element, Label
from palpate.devices.window.screens.frame import STEPS, Frame, fitted
from palpate.devices.window.screens.writing import FieldOn, with_hangul
from palpate.protocols.events import Ask
from palpate.protocols.forms import Interview

FIELD = "answer"
WIDEST = 220.0


class InterviewScreen(Base):
    """A question and a field of several lines; without an answer it stays empty."""

    def __init__(self, ask: Ask, form: Interview, page: Page) -> None:
        left, right = back_and_next(page)
        hint = with_hangul(page, page.texts("interview_hint"))
        super().__init__(Frame(page, page.texts("interview_prompt"), hint, left, right), len(form.questions))
        self.form = form
        body, unit = self.frame.body, page.metrics.unit
        width = min(body.width, unit(WIDEST))
        left_px = body.left + (body.width - width) // 2
        self._questions, self.fields = [], []
        for question in form.questions:
            laid = fitted(page, page.say(question.text), width, body.height // 3, STEPS)
            place = Box(left_px, body.top, width, laid.height)
            self._questions.append(Label("question", place, laid=laid))
            below = Box(left_px, place.bottom + unit(4), width, body.bottom - place.bottom - unit(4))
            self.fields.append(FieldOn(page, FIELD, below, page.metrics.text(5.4), Writing(many_lines=True)))
        self.focus = FIELD
        self.show(ask.previous or {})

    def body(self) -> Iterator[Element]:
        yield self._questions[self.sheet]
        yield self._field.element(self.focus == FIELD)

    def turned(self) -> None:
        self.focus = FIELD

    def value(self) -> dict[str, Any]:
        written = (field.writing.text.strip() for field in self.fields)
        return {"answers": dict(zip(self.form.items(), written, strict=True))}

    def show(self, answers: Mapping[str, Any]) -> None:
        for name, field in zip(self.form.items(), self.fields, strict=True):
            field.writing.text = answers.get(name, "")
            field.writing.caret = len(field.writing.text)

    def pressed(self, name: str, event: Pressed) -> None:
        if name == FIELD:
            self._field.press(event.x, event.y)

    def typed(self, name: str | None, text: str) -> None:
        if name == FIELD:
            self._field.type(text)

    def key(self, name: str | None, event: Key) -> bool:
        return name == FIELD and self._field.key(event)

    @property
    def _field(self) -> FieldOn:
        return self.fields[self.sheet]
