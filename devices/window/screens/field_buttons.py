"""Buttons of a choice, side by side: large ones where the choice is all that is asked, with the key of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil
from typing import TYPE_CHECKING

from palpate.devices.window.geometry import NEAREST_TARGETS_MM, Box, Placed
from palpate.devices.window.paint import ACCENT, CARD, EDGE, HAIR, INK, QUIET, TINT
from palpate.devices.window.paint_text import BLANK, Laid, lay
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.elements import Label, hair, ring, rounding
from palpate.devices.window.screens.targets import Target

if TYPE_CHECKING:
    from collections.abc import Iterator

    from PIL import Image

KEYS = 9
"""How many options have a number key."""
WIDEST, NARROWEST, TALL = 84.0, 8.5, 2.4
"""Greatest width of a button in the design's millimetres; least width and height in ems of its text."""
LARGE_WIDEST, LARGE_TALL = 92.0, 54.0
LARGE = (15.0, 13.0, 11.0, 9.0, 8.0, 7.0, 6.2, 5.4, 5.0, 4.6, 4.2)
"""Em sizes of large buttons, in the design's millimetres."""
GAP, LARGE_GAP = 3.0, 8.0


@dataclass(frozen=True)
class OptionButton(Target):
    """A button of a choice; `cap` is its number key, beside its label or, on a large button, below it."""

    cap: Laid | None = None
    large: bool = False
    chosen: bool = False
    stop: bool = True

    @property
    def stops(self) -> bool:
        return self.stop

    def placed(self, page: Page) -> Iterator[Placed]:
        yield Placed(self.name, "target", self.box, within=self.within)
        yield from self._words(page).placed(page)
        if self.cap is not None:
            yield Placed(f"{self.name}.cap", "mark", self._cap_box(page), within=self.name)

    def paint(self, image: Image.Image, page: Page) -> None:
        page.shapes.fill(image, self.box, rounding(page), ACCENT if self.chosen else TINT if self.held else CARD)
        page.shapes.frame(image, self.box, rounding(page), 2 * hair(page), ACCENT if self.chosen else EDGE)
        self._words(page, CARD if self.chosen else INK).paint(image, page)
        if self.cap is not None:
            box = self._cap_box(page)
            page.shapes.frame(image, box, box.height // 5, hair(page), HAIR)
            Label("", box, "", self.cap, CARD if self.chosen else QUIET, "centre").paint(image, page)
        if self.focused:
            inner = self.box.grown(-3 * hair(page)) if self.chosen else self.box
            page.shapes.frame(image, inner, rounding(page), ring(page), CARD if self.chosen else INK)

    def _cap_box(self, page: Page) -> Box:
        side, pad = cap_px(page), page.metrics.unit(2.4)
        if self.large:
            return Box(self.box.middle[0] - side // 2, self.box.bottom - 2 * pad - side, side, side)
        return Box(self.box.left + pad, self.box.top + (self.box.height - side) // 2, side, side)

    def _words(self, page: Page, colour: tuple[int, int, int] = INK) -> Label:
        pad = page.metrics.unit(2.4)
        beside = 0 if self.cap is None or self.large else cap_px(page) + pad
        below = 0 if self.cap is None or not self.large else cap_px(page) + 2 * pad
        box = Box(
            self.box.left + pad + beside, self.box.top, self.box.width - 2 * (pad + beside), self.box.height - below
        )
        return Label(f"{self.name}.text", box, self.name, self.laid or BLANK, colour, "centre")


@dataclass(frozen=True)
class ButtonRow:
    """Buttons of equal size in one or more rows, centred."""

    labels: tuple[Laid, ...]
    caps: tuple[Laid | None, ...]
    across: int
    width: int
    tall: int
    gap: int
    large: bool = False

    @property
    def rows(self) -> int:
        """Return the number of rows."""
        return ceil(len(self.labels) / self.across)

    @property
    def height(self) -> int:
        """Return the height of all rows."""
        return self.rows * self.tall + (self.rows - 1) * self.gap

    def placed(self, page: Page, room: Box, name: str, within: bool = True) -> tuple[OptionButton, ...]:
        """Return the buttons in the middle of a room, a little taller where there is room."""
        spare = 0 if self.large else (room.height - self.height) // self.rows
        tall = self.tall + max(0, min(spare, page.metrics.unit(4)))
        top = room.top + (room.height - self.rows * tall - (self.rows - 1) * self.gap) // 2
        buttons = []
        for n, (laid, cap) in enumerate(zip(self.labels, self.caps, strict=True)):
            row, column = divmod(n, self.across)
            count = min(self.across, len(self.labels) - row * self.across)
            left = room.left + (room.width - count * self.width - (count - 1) * self.gap) // 2
            box = Box(left + column * (self.width + self.gap), top + row * (tall + self.gap), self.width, tall)
            inside = name if within else ""
            buttons.append(OptionButton(f"{name} option {n}", box, inside, laid, cap=cap, large=self.large))
        return tuple(buttons)


def key_pad(page: Page, keys: Sequence[str], size: int, width: int) -> ButtonRow | None:
    """Return the keys that type a number by touch, or None if they do not fit at this size."""
    row = button_row(page, keys, size, width)
    return None if row is None else replace(row, caps=(None,) * len(keys))


def cap_px(page: Page) -> int:
    """Return the side of the picture of a key."""
    return round(1.5 * page.metrics.text(4.0))


def button_row(page: Page, labels: Sequence[str], size: int, width: int) -> ButtonRow | None:
    """Return the buttons of a choice on a card, or None if a label is too wide at this size.

    The fewest rows are taken in which every label has at most two lines.
    """
    unit, count = page.metrics.unit, len(labels)
    gap = max(unit(GAP), page.metrics.mm(NEAREST_TARGETS_MM) + 2)
    beside = 2 * (2 * unit(2.4) + cap_px(page))
    for rows in range(1, count + 1):
        across = ceil(count / rows)
        room = (width - (across - 1) * gap) // across
        laid = [lay(page.fonts, label, size, max(1, min(room, unit(WIDEST)) - beside), even=True) for label in labels]
        whole = [one for one in laid if one is not None and len(one.lines) <= (2 if across > 1 else 9)]
        if len(whole) == count:
            wide = max(round(NARROWEST * size), max(one.width for one in whole) + beside + unit(4))
            tall = max(page.metrics.target(12), round(TALL * size), max(one.height for one in whole) + 2 * unit(1))
            return ButtonRow(tuple(whole), _caps(page, count), across, min(wide, room, unit(WIDEST)), tall, gap)
    return None


def large_buttons(page: Page, labels: Sequence[str], room: Box) -> ButtonRow | None:
    """Return large buttons for a choice that is all that is asked, or None if they do not fit into the room."""
    unit, count = page.metrics.unit, len(labels)
    gap = max(unit(LARGE_GAP if count < 7 else GAP), page.metrics.mm(NEAREST_TARGETS_MM) + 2)
    below, pad = cap_px(page) + 2 * unit(2.4), unit(2.4)
    for size in dict.fromkeys(page.metrics.text(step) for step in LARGE):
        for rows in range(1, count + 1):
            across = ceil(count / rows)
            wide = min((room.width - (across - 1) * gap) // across, unit(LARGE_WIDEST))
            tall = min((room.height - (rows - 1) * gap) // rows, unit(LARGE_TALL))
            laid = [lay(page.fonts, label, size, wide - 2 * pad, bold=True, even=True) for label in labels]
            whole = [one for one in laid if one is not None and one.height <= tall - below - unit(4)]
            if len(whole) == count and all(len(one.lines) <= 2 for one in whole) and tall >= page.metrics.target():
                return ButtonRow(tuple(whole), _caps(page, count), across, wide, tall, gap, large=True)
    return None


def _caps(page: Page, count: int) -> tuple[Laid | None, ...]:
    size = page.metrics.text(4.0)
    return tuple(Laid((str(n),), size, 0) if n <= KEYS else None for n in range(1, count + 1))
