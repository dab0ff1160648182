"""Where words to tick stand: as many columns as the rows allow, at the largest size at which nothing is cut."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

from palpate.devices.window.geometry import NEAREST_TARGETS_MM, Box, WindowError
from palpate.devices.window.paint_text import Laid, lay
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.cards import dealt
from palpate.devices.window.screens.frame import STEPS, fitted
from palpate.devices.window.screens.targets import Tick

MOST_COLUMNS = 8
TALLEST, WIDEST = 15.0, 72.0
"""Largest cell, in the design's millimetres."""


def grid(page: Page, words: Sequence[str], room: Box) -> tuple[list[list[Tick]], int]:
    """The words' cells on every sheet, row by row, and the number of columns.

    One sheet where it can be, with the largest text for which it can. Raises WindowError naming a word too long.
    """
    sizes = list(dict.fromkeys(page.metrics.text(step) for step in STEPS))
    for sheets in range(1, len(words) + 1):
        for size in sizes:
            for columns in range(2, MOST_COLUMNS + 1):
                if found := _attempt(page, dealt(words, sheets), room, size, columns):
                    return found, columns
    longest = max(words, key=lambda word: page.fonts.width(word, sizes[-1]))
    fitted(page, longest, _cell(page, room, 2, 1)[0], room.height, STEPS)
    raise WindowError(f"{len(words)} words do not fit on a screen of {page.metrics}; take a larger one")


def _attempt(page: Page, sheets: list[list[str]], room: Box, size: int, columns: int) -> list[list[Tick]] | None:
    """The sheets at a size in so many columns, or None where a cell is too small for a finger or its word."""
    lines = ceil(len(sheets[0]) / columns)
    width, height = _cell(page, room, columns, lines)
    if height < page.metrics.target(0):
        return None
    space = Tick("word", Box(0, 0, width, height)).text_box(page)
    laid = []
    for sheet in sheets:
        found = [_word(page, word, size, space) for word in sheet]
        if None in found:
            return None
        laid.append([each for each in found if each is not None])
    return _cells(page, laid, room, columns, width, height)


def _word(page: Page, word: str, size: int, space: Box) -> Laid | None:
    laid = lay(page.fonts, word, size, space.width, even=True)
    return laid if laid is not None and laid.height <= space.height else None


def _cell(page: Page, room: Box, columns: int, lines: int) -> tuple[int, int]:
    """Width and height of a cell."""
    unit, gap = page.metrics.unit, _gap(page)
    width = min(unit(WIDEST), (room.width - (columns - 1) * gap) // columns)
    return width, min(unit(TALLEST), (room.height - (lines - 1) * gap) // lines)


def _cells(page: Page, sheets: list[list[Laid]], room: Box, columns: int, width: int, height: int) -> list[list[Tick]]:
    gap, number, found = _gap(page), 0, []
    left = room.left + (room.width - columns * width - (columns - 1) * gap) // 2
    for sheet in sheets:
        lines = ceil(len(sheet) / columns)
        top = room.top + (room.height - lines * height - (lines - 1) * gap) // 2
        cells = []
        for place, laid in enumerate(sheet):
            x, y = left + (place % columns) * (width + gap), top + (place // columns) * (height + gap)
            cells.append(Tick(f"word {number + place}", Box(x, y, width, height), laid=laid))
        found.append(cells)
        number += len(sheet)
    return found


def _gap(page: Page) -> int:
    return max(page.metrics.unit(1.2), page.metrics.mm(NEAREST_TARGETS_MM))
