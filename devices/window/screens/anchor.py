"""The screen of a reference stimulus: what it stands for, to be felt as often as the participant likes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from palpate.devices.window.geometry import WindowError
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.authoring import TRY, TRY_KEYS
from palpate.devices.window.screens.base import Base
from palpate.devices.window.screens.elements import Element
from palpate.devices.window.screens.frame import Choice, Frame
from palpate.devices.window.screens.reading import paged
from palpate.protocols.events import Ask
from palpate.protocols.forms import AnchorForm


class AnchorScreen(Base):
    """The reference's label with Feel it and Next; Next is off before it was felt. The key T feels it too."""

    def __init__(self, ask: Ask, form: AnchorForm, page: Page) -> None:
        texts = page.texts
        self.felt = int((ask.previous or {}).get("felt", 0))
        again = self.felt > 0
        right = (
            Choice(TRY, texts("feel_again" if again else "feel_it"), primary=not again),
            Choice("next", texts("next"), primary=again),
        )
        left = (Choice("rest", texts("rest")),) if page.may_rest else ()
        count = f"{form.number} / {form.of}" if form.of > 1 else ""
        super().__init__(Frame(page, texts("anchor_prompt"), texts("anchor_hint"), left, right, count))
        pages = paged(page, page.say(form.anchor.label), self.frame.body)
        if len(pages) > 1:
            raise WindowError(f"the label of anchor {form.anchor.id} takes more than one screen: shorten it")
        self._text = pages[0]

    def body(self) -> Iterator[Element]:
        yield from self._text

    def value(self) -> dict[str, Any]:
        return {"answers": {"felt": self.felt}}

    def show(self, answers: Mapping[str, Any]) -> None:
        self.felt = answers.get("felt", self.felt)

    def is_on(self, name: str) -> bool:
        return name != "next" or self.felt > 0

    def go_on(self) -> None:
        if self.felt:
            self.finish()
        else:
            self.tell("please_feel")
            self.focus = TRY

    def chosen(self, _name: str, /) -> None:
        self.finish(go="try")

    def typed(self, _name: str | None, text: str, /) -> None:
        if text.strip().lower() in TRY_KEYS:
            self.chosen(TRY)

    def default_choice(self) -> str:
        """Return the button for Enter: Feel it if it was not felt yet, else Next."""
        return "next" if self.felt else TRY
