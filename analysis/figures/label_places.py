"""Names beside bubbles, where they cover neither a bubble nor another name."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from palpate.analysis.figures.lettering import width_pt

GAP = 1.6
DIRECTIONS = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1))


class Bubble(NamedTuple):
    """A bubble's centre and radius in points from the corner of the axes, and its name."""

    x: float
    y: float
    radius: float
    name: str


class Spot(NamedTuple):
    """Where a name stands: its left end and its middle height, in points."""

    x: float
    y: float
    text: str


class _Box(NamedTuple):
    left: float
    bottom: float
    right: float
    top: float


def placed_labels(bubbles: Sequence[Bubble], side: float, size: float) -> list[Spot]:
    """The names that have room within a square of that side; lonely bubbles get theirs first.

    A name is tried at eight places around its bubble, nearest to reading order first. One without room has no spot.
    """
    taken: list[_Box] = []
    spots: list[Spot] = []
    crowd = [sum(math.hypot(a.x - b.x, a.y - b.y) < 45 for b in bubbles) for a in bubbles]
    for k in sorted(range(len(bubbles)), key=lambda k: (crowd[k], k)):
        for box in _candidates(bubbles[k], size):
            if _free(box, bubbles, taken, side):
                taken.append(box)
                spots.append(Spot(box.left, (box.bottom + box.top) / 2, bubbles[k].name))
                break
    return spots


def _candidates(bubble: Bubble, size: float) -> list[_Box]:
    wide, high = width_pt(bubble.name, size), 1.15 * size
    found = []
    for dx, dy in DIRECTIONS:
        reach = (bubble.radius + GAP) / math.hypot(dx, dy)
        x, y = bubble.x + dx * reach, bubble.y + dy * reach
        left = x if dx > 0 else x - wide if dx < 0 else x - wide / 2
        bottom = y if dy > 0 else y - high if dy < 0 else y - high / 2
        found.append(_Box(left, bottom, left + wide, bottom + high))
    return found


def _free(box: _Box, bubbles: Sequence[Bubble], taken: Sequence[_Box], side: float) -> bool:
    if box.left < 0 or box.bottom < 0 or box.right > side or box.top > side:
        return False
    for other in taken:
        if box.left < other.right and other.left < box.right and box.bottom < other.top and other.bottom < box.top:
            return False
    for each in bubbles:
        near = math.hypot(
            each.x - min(max(each.x, box.left), box.right), each.y - min(max(each.y, box.bottom), box.top)
        )
        if near < each.radius + 0.4:
            return False
    return True
