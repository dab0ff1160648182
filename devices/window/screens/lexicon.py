"""Words that the participant writes, one on each line."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from palpate.devices.window.fields import Writing
from palpate.devices.window.geometry import Box
from palpate.devices.window.inputs import Key, Pressed
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base, Missing, back_and_next
from palpate.devices.window.screens.elements import Element
from palpate.devices.window.screens.frame import trial_frame
from palpate.devices.window.screens.writing import FieldOn, with_hangul
from palpate.protocols.events import Ask
from palpate.protocols.forms import Lexicon

FIELD = "words"
WIDEST = 150.0


class LexiconScreen(Base):
    """A field of several lines; blank lines and repetitions do not count."""

    def __init__(self, ask: Ask, form: Lexicon, page: Page) -> None:
        left, right = back_and_next(page)
        kind = "suggestions" if form.name == "suggestions" else "lexicon"
        frame = trial_frame(page, ask, f"{kind}_prompt", page.texts(f"{kind}_hint"), left, right)
        frame = replace(frame, hint=with_hangul(page, page.texts(f"{kind}_hint")))  # here Backspace deletes
        super().__init__(frame, may_go_back=ask.may_go_back)
        self.form = form
        width = min(frame.body.width, page.metrics.unit(WIDEST))
        box = Box(frame.body.left + (frame.body.width - width) // 2, frame.body.top, width, frame.body.height)
        self.field = FieldOn(page, FIELD, box, page.metrics.text(6.0), Writing(many_lines=True))
        self.focus = FIELD
        self.show(ask.previous or {})

    def body(self) -> Iterator[Element]:
        yield self.field.element(self.focus == FIELD)

    def missing(self) -> Sequence[Missing]:
        enough = len(self.field.writing.words()) >= self.form.at_least
        return () if enough else ((FIELD, str(self.form.at_least)),)

    def complain(self, _missing: Sequence[Missing], /, key: str = "please_write") -> None:
        self.tell(key, count=self.form.at_least)
        self.focus = FIELD

    def value(self) -> dict[str, Any]:
        return {"answers": {"words": self.field.writing.words()}}

    def show(self, answers: Mapping[str, Any]) -> None:
        self.field.writing.text = "\n".join(answers.get("words", ()))
        self.field.writing.caret = len(self.field.writing.text)

    def pressed(self, name: str, event: Pressed) -> None:
        if name == FIELD:
            self.field.press(event.x, event.y)

    def typed(self, name: str | None, text: str) -> None:
        if name == FIELD:
            self.field.type(text)
            self.notice = ()

    def key(self, name: str | None, event: Key) -> bool:
        return name == FIELD and self.field.key(event)
