"""Texts laid out once and cached: at the first size that fits, or shortened if a message is too long."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from palpate.devices.window.geometry import Box
from palpate.devices.window.paint import INK, Colour
from palpate.devices.window.paint_text import BLANK, LEADING, Align, Laid
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.elements import Label
from palpate.devices.window.screens.frame import first_fit, fitted

LABEL_STEPS = (5.0, 4.6, 4.2, 3.8)
NUMBER_STEPS = (5.4, 5.0, 4.6)
TITLE_STEPS = (7.0, 6.4, 5.4)
WORD_STEPS = (5.0, 4.6, 4.2)
SMALL_STEPS = (4.2, 3.8)
KEPT = 400
Steps = tuple[float, ...]


def line_px(page: Page, step: float) -> int:
    """Return the height of a line at that size."""
    return round(LEADING * page.metrics.text(step))


@dataclass
class Typesetter:
    """A typesetter of a page's texts."""

    page: Page
    _laid: dict[tuple[object, ...], Laid] = field(default_factory=dict)

    def text(
        self, text: str, width: int, height: int, steps: Steps = LABEL_STEPS, bold: bool = False, even: bool = False
    ) -> Laid:
        """Return the text at the first size that fits. Raises WindowError if none does."""
        key = text, width, height, steps, bold, even
        if key not in self._laid:
            self._keep(key, fitted(self.page, text, width, height, steps, bold, even))
        return self._laid[key]

    def cut(self, text: str, width: int, height: int, steps: Steps = LABEL_STEPS) -> Laid:
        """Return the text, shortened if needed: a message never ends the work."""
        key = "cut", text, width, height, steps
        if key not in self._laid:
            shorter = (text[:stop].rstrip() + " …" for stop in range(len(text) - 4, 0, -4))
            fits = (first_fit(self.page, candidate, width, height, steps) for candidate in (text, *shorter))
            self._keep(key, next((fit for fit in fits if fit is not None), BLANK))
        return self._laid[key]

    def same_size(self, texts: Sequence[str], width: int, height: int, steps: Steps = LABEL_STEPS) -> Steps:
        """Return the one size at which all texts fit, so that none looks more important; all sizes if none does."""
        for step in steps:
            if all(first_fit(self.page, text, width, height, (step,), even=True) for text in texts):
                return (step,)
        return steps

    def label(
        self, name: str, text: str, box: Box, colour: Colour = INK, align: Align = "left", steps: Steps = LABEL_STEPS,
        bold: bool = False, even: bool = False, within: str = "",
    ) -> Label:  # fmt: skip
        """Return a label with a text in its box."""
        laid = self.text(text, box.width, box.height, steps, bold, even)
        return Label(name, box, within, laid, colour, align)

    def _keep(self, key: tuple[object, ...], laid: Laid) -> None:
        if len(self._laid) >= KEPT:
            del self._laid[next(iter(self._laid))]
        self._laid[key] = laid
