"""Colours and antialiased shapes, painted with Pillow."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from palpate.devices.window.geometry import Box

if TYPE_CHECKING:
    from PIL import Image

Colour = tuple[int, int, int]
Lines = tuple[tuple[tuple[float, float], ...], ...]
"""Lines through points, as shares of a box's width and height."""
TICK: Lines = (((0.08, 0.55), (0.38, 0.85), (0.92, 0.18)),)
CROSS: Lines = (((0.14, 0.14), (0.86, 0.86)), ((0.86, 0.14), (0.14, 0.86)))
GROUND: Colour = (246, 247, 249)
CARD: Colour = (255, 255, 255)
HAIR: Colour = (205, 211, 219)
EDGE: Colour = (84, 94, 108)
"""Outline of anything that can be pressed: contrast of at least 3:1 against both backgrounds (WCAG 1.4.11)."""
INK: Colour = (23, 28, 36)
QUIET: Colour = (66, 74, 86)
"""Hints and explanations: contrast above 7:1 on both backgrounds (WCAG AAA)."""
ACCENT: Colour = (9, 73, 104)
TINT: Colour = (226, 238, 245)
ALERT: Colour = (130, 28, 20)
WARM: Colour = (138, 74, 12)
"""The colour of a wrong answer: distinct from ACCENT for people of every colour vision, contrast above 6:1 on white."""
SMOOTHING = 4
"""Factor by which shapes are drawn larger before averaging."""


@dataclass
class Shapes:
    """Masks of antialiased shapes, cached by size."""

    _masks: dict[tuple[object, ...], Image.Image] = field(default_factory=dict, repr=False)

    def fill(self, image: Image.Image, box: Box, radius: int, colour: Colour) -> None:
        """Fill a rectangle with rounded corners."""
        image.paste(colour, (box.left, box.top), self._rounded(box.width, box.height, radius, 0))

    def frame(self, image: Image.Image, box: Box, radius: int, width: int, colour: Colour) -> None:
        """Draw the outline of a rectangle with rounded corners, inside the box."""
        image.paste(colour, (box.left, box.top), self._rounded(box.width, box.height, radius, width))

    def tick(self, image: Image.Image, box: Box, width: int, colour: Colour) -> None:
        """Draw a tick mark that fills the box."""
        image.paste(colour, (box.left, box.top), self._tick(box.width, box.height, width))

    def cross(self, image: Image.Image, box: Box, width: int, colour: Colour) -> None:
        """Draw a diagonal cross that fills the box."""
        image.paste(colour, (box.left, box.top), self._cross(box.width, box.height, width))

    def _rounded(self, width: int, height: int, radius: int, outline: int) -> Image.Image:
        key = "rounded", width, height, radius, outline
        if key not in self._masks:
            self._masks[key] = _rounded(width, height, radius, outline)
        return self._masks[key]

    def _tick(self, width: int, height: int, stroke: int) -> Image.Image:
        key = "tick", width, height, stroke
        if key not in self._masks:
            self._masks[key] = _tick(width, height, stroke)
        return self._masks[key]

    def _cross(self, width: int, height: int, stroke: int) -> Image.Image:
        key = "cross", width, height, stroke
        if key not in self._masks:
            self._masks[key] = _lines(width, height, stroke, CROSS)
        return self._masks[key]


def plain(image: Image.Image, box: Box, colour: Colour) -> None:
    """Fill a rectangle with sharp edges: exactly these pixels."""
    image.paste(colour, (box.left, box.top, box.right, box.bottom))


def contrast(one: Colour, other: Colour) -> float:
    """Return the contrast ratio of two colours, 1 to 21 (WCAG 2.2)."""
    lighter, darker = sorted((_luminance(one), _luminance(other)), reverse=True)
    return (lighter + 0.05) / (darker + 0.05)


def _luminance(colour: Colour) -> float:
    linear = [c / 255 / 12.92 if c <= 10 else ((c / 255 + 0.055) / 1.055) ** 2.4 for c in colour]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def _rounded(width: int, height: int, radius: int, outline: int) -> Image.Image:
    """Return the mask of a rounded rectangle: only the corners are antialiased, straight edges are on whole pixels."""
    from PIL import Image

    radius = min(radius, width // 2, height // 2)
    mask = Image.new("L", (width, height), 255)
    if outline:
        mask.paste(0, (outline, outline, max(outline, width - outline), max(outline, height - outline)))
    corner = _corner(max(radius, 1), outline)
    side = corner.width
    for turn, place in enumerate(((0, 0), (0, height - side), (width - side, height - side), (width - side, 0))):
        mask.paste(corner.rotate(90 * turn), place)
    return mask


def _corner(radius: int, outline: int) -> Image.Image:
    """Return the top left corner of a rounded rectangle, `radius` pixels square."""
    from PIL import Image, ImageDraw

    big = radius * SMOOTHING
    corner = Image.new("L", (big, big), 0)
    draw = ImageDraw.Draw(corner)
    draw.ellipse((0, 0, 2 * big - 1, 2 * big - 1), fill=255)
    inner = outline * SMOOTHING
    if 0 < inner < big:
        draw.ellipse((inner, inner, 2 * big - 1 - inner, 2 * big - 1 - inner), fill=0)
    return corner.resize((radius, radius), Image.Resampling.BOX)


def _tick(width: int, height: int, stroke: int) -> Image.Image:
    return _lines(width, height, stroke, TICK)


def _lines(width: int, height: int, stroke: int, lines: Lines) -> Image.Image:
    from PIL import Image, ImageDraw

    mask = Image.new("L", (width * SMOOTHING, height * SMOOTHING), 0)
    draw, thick = ImageDraw.Draw(mask), stroke * SMOOTHING
    for line in lines:
        points = [(x * width * SMOOTHING, y * height * SMOOTHING) for x, y in line]
        draw.line(points, fill=255, width=thick, joint="curve")
    return mask.resize((width, height), Image.Resampling.BOX)
