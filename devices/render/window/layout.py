"""The layout of the renderer's window: the picture on the left, the output on the right, the choices below."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.devices.render.window.photo import PLATE_MM
from palpate.devices.window.geometry import Box
from palpate.devices.window.screen import Page
from palpate.devices.window.typeset import SMALL_STEPS, line_px

MOST_CHIPS = 6
CELLS = (3, 2)
"""Numbers of figures beside and below each other."""


@dataclass(frozen=True)
class Slider:
    """A slider with its name before it and its value behind it."""

    label: Box
    track: Box
    value: Box


@dataclass(frozen=True)
class Plot:
    """A plot with its name above it and the numbers of its axis on the left."""

    name: Box
    numbers: Box
    box: Box


@dataclass(frozen=True)
class Layout:
    """The parts of the window: head, the picture's card with its sliders, the output's card, two rows of choices."""

    head: Box
    close: Box
    touch: Box
    picture: Box
    volume: Slider
    press: Slider
    played: Box
    wave: Plot
    spectrum: Plot
    hertz: Box
    speed: Slider
    force: Slider
    cells: tuple[Box, ...]
    words: Box
    textures: Box
    methods: Box


def lay_out(page: Page) -> Layout:
    """Return the layout on a page's screen."""
    metrics, unit = page.metrics, page.metrics.unit
    margin, gap, chip = unit(6), unit(3), metrics.target(9)
    width, inner_gap = metrics.width_px - 2 * margin, unit(3)
    head = Box(margin, unit(3), width, metrics.target(9))
    close = Box(head.right - unit(28), head.top, unit(28), head.height)
    methods = Box(margin, metrics.height_px - unit(4) - chip, width, chip)
    textures = Box(margin, methods.top - unit(2) - chip, width, chip)
    top, bottom = head.bottom + unit(2), textures.top - gap
    band = metrics.target(8.5)
    plate = min(metrics.mm(PLATE_MM), bottom - top - 2 * band - 4 * inner_gap, width // 2)
    touch = Box(margin, top, max(plate, unit(96)) + 2 * inner_gap, bottom - top)
    left, apart = touch.left + (touch.width - plate) // 2, (touch.height - plate - 2 * band) // 4
    picture = Box(left, top + min(apart, (touch.width - plate) // 2), plate, plate)
    rows = picture.bottom + apart, picture.bottom + 2 * apart + band
    inner = touch.grown(-inner_gap)
    volume, press = (_slider(page, Box(inner.left, row, inner.width, band)) for row in rows)
    played = Box(touch.right + gap, top, margin + width - touch.right - gap, bottom - top)
    return Layout(
        head, close, touch, picture, volume, press, played, *_played(page, played), textures, methods
    )  # fmt: skip


def _slider(page: Page, row: Box) -> Slider:
    unit = page.metrics.unit
    label, value = unit(36), unit(19)
    track = Box(row.left + label, row.top, row.width - label - value, row.height)
    return Slider(Box(row.left, row.top, label, row.height), track, Box(track.right, row.top, value, row.height))


def _played(page: Page, card: Box) -> tuple[Plot, Plot, Box, Slider, Slider, tuple[Box, ...], Box]:
    unit, line = page.metrics.unit, line_px(page, SMALL_STEPS[-1])
    inner = card.grown(-unit(3))
    words = Box(inner.left, inner.bottom - 2 * line, inner.width, 2 * line)
    cell_height = 2 * line + unit(1.5)
    cells_top = words.top - CELLS[1] * cell_height - unit(1)
    cells = tuple(
        Box(inner.left + column * inner.width // CELLS[0], cells_top + row * cell_height, inner.width // CELLS[0],
            cell_height)
        for row in range(CELLS[1]) for column in range(CELLS[0])
    )  # fmt: skip
    gauge = cells_top - unit(2) - line
    half = (inner.width - unit(6)) // 2
    speed = _gauge(page, Box(inner.left, gauge, half, line))
    force = _gauge(page, Box(inner.right - half, gauge, half, line))
    hertz = Box(inner.left, gauge - unit(2) - line, inner.width, line)
    room = hertz.top - line - inner.top
    wave = _plot(page, Box(inner.left, inner.top, inner.width, room // 2 - unit(1)), line)
    spectrum = _plot(page, Box(inner.left, inner.top + room // 2 + unit(1), inner.width, room - room // 2 - unit(1)),
                     line)  # fmt: skip
    return wave, spectrum, hertz, speed, force, cells, words


def _gauge(page: Page, row: Box) -> Slider:
    unit = page.metrics.unit
    label, value, thick = unit(20), unit(26), max(4, row.height // 3)
    track = Box(row.left + label, row.middle[1] - thick // 2, row.width - label - value, thick)
    return Slider(Box(row.left, row.top, label, row.height), track,
                  Box(row.right - value, row.top, value, row.height))  # fmt: skip


def _plot(page: Page, room: Box, line: int) -> Plot:
    unit = page.metrics.unit
    numbers = unit(13)
    box = Box(room.left + numbers, room.top + line + unit(1), room.width - numbers, room.height - line - unit(1))
    return Plot(Box(room.left, room.top, room.width, line), Box(room.left, box.top, numbers - unit(1), box.height), box)
