"""Elements of the designer's window: vertical sliders, the plot, its lines and bands, and the hand's position."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from palpate.devices.window.geometry import Box, Placed
from palpate.devices.window.paint import ACCENT, CARD, HAIR, INK, TINT, Colour, plain
from palpate.devices.window.screens.elements import Card, Element, hair, rounding
from palpate.devices.window.screens.targets import Button, Target

if TYPE_CHECKING:
    from PIL import Image

    from palpate.devices.window.screen import Page

FEELS: Colour = (150, 74, 0)
"""Amber, for how a door should feel by the model; contrast 6:1 on a white card."""
SIDES: dict[str, Colour] = {"A": ACCENT, "B": (118, 30, 104)}
"""The colours of the two compared designs: blue and plum, distinct for colour-blind readers too; the edited one is also
thicker.
"""
BAND_MARK: Colour = (205, 212, 219)
"""The colour of the band in the legend, where it has no neighbours."""


@dataclass(frozen=True)
class Upright(Target):
    """A vertical slider from 0 at the bottom to 100 at the top, in the band that takes presses.

    `wish` is the value on the line; `beside` is the other design's wish.
    """

    wish: float = 50.0
    beside: float | None = None
    colour: Colour = ACCENT
    other: Colour = ACCENT

    @property
    def line(self) -> Box:
        """Return the line's box; its ends are 0 and 100."""
        thick = max(2, self.box.width // 30)
        inset = self._thumb_height
        return Box(
            self.box.left + (self.box.width - thick) // 2, self.box.top + inset, thick, self.box.height - 2 * inset
        )

    @property
    def thumb(self) -> Box:
        """Return the marker's box; its middle is the wish."""
        width = round(0.46 * self.box.width)
        left = self.box.left + (self.box.width - width) // 2
        return Box(left, self.row(self.wish) - self._thumb_height // 2, width, self._thumb_height)

    @property
    def _thumb_height(self) -> int:
        return max(9, self.box.width // 7) | 1

    def row(self, value: float) -> int:
        """Return the pixel row of a value."""
        return self.line.bottom - 1 - round(value / 100 * (self.line.height - 1))

    def value_at(self, y: float) -> float:
        """Return the value at a pixel row; beyond the line's ends, the value of the nearer end."""
        return min(max(100 * (self.line.bottom - 1 - y) / (self.line.height - 1), 0.0), 100.0)

    def placed(self, _page: Page, /) -> Iterator[Placed]:
        yield Placed(self.name, "target", self.box, within=self.within)
        yield Placed(f"{self.name}.line", "mark", self.line, within=self.name)
        yield Placed(f"{self.name}.thumb", "marker", self.thumb, within=self.name)

    def paint(self, image: Image.Image, page: Page) -> None:
        if self.held or self.focused:
            page.shapes.fill(image, self.box, rounding(page), TINT)
        line = self.line
        for value in (0, 50, 100):
            wide = self.thumb.width // 2 | 1
            plain(image, Box(self.box.middle[0] - wide // 2, self.row(value), wide, hair(page)), HAIR)
        plain(image, line, INK)
        self._beside(image, page)
        thumb = self.thumb
        page.shapes.fill(image, thumb.grown(hair(page)), thumb.height, CARD)
        page.shapes.fill(image, thumb, thumb.height // 2, self.colour)
        self._ring(image, page)

    def _beside(self, image: Image.Image, page: Page) -> None:
        """Draw the other design's wish: a short stroke to the left of the line."""
        if self.beside is None:
            return
        width, thick = round(0.16 * self.box.width), 2 * hair(page) + 1
        left = self.box.left + round(0.06 * self.box.width)
        plain(image, Box(left, self.row(self.beside) - thick // 2, width, thick), self.other)


@dataclass(frozen=True)
class Felt(Element):
    """The predicted percept of a door beside a slider: a dot at the row `felt` of the box, connected to the wish.

    It is not part of the slider: a move of one slider moves the dots of all, and nothing else of them.
    """

    felt: int = 0
    wish: int = 0

    @classmethod
    def beside(cls, name: str, slider: Upright, value: float, page: Page) -> Felt:
        """Return the dot of a slider at a value."""
        side = max(7, round(0.115 * slider.box.width)) | 1
        reach, x = side // 2 + hair(page), slider.box.left + round(0.85 * slider.box.width)
        felt, wish = slider.row(value), slider.row(slider.wish)
        top, bottom = min(felt - reach, wish), max(felt + reach, wish) + 1
        return cls(name, Box(x - reach, top, 2 * reach + 1, bottom - top), slider.name, felt - top, wish - top)

    def placed(self, _page: Page, /) -> Iterator[Placed]:
        """Yield the dot, which lies on the slider with the slider's marker beside it."""
        return iter(())

    def paint(self, image: Image.Image, page: Page) -> None:
        box, thick, reach = self.box, max(2, 2 * hair(page)), self.box.width // 2
        top, tall = box.top + min(self.felt, self.wish), abs(self.felt - self.wish) + 1
        plain(image, Box(box.middle[0] - thick // 2, top, thick, tall), FEELS)
        ground = Box(box.left, box.top + self.felt - reach, box.width, box.width)
        page.shapes.fill(image, ground, box.width - 2 * hair(page), CARD)
        dot = ground.grown(-hair(page))
        page.shapes.fill(image, dot, dot.width // 2 + 1, FEELS)


@dataclass(frozen=True)
class Pane(Card):
    """A card that is painted fast if none of its edges is in view."""

    def paint(self, image: Image.Image, page: Page) -> None:
        whole = Box(0, 0, *image.size)
        if self.box.grown(-self.radius).contains(whole):
            plain(image, whole, CARD)
        else:
            super().paint(image, page)


@dataclass(frozen=True)
class Dot(Element):
    """A round mark on the plot: the door's position while it plays."""

    colour: Colour = INK

    def placed(self, _page: Page, /) -> Iterator[Placed]:
        """Yield the mark, which lies on the plot with everything else that is drawn there."""
        return iter(())

    def paint(self, image: Image.Image, page: Page) -> None:
        page.shapes.fill(image, self.box, self.box.width, CARD)
        page.shapes.fill(image, self.box.grown(-hair(page)), self.box.width, self.colour)


@dataclass(frozen=True)
class Chip(Button):
    """A button for one of the two compared designs, in its own colour."""

    colour: Colour = ACCENT

    def paint(self, image: Image.Image, page: Page) -> None:
        page.shapes.fill(image, self.box, rounding(page), self.colour if self.chosen else CARD)
        page.shapes.frame(image, self.box, rounding(page), 2 * hair(page), self.colour)
        self._label(page, CARD if self.chosen else self.colour).paint(image, page)
        self._ring(image, page, CARD if self.chosen else INK)


@dataclass(frozen=True)
class Swatch(Element):
    """A colour in the legend."""

    colour: Colour = INK

    def paint(self, image: Image.Image, _page: Page, /) -> None:
        plain(image, self.box, self.colour)
