"""Boxes on the screen, sizes in millimetres, and checks of every layout."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

SMALLEST_TARGET_MM = 8.0
"""Smallest side of anything to press, large enough without careful aiming."""
NEAREST_TARGETS_MM = 1.0
SMALLEST_TEXT_MM = 4.0
"""Smallest em size of text: an x-height of 2.1 mm and capitals of 2.8 mm, 12 and 16 minutes of arc at 60 cm (ISO
9241-303 asks for characters of 16 at least).
"""
DESIGN_MM = (320.0, 180.0)
"""The screen size that distances are designed for; other screens are scaled."""
SMALLEST_SCALE, LARGEST_SCALE = 0.8, 1.4
SMALLEST_SCREEN_PX = (1024, 640)
ROUNDING_PX = 1.0


class WindowError(ValueError):
    """A participant's window that cannot show what is requested, with its current setup."""


@dataclass(frozen=True)
class Metrics:
    """A screen's size in pixels, and its pixels per millimetre."""

    width_px: int
    height_px: int
    px_per_mm: float

    def __post_init__(self) -> None:
        least = SMALLEST_SCREEN_PX
        if self.width_px < least[0] or self.height_px < least[1]:
            raise WindowError(f"the screen has {self}; at least {least[0]}x{least[1]} px are needed")
        if not 1 <= self.px_per_mm <= 40:
            raise WindowError(f"{self.px_per_mm} px per mm; 1 to 40 are expected: calibrate the screen again")

    def __str__(self) -> str:
        return f"{self.width_px}x{self.height_px} px at {self.px_per_mm:.2f} px/mm"

    @property
    def scale(self) -> float:
        """Return how much larger than designed everything is drawn, except prescribed lengths."""
        width_mm, height_mm = self.width_px / self.px_per_mm, self.height_px / self.px_per_mm
        fits = min(width_mm / DESIGN_MM[0], height_mm / DESIGN_MM[1])
        return min(max(fits, SMALLEST_SCALE), LARGEST_SCALE)

    def mm(self, length_mm: float) -> int:
        """Return a prescribed length in pixels."""
        return round(length_mm * self.px_per_mm)

    def unit(self, design_mm: float) -> int:
        """Return a distance of the design in pixels, at least 1."""
        return max(1, round(design_mm * self.px_per_mm * self.scale))

    def target(self, design_mm: float = SMALLEST_TARGET_MM) -> int:
        """Return a target's side in pixels: as designed, but never too small to press."""
        return max(self.unit(design_mm), self.mm(SMALLEST_TARGET_MM) + 1)

    def text(self, design_mm: float) -> int:
        """Return an em size in pixels: as designed, but never too small to read."""
        return max(self.unit(design_mm), round(SMALLEST_TEXT_MM * self.px_per_mm + 0.5))

    @property
    def screen(self) -> Box:
        """Return the whole screen."""
        return Box(0, 0, self.width_px, self.height_px)


