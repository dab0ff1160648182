"""Elements that can be pressed: buttons, check boxes, round buttons and fields."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from palpate.devices.window.geometry import NEAREST_TARGETS_MM, Box, Placed
from palpate.devices.window.paint import ACCENT, CARD, EDGE, GROUND, HAIR, INK, QUIET, TINT, Colour, plain
from palpate.devices.window.paint_text import BLANK, LEADING, Laid, bearing, draw, ink
from palpate.devices.window.screens.elements import Element, Label, hair, ring, rounding

if TYPE_CHECKING:
    from PIL import Image

    from palpate.devices.window.screen import Page


@dataclass(frozen=True)
class Target(Element):
    """An element to press."""

    laid: Laid | None = None
    focused: bool = False
    held: bool = False

    @property
    def stops(self) -> bool:
        return True

    def placed(self, page: Page) -> Iterator[Placed]:
        yield Placed(self.name, "target", self.box, within=self.within)
        if self.laid is not None:
            yield from self._label(page).placed(page)

    def _label(self, page: Page, colour: Colour = INK) -> Label:
        """Return the text of the target, with the target's padding around it."""
        pad = page.metrics.unit(2)
        inner = Box(self.box.left + pad, self.box.top, self.box.width - 2 * pad, self.box.height)
        return Label(f"{self.name}.text", inner, self.name, self.laid or BLANK, colour, "centre")

    def _ring(self, image: Image.Image, page: Page, colour: Colour = INK) -> None:
        """Draw the keyboard's focus: a strong frame just inside the edge."""
        if self.focused:
            page.shapes.frame(image, self.box, rounding(page), ring(page), colour)


@dataclass(frozen=True)
class Button(Target):
    """A button; a `primary` one leads on, a `chosen` one is the current side."""

    primary: bool = False
    on: bool = True
    chosen: bool = False

    def paint(self, image: Image.Image, page: Page) -> None:
        full = (self.primary and self.on) or self.chosen
        ground = ACCENT if full else TINT if self.held else CARD if self.on else GROUND
        page.shapes.fill(image, self.box, rounding(page), ground)
        edge = ACCENT if full else EDGE if self.on else HAIR
        page.shapes.frame(image, self.box, rounding(page), hair(page) * (1 if full or not self.on else 2), edge)
        self._label(page, CARD if full else INK if self.on else QUIET).paint(image, page)
        if self.focused:
            inner = self.box.grown(-2 * hair(page)) if full else self.box
            page.shapes.frame(image, inner, rounding(page), ring(page), CARD if full else INK)


