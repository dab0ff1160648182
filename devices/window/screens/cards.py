"""Cards below one another: items distributed over sheets, and each sheet's cards spread over the available room."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil
from typing import TypeVar

from palpate.devices.window.geometry import Box
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.frame import STEPS

T = TypeVar("T")
APART = 1.2
"""Least distance between cards, in the design's millimetres."""
LOOSEST = 13.0
"""Greatest height that is added for each card: further apart, they would not look like one form."""


def dealt(items: Sequence[T], sheets: int) -> list[list[T]]:
    """Return the items in order on `sheets` sheets, evenly."""
    each = max(1, ceil(len(items) / sheets))
    return [list(items[start : start + each]) for start in range(0, len(items), each)]


def sheets_of(
    page: Page,
    room: Box,
    count: int,
    heights: Callable[[int], list[int] | None],
    steps: Sequence[float] = STEPS,
) -> tuple[int, int] | None:
    """Return (sheets, em size): the fewest sheets for `count` items, at the largest size that fits; None if none does.

    `heights` returns the height of each item's card at an em size in pixels, None if a text does not fit.
    """
    known = {size: heights(size) for size in dict.fromkeys(page.metrics.text(step) for step in steps)}
    for sheets in range(1, count + 1):
        for size, found in known.items():
            if found is not None and all(tall(page, sheet) <= room.height for sheet in dealt(found, sheets)):
                return sheets, size
    return None


def tall(page: Page, heights: Sequence[int]) -> int:
    """Return the total height of cards below one another."""
    return sum(heights) + (len(heights) - 1) * page.metrics.unit(APART)


def stacked(page: Page, room: Box, width: int, heights: Sequence[int]) -> list[Box]:
    """Return the cards' boxes, in the middle of the room, with spare height given to cards and gaps."""
    unit = page.metrics.unit
    more = min((room.height - tall(page, heights)) // len(heights), unit(LOOSEST))
    taller = round(0.7 * more)
    gap = unit(APART) + more - taller
    block = sum(heights) + taller * len(heights) + gap * (len(heights) - 1)
    top, left = room.top + max(0, room.height - block) // 2, room.left + (room.width - width) // 2
    boxes = []
    for height in heights:
        boxes.append(Box(left, top, width, height + taller))
        top = boxes[-1].bottom + gap
    return boxes
