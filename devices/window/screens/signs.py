"""Pages without words to read: the number of the interval that is presented, and whether an answer was right."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from palpate.devices.window.geometry import Box
from palpate.devices.window.paint import ACCENT, CARD, HAIR, INK, WARM
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base
from palpate.devices.window.screens.elements import Element, Label, hair
from palpate.devices.window.screens.frame import Frame, fitted
from palpate.devices.window.screens.pages import TITLE_STEPS, WIDEST

if TYPE_CHECKING:
    from PIL import Image

INTERVAL = "interval "
"""The beginning of the key of the page of an interval: interval 1, interval 2, ..."""
RIGHT, WRONG = "right_answer", "wrong_answer"
DISC, NUMERAL = 84.0, (46.0, 40.0)
"""The diameter of the disc of an interval and the em sizes of its number, in the design's millimetres."""
SIGN = 46.0
"""The diameter of the sign of an answer."""


@dataclass(frozen=True)
class Disc(Element):
    """A calm round background."""

    def paint(self, image: Image.Image, page: Page) -> None:
        page.shapes.fill(image, self.box, self.box.width // 2, CARD)
        page.shapes.frame(image, self.box, self.box.width // 2, 2 * hair(page), HAIR)


@dataclass(frozen=True)
class Sign(Element):
    """A tick on a full disc for a right answer, a cross in a ring for a wrong one: form and colour differ."""

    right: bool = True

    def paint(self, image: Image.Image, page: Page) -> None:
        radius, inner = self.box.width // 2, self.box.grown(-round(0.28 * self.box.width))
        stroke = max(3, self.box.width // 14)
        if self.right:
            page.shapes.fill(image, self.box, radius, ACCENT)
            page.shapes.tick(image, inner, stroke, CARD)
        else:
            page.shapes.fill(image, self.box, radius, CARD)
            page.shapes.frame(image, self.box, radius, max(2, stroke // 2), WARM)
            page.shapes.cross(image, inner, stroke, WARM)


class IntervalScreen(Base):
    """The number of the interval that is presented; those of one trial differ in the number alone. It has no answer."""

    def __init__(self, number: str, page: Page) -> None:
        super().__init__(Frame(page, "", "", (), ()))
        side = page.metrics.unit(DISC)
        disc = Box((page.metrics.width_px - side) // 2, (page.metrics.height_px - side) // 2, side, side)
        laid = fitted(page, number, side, side, NUMERAL, bold=True)
        self._elements_once = (Disc("disc", disc), Label("number", disc, "disc", laid, INK, "centre"))

    def body(self) -> Iterator[Element]:
        yield from self._elements_once

    def default_choice(self) -> str | None:
        return None


class FeedbackScreen(Base):
    """Whether the answer was right: a sign and a word. It has no answer."""

    def __init__(self, key: str, page: Page) -> None:
        super().__init__(Frame(page, "", "", (), ()))
        unit, metrics = page.metrics.unit, page.metrics
        width, side, gap = min(metrics.width_px - 2 * unit(16), unit(WIDEST)), unit(SIGN), unit(6)
        laid = fitted(page, page.texts(key), width, metrics.height_px // 3, TITLE_STEPS, bold=True)
        top = (metrics.height_px - side - gap - laid.height) // 2
        sign = Box((metrics.width_px - side) // 2, top, side, side)
        word = Box((metrics.width_px - width) // 2, sign.bottom + gap, width, laid.height)
        self._elements_once = (
            Sign("sign", sign, right=key == RIGHT),
            Label("word", word, "", laid, ACCENT if key == RIGHT else WARM, "centre"),
        )

    def body(self) -> Iterator[Element]:
        yield from self._elements_once

    def default_choice(self) -> str | None:
        return None
