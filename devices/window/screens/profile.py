"""A door's force over its angle, as screens draw it: the background with its lines, and the pieces of the curve."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from palpate.devices.window.geometry import Box, Placed
from palpate.devices.window.paint import ACCENT, CARD, INK, Colour, plain
from palpate.devices.window.plot import Axes, Masks, band_mask
from palpate.devices.window.screens.elements import Element, hair

if TYPE_CHECKING:
    from PIL import Image

    from palpate.devices.window.screen import Page

GRID: Colour = (231, 235, 239)
BAND: Colour = (238, 241, 244)


@dataclass(frozen=True)
class Ground(Element):
    """The background of doors: the range of rated ones, between `low` and `high` (empty: none), and grid lines.

    Lines are at every step of force and every ten degrees, a stronger one at zero. It is painted once for each pair of
    ends of the axis.
    """

    low: bytes = b""
    high: bytes = b""
    low_N: float = 0.0
    high_N: float = 1.0
    masks: Masks = field(default_factory=Masks, compare=False, repr=False)

    def paint(self, image: Image.Image, page: Page) -> None:
        key = "ground", self.low, self.high, self.low_N, self.high_N, self.box.width, self.box.height
        image.paste(self.masks.picture(key, lambda: self._picture(hair(page))), (self.box.left, self.box.top))

    def _picture(self, thin: int) -> Image.Image:
        from PIL import Image

        box = Box(0, 0, self.box.width, self.box.height)
        axes, made = Axes(box, self.low_N, self.high_N), Image.new("RGB", (box.width, box.height), CARD)
        if self.low:
            band = band_mask(np.frombuffer(self.low), np.frombuffer(self.high), axes)
            made.paste(BAND, (0, 0), Image.fromarray(band))
        for angle in range(0, 61, 10):
            plain(made, Box(axes.x(angle), 0, thin, box.height), GRID)
        for force in axes.forces_N:
            plain(made, Box(0, axes.y(force), box.width, thin), INK if force == 0 else GRID)
        return made


@dataclass(frozen=True)
class Curve(Element):
    """A piece of a profile's line on the plot's background; `cover` is its coverage of each pixel of the box."""

    cover: bytes = b""
    colour: Colour = ACCENT

    def placed(self, _page: Page, /) -> Iterator[Placed]:
        """Yield the piece, which lies on the plot with everything else that is drawn there."""
        return iter(())

    def paint(self, image: Image.Image, _page: Page, /) -> None:
        from PIL import Image

        mask = Image.frombytes("L", (self.box.width, self.box.height), self.cover)
        image.paste(self.colour, (self.box.left, self.box.top), mask)
