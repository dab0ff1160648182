"""Elements of screens: each has a place and a look, and paints itself.

Elements are equal if they look the same, so a screen repaints those that differ from the last time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from palpate.devices.window.geometry import Box, Placed
from palpate.devices.window.paint import ACCENT, CARD, HAIR, INK, Colour, plain
from palpate.devices.window.paint_text import BLANK, Align, Laid, draw, ink

if TYPE_CHECKING:
    from PIL import Image

    from palpate.devices.window.screen import Page


@dataclass(frozen=True)
class Element:
    """An element at a place; `within` names the element that it lies in."""

    name: str
    box: Box
    within: str = ""

    @property
    def stops(self) -> bool:
        """Return whether the keyboard's focus stops here."""
        return False

    def placed(self, _page: Page, /) -> Iterator[Placed]:
        """Yield the element's place."""
        yield Placed(self.name, "mark", self.box, within=self.within)

    def paint(self, image: Image.Image, page: Page, /) -> None:
        """Paint the element completely inside its box."""


@dataclass(frozen=True)
class Card(Element):
    """A light background for elements that belong together."""

    radius: int = 0
    edge: Colour = HAIR

    def paint(self, image: Image.Image, page: Page) -> None:
        page.shapes.fill(image, self.box, self.radius, CARD)
        page.shapes.frame(image, self.box, self.radius, hair(page), self.edge)


@dataclass(frozen=True)
class Label(Element):
    """A text to read."""

    laid: Laid = BLANK
    colour: Colour = INK
    align: Align = "left"

    def placed(self, page: Page) -> Iterator[Placed]:
        covered = ink(page.fonts, self.laid, self.box, self.align)
        yield Placed(self.name, "text", self.box, self.laid.text, covered, self.within)

    def paint(self, image: Image.Image, page: Page) -> None:
        draw(image, page.fonts, self.laid, self.box, self.colour, self.align)


@dataclass(frozen=True)
class Progress(Element):
    """A bar of progress."""

    share: float = 0.0

    def paint(self, image: Image.Image, _page: Page, /) -> None:
        plain(image, self.box, HAIR)
        plain(image, Box(self.box.left, self.box.top, round(self.share * self.box.width), self.box.height), ACCENT)


@dataclass(frozen=True)
class Ruler(Element):
    """A line of an exact length, its box's width, with strokes at its ends for a ruler."""

    def paint(self, image: Image.Image, _page: Page, /) -> None:
        stroke = max(2, self.box.height // 16)
        plain(image, Box(self.box.left, self.box.middle[1] - stroke // 2, self.box.width, stroke), INK)
        plain(image, Box(self.box.left, self.box.top, stroke, self.box.height), INK)
        plain(image, Box(self.box.right - stroke, self.box.top, stroke, self.box.height), INK)


def hair(page: Page) -> int:
    """Return the width of the thinnest line, in pixels."""
    return max(1, page.metrics.unit(0.3))


def ring(page: Page) -> int:
    """Return the width of the frame that shows the keyboard's focus, in pixels."""
    return max(3, page.metrics.unit(0.8))


def rounding(page: Page) -> int:
    """Return the radius of corners, in pixels."""
    return page.metrics.unit(2)
