"""Set lines and try out the result, as often as the participant likes; the last setting counts."""

from __future__ import annotations

from dataclasses import replace

from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import back_and_next
from palpate.devices.window.screens.frame import Choice, Frame, trial_frame
from palpate.devices.window.screens.sliders import SliderScreen
from palpate.protocols.events import Ask
from palpate.protocols.forms import Sliders

TRY = "try"
TRY_KEYS = {"t", "ㅅ"}
"""What the key T writes, also while Hangul is on."""


class AuthoringScreen(SliderScreen):
    """A slider form with Try it and Done; Done is off before the first try. The key T tries too."""

    def __init__(self, ask: Ask, form: Sliders, page: Page, t0_ns: int) -> None:
        super().__init__(ask, form, page, t0_ns)
        self.tried = dict(ask.former) if ask.former is not None else None
        self._deciding, self._turning = self.frame.right, back_and_next(page)[1]
        self.turned()

    @property
    def deciding(self) -> bool:
        """Return whether this is the last sheet, on which the setting is tried and confirmed."""
        return self.sheet == self.sheets - 1

    def turned(self) -> None:
        self.frame = replace(self.frame, right=self._deciding if self.deciding else self._turning)

    def is_on(self, name: str) -> bool:
        return not self.missing() and (name != "next" or self.tried is not None or not self.deciding)

    def chosen(self, _name: str, /) -> None:
        if missing := self.missing():
            self.complain(missing)
        else:
            self.finish(go="try")

    def go_on(self) -> None:
        if self.deciding and self.tried is None and not self.missing():
            self.tell("please_try")
            self.focus = TRY
        else:
            super().go_on()

    def typed(self, _name: str | None, text: str, /) -> None:
        if self.deciding and text.strip().lower() in TRY_KEYS:
            self.chosen(TRY)

    def default_choice(self) -> str:
        """Return the button for Enter: Try it for a setting that was not tried yet, else Done."""
        return TRY if self.deciding and self.marks.answers != self.tried else "next"

    def _frame_for(self, page: Page, ask: Ask, _form: Sliders, /) -> Frame:
        texts = page.texts
        right = (Choice(TRY, texts("try_it"), primary=True), Choice("next", texts("done")))
        back = (Choice("back", texts("back")),)
        return trial_frame(page, ask, "authoring_prompt", texts("authoring_hint"), back, right)
