"""Boxes of given areas that fill a rectangle and are as square as can be: squarified treemaps.

Source: Bruls, Huizing & van Wijk, Squarified Treemaps, 2000.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Box:
    """A rectangle by its left upper corner, its width and its height; `top` grows downwards."""

    left: float
    top: float
    width: float
    height: float


def squarified(sizes: Sequence[float], width: float, height: float) -> tuple[Box, ...]:
    """A box for each size, its area in proportion, in the order given (largest first makes the squarest boxes).

    Raises ValueError where a size is not above 0: such a box cannot be drawn.
    """
    if not all(0 < size < float("inf") for size in sizes):
        raise ValueError("a treemap has boxes only for sizes above 0")
    largest = max(sizes, default=1.0)
    total = sum(size / largest for size in sizes)
    areas = [size / largest / total * width * height for size in sizes]
    boxes: list[Box] = []
    free, start = Box(0.0, 0.0, width, height), 0
    while start < len(areas):
        end = _row_end(areas, start, min(free.width, free.height))
        placed, free = _laid(areas[start:end], free)
        boxes += placed
        start = end
    return tuple(boxes)


def _row_end(areas: Sequence[float], start: int, side: float) -> int:
    """How many boxes make the row along `side` whose worst box is nearest to a square."""
    end, worst = start + 1, _worst(areas[start : start + 1], side)
    while end < len(areas) and (longer := _worst(areas[start : end + 1], side)) <= worst:
        end, worst = end + 1, longer
    return end


def _worst(areas: Sequence[float], side: float) -> float:
    """The largest ratio of sides in a row of these areas along `side`."""
    if side <= 0:
        return float("inf")
    depth = sum(areas) / side
    return max(max(depth * depth / area, area / (depth * depth)) for area in areas)


def _laid(areas: Sequence[float], free: Box) -> tuple[list[Box], Box]:
    """A row of boxes along the shorter side of the free rectangle, and what is free after it."""
    upright = free.width >= free.height
    side = free.height if upright else free.width
    depth = sum(areas) / side if side > 0 else 0.0
    boxes, along = [], 0.0
    for area in areas:
        length = area / depth if depth > 0 else 0.0
        if upright:
            boxes.append(Box(free.left, free.top + along, depth, length))
        else:
            boxes.append(Box(free.left + along, free.top, length, depth))
        along += length
    if upright:
        return boxes, Box(free.left + depth, free.top, max(free.width - depth, 0.0), free.height)
    return boxes, Box(free.left, free.top + depth, free.width, max(free.height - depth, 0.0))