@dataclass(frozen=True)
class Tick(Target):
    """A word with a check box: ticked words have a tick mark and a strong frame."""

    ticked: bool = False

    @property
    def _square(self) -> Box:
        side = round(0.5 * self.box.height)
        inset = (self.box.height - side) // 2
        return Box(self.box.left + inset, self.box.top + inset, side, side)

    def text_box(self, page: Page) -> Box:
        """Return the box of the word."""
        left = self._square.right + page.metrics.unit(1.6)
        return Box(left, self.box.top, self.box.right - page.metrics.unit(1.2) - left, self.box.height)

    def placed(self, page: Page) -> Iterator[Placed]:
        yield Placed(self.name, "target", self.box, within=self.within)
        yield from self._word(page).placed(page)
        yield Placed(f"{self.name}.tick", "mark", self._square, within=self.name)

    def paint(self, image: Image.Image, page: Page) -> None:
        page.shapes.fill(image, self.box, rounding(page), TINT if self.ticked else CARD)
        width = 2 * hair(page) if self.ticked else hair(page)
        page.shapes.frame(image, self.box, rounding(page), width, ACCENT if self.ticked else HAIR)
        square = self._square
        if self.ticked:
            page.shapes.fill(image, square, square.width // 5, ACCENT)
            page.shapes.tick(image, square.grown(-square.width // 6), max(2, square.width // 8), CARD)
        else:
            page.shapes.fill(image, square, square.width // 5, CARD)
            page.shapes.frame(image, square, square.width // 5, 2 * hair(page), EDGE)
        self._word(page).paint(image, page)
        self._ring(image, page)

    def _word(self, page: Page) -> Label:
        return Label(f"{self.name}.text", self.text_box(page), self.name, self.laid or BLANK)


@dataclass(frozen=True)
class Dot(Target):
    """A round button of a row of choices, on the left of its text, or in the middle without text."""

    chosen: bool = False
    stop: bool = True

    @property
    def stops(self) -> bool:
        return self.stop

    @property
    def _circle(self) -> Box:
        side = round(0.62 * min(self.box.width, self.box.height)) | 1
        inset = (self.box.height - side) // 2
        left = self.box.left + (inset if self.laid is not None else (self.box.width - side) // 2)
        return Box(left, self.box.top + inset, side, side)

    def text_box(self, page: Page) -> Box:
        """Return the box of the text."""
        left = self._circle.right + page.metrics.unit(2)
        return Box(left, self.box.top, self.box.right - page.metrics.unit(1) - left, self.box.height)

    def placed(self, page: Page) -> Iterator[Placed]:
        yield Placed(self.name, "target", self.box, within=self.within)
        if self.laid is not None:
            yield from self._word(page).placed(page)

    def paint(self, image: Image.Image, page: Page) -> None:
        disc(image, page, self._circle, self.chosen)
        if self.laid is not None:
            self._word(page).paint(image, page)
        self._ring(image, page)

    def _word(self, page: Page) -> Label:
        return Label(f"{self.name}.text", self.text_box(page), self.name, self.laid or BLANK)


@dataclass(frozen=True)
class Points(Target):
    """Round buttons in a row, of which one can be chosen (0-based); a press chooses the nearest."""

    count: int = 1
    at: int | None = None

    @property
    def circles(self) -> tuple[Box, ...]:
        """Return the circles of the buttons, evenly spaced."""
        pitch = self.box.width / self.count
        side = round(0.66 * min(self.box.height, pitch)) | 1
        top = self.box.top + (self.box.height - side) // 2
        return tuple(
            Box(round(self.box.left + (n + 0.5) * pitch) - side // 2, top, side, side) for n in range(self.count)
        )

    def nearest(self, x: float) -> int:
        """Return the number of the button nearest to a point."""
        return min(max(int((x - self.box.left) * self.count / self.box.width), 0), self.count - 1)

    def placed(self, page: Page) -> Iterator[Placed]:
        yield Placed(self.name, "target", self.box, within=self.within)
        pitch = self.box.width / self.count
        gap = page.metrics.mm(NEAREST_TARGETS_MM) if self.count > 1 else 0
        for n, circle in enumerate(self.circles):
            left = round(self.box.left + n * pitch + gap / 2)
            reach = Box(left, self.box.top, round(pitch) - gap - 1, self.box.height)
            yield Placed(f"{self.name}.{n}", "target", reach, within=self.name)
            yield Placed(f"{self.name}.{n}.circle", "mark", circle, within=f"{self.name}.{n}")

    def paint(self, image: Image.Image, page: Page) -> None:
        if self.focused:
            page.shapes.fill(image, self.box, rounding(page), TINT)
        first, last = self.circles[0], self.circles[-1]
        middle = first.middle[1]
        plain(image, Box(first.middle[0], middle, last.middle[0] - first.middle[0], hair(page)), HAIR)
        for n, circle in enumerate(self.circles):
            disc(image, page, circle, n == self.at)
        self._ring(image, page)


@dataclass(frozen=True)
class TextBox(Target):
    """A text field: its visible lines and, while it is edited, the caret (line, x)."""

    lines: tuple[str, ...] = ()
    size: int = 1
    caret: tuple[int, int] | None = None
    pad: int = 0
    off: bool = False
    placeholder: Laid | None = None

    @property
    def inner(self) -> Box:
        """Return the box of the text."""
        return inside(self.box, self.pad, round(LEADING * self.size))

    def placed(self, page: Page) -> Iterator[Placed]:
        yield Placed(self.name, "target", self.box, within=self.within)
        shown = self._shown()
        yield Placed(f"{self.name}.text", "text", self.inner, shown.text, None, self.name)
        if self.placeholder is not None:
            covered = ink(page.fonts, self.placeholder, self.inner)
            yield Placed(f"{self.name}.hint", "text", self.inner, self.placeholder.text, covered, f"{self.name}.text")

    def paint(self, image: Image.Image, page: Page) -> None:
        page.shapes.fill(image, self.box, rounding(page), GROUND if self.off else CARD)
        width = hair(page) * (3 if self.focused else 2)
        page.shapes.frame(image, self.box, rounding(page), width, ACCENT if self.focused else EDGE)
        shown = self._shown()
        place = Box(self.inner.left, self.inner.top, self.inner.width, max(shown.height, shown.leading))
        draw(image, page.fonts, shown, place, INK)
        if self.placeholder is not None:
            draw(image, page.fonts, self.placeholder, self.inner, QUIET)
        if self.caret is not None:
            line, x = self.caret
            top = self.inner.top + line * shown.leading + shown.leading // 8
            plain(
                image,
                Box(self.inner.left + bearing(self.size) + x, top, max(2, self.size // 12), round(0.8 * shown.leading)),
                ACCENT,
            )

    def _shown(self) -> Laid:
        return Laid(self.lines, self.size, self.inner.width)


def inside(box: Box, pad: int, line: int) -> Box:
    """Return the room for text in a field: `pad` on all sides, but less above and below if a line needs it."""
    above = min(pad, max(0, (box.height - line) // 2))
    return Box(box.left + pad, box.top + above, box.width - 2 * pad, box.height - 2 * above)


def disc(image: Image.Image, page: Page, circle: Box, chosen: bool) -> None:
    """Draw a round button; a chosen one contains a disc."""
    page.shapes.fill(image, circle, circle.width // 2 + 1, CARD)
    page.shapes.frame(
        image, circle, circle.width // 2 + 1, hair(page) * (3 if chosen else 2), ACCENT if chosen else EDGE
    )
    if chosen:
        page.shapes.fill(image, circle.grown(-(circle.width // 4)), circle.width, ACCENT)
