"""Places for the names of points that cover neither points nor other names."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

from palpate.analysis.figures.lettering import width_pt

GAP = 1.6
DIRECTIONS = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1))
AROUND = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1))
RADIUS = 3.4
"""The radius of a point, in points."""


class Bubble(NamedTuple):
    """A bubble's centre and radius in points from the corner of the axes, and its name."""

    x: float
    y: float
    radius: float
    name: str


class LabelSpot(NamedTuple):
    """The place of a name: its left end and its vertical middle, in points."""

    x: float
    y: float
    text: str


class _Box(NamedTuple):
    left: float
    bottom: float
    right: float
    top: float


def place_beside_bubbles(bubbles: Sequence[Bubble], side: float, size: float) -> list[LabelSpot]:
    """Return places for the names that fit within a square of that side; isolated bubbles come first.

    A name is tried at eight places around its bubble, in reading order. A name without room has no place.
    """
    names: list[_Box] = []
    spots: list[LabelSpot] = []
    crowd = [sum(math.hypot(a.x - b.x, a.y - b.y) < 45 for b in bubbles) for a in bubbles]
    for k in sorted(range(len(bubbles)), key=lambda k: (crowd[k], k)):
        bubble = bubbles[k]
        wide, high = width_pt(bubble.name, size), 1.15 * size
        boxes = []
        for dx, dy in DIRECTIONS:
            reach = (bubble.radius + GAP) / math.hypot(dx, dy)
            x, y = bubble.x + dx * reach, bubble.y + dy * reach
            left = x if dx > 0 else x - wide if dx < 0 else x - wide / 2
            bottom = y if dy > 0 else y - high if dy < 0 else y - high / 2
            boxes.append(_Box(left, bottom, left + wide, bottom + high))
        for box in boxes:
            if _is_free(box, bubbles, names, side):
                names.append(box)
                spots.append(LabelSpot(box.left, (box.bottom + box.top) / 2, bubbles[k].name))
                break
    return spots


def _is_free(box: _Box, bubbles: Sequence[Bubble], taken: Sequence[_Box], side: float) -> bool:
    """Return whether a box lies within the square and overlaps neither a bubble nor a name."""
    if box.left < 0 or box.bottom < 0 or box.right > side or box.top > side:
        return False
    for other in taken:
        if box.left < other.right and other.left < box.right and box.bottom < other.top and other.bottom < box.top:
            return False
    for bubble in bubbles:
        near = math.hypot(
            bubble.x - min(max(bubble.x, box.left), box.right), bubble.y - min(max(bubble.y, box.bottom), box.top)
        )
        if near < bubble.radius + 0.4:
            return False
    return True


@dataclass(frozen=True)
class Area:
    """An occupied area, in points."""

    left: float
    bottom: float
    right: float
    top: float

    def shared(self, other: Area) -> float:
        """Return the overlap with another area, in square points."""
        wide = min(self.right, other.right) - max(self.left, other.left)
        tall = min(self.top, other.top) - max(self.bottom, other.bottom)
        return wide * tall if wide > 0 and tall > 0 else 0.0


def area_about(middle: tuple[float, float], wide: float, tall: float) -> Area:
    """Return the area with these sides around a middle."""
    x, y = middle
    return Area(x - wide / 2, y - tall / 2, x + wide / 2, y + tall / 2)


@dataclass(frozen=True)
class PlacedName:
    """A name's middle relative to its point, in points; `free` is False if it overlaps something."""

    x: float
    y: float
    free: bool


def place_beside_points(
    points: Sequence[tuple[float, float]], names: Sequence[str], size: float, taken: Sequence[Area] = ()
) -> list[PlacedName]:
    """Return a place for each name around its point (both in points); the most crowded points come last.

    Of eight places around the point and eight further away, the one with the least overlap is chosen, the nearer one
    first.
    """
    blocked = [*taken, *(area_about(point, 2 * RADIUS, 2 * RADIUS) for point in points)]
    chosen: dict[int, PlacedName] = {}
    crowd = [sum(abs(a - x) < 40 and abs(b - y) < 20 for a, b in points) for x, y in points]
    for i in sorted(range(len(points)), key=lambda i: (crowd[i], i)):
        sides = (width_pt(names[i], size), 1.05 * size)
        candidates = []  # what a name would cover there, in square points, and the place
        for far, (right, up) in product((1.0, 2.4), AROUND):
            gap = 4.6 * far
            middle = right * (gap + sides[0] / 2), up * (gap + sides[1] / 2) * (0.75 if right else 1.0)
            area = area_about((points[i][0] + middle[0], points[i][1] + middle[1]), *sides)
            cover = sum(area.shared(other) for other in blocked)
            candidates.append((cover, PlacedName(*middle, cover < 1.0)))
        chosen[i] = min(candidates, key=lambda candidate: candidate[0])[1]
        if chosen[i].free:
            blocked.append(area_about((points[i][0] + chosen[i].x, points[i][1] + chosen[i].y), *sides))
    return [chosen[i] for i in range(len(points))]