@dataclass(frozen=True)
class Box:
    """A rectangle of whole pixels; left and top are inside, right and bottom just outside."""

    left: int
    top: int
    width: int
    height: int

    @property
    def right(self) -> int:
        return self.left + self.width

    @property
    def bottom(self) -> int:
        return self.top + self.height

    @property
    def middle(self) -> tuple[int, int]:
        """Return the pixel in the middle."""
        return self.left + self.width // 2, self.top + self.height // 2

    def holds(self, x: float, y: float) -> bool:
        """Return whether the point is inside."""
        return self.left <= x < self.right and self.top <= y < self.bottom

    def contains(self, other: Box) -> bool:
        """Return whether the other box is completely inside."""
        inside = self.left <= other.left and self.top <= other.top
        return inside and other.right <= self.right and other.bottom <= self.bottom

    def overlaps(self, other: Box) -> bool:
        """Return whether the two share a pixel."""
        beside = self.right <= other.left or other.right <= self.left
        return not (beside or self.bottom <= other.top or other.bottom <= self.top)

    def moved(self, x: int, y: int) -> Box:
        """Return the box shifted by pixels."""
        return Box(self.left + x, self.top + y, self.width, self.height)

    def grown(self, by: int) -> Box:
        """Return the box with `by` pixels more on every side (fewer if negative, but never below an empty box)."""
        width, height = max(0, self.width + 2 * by), max(0, self.height + 2 * by)
        return Box(self.left - by, self.top - by, width, height)

    def joined(self, other: Box) -> Box:
        """Return the smallest box around both."""
        left, top = min(self.left, other.left), min(self.top, other.top)
        return Box(left, top, max(self.right, other.right) - left, max(self.bottom, other.bottom) - top)

    def common(self, other: Box) -> Box:
        """Return the intersection of both, of size 0 if they do not overlap."""
        left, top = max(self.left, other.left), max(self.top, other.top)
        width, height = min(self.right, other.right) - left, min(self.bottom, other.bottom) - top
        return Box(left, top, max(0, width), max(0, height))

    def gap(self, other: Box) -> int:
        """Return the pixels between two boxes, across or down, whichever is more; negative if they overlap."""
        across = max(self.left, other.left) - min(self.right, other.right)
        down = max(self.top, other.top) - min(self.bottom, other.bottom)
        return max(across, down)


Kind = Literal["target", "text", "mark", "marker"]


@dataclass(frozen=True)
class Placed:
    """An element's place on the screen.

    Targets can be pressed, texts are read, markers lie on marks, and marks are all others. `ink` is the area that the
    text covers when drawn; `within` names the target or mark that it belongs to and lies in.
    """

    name: str
    kind: Kind
    box: Box
    text: str = ""
    ink: Box | None = None
    within: str = ""


def problems(placed: Sequence[Placed], metrics: Metrics) -> list[str]:
    """Return the problems of a layout: outside, clipped, overlapping, too small or too near; [] if there are none."""
    return [*_alone(placed, metrics), *_against_each_other(placed, metrics)]


def _alone(placed: Sequence[Placed], metrics: Metrics) -> Iterator[str]:
    boxes = {element.name: element.box for element in placed}
    if len(boxes) < len(placed):
        yield "two elements have one name"
    for element in placed:
        if not metrics.screen.contains(element.box):
            yield f"{element.name}: {element.box} reaches out of the screen of {metrics}"
        if element.ink is not None and not element.box.grown(1).contains(element.ink):
            yield f"{element.name}: the text {element.text!r:.60} needs {element.ink} and has {element.box}"
        if element.within and not boxes[element.within].contains(element.box):
            yield f"{element.name}: is partly outside of {element.within}"
        if element.kind == "target" and min(element.box.width, element.box.height) + ROUNDING_PX < metrics.mm(
            SMALLEST_TARGET_MM
        ):
            size = f"{element.box.width}x{element.box.height} px"
            yield f"{element.name}: a target of {size} is smaller than {SMALLEST_TARGET_MM} mm"


def _against_each_other(placed: Sequence[Placed], metrics: Metrics) -> Iterator[str]:
    apart = NEAREST_TARGETS_MM * metrics.px_per_mm - ROUNDING_PX
    # What each element lies in, and what that lies in, and so on.
    parents = {element.name: element.within for element in placed}
    around: dict[str, set[str]] = {}
    for name, parent in parents.items():
        chain, above = set[str](), parent
        while above and above not in chain:
            chain.add(above)
            above = parents.get(above, "")
        around[name] = chain
    for index, one in enumerate(placed):
        for other in placed[index + 1 :]:
            if (
                other.name in around[one.name]
                or one.name in around[other.name]
                or (one.within == other.within and {one.kind, other.kind} == {"mark", "marker"})
            ):
                continue
            if one.box.overlaps(other.box):
                yield f"{one.name} overlaps {other.name}"
            elif one.kind == other.kind == "target" and one.box.gap(other.box) < apart:
                yield f"{one.name} and {other.name}: targets only {one.box.gap(other.box)} px apart"
