"""The layout of the designer's window: sliders on the left, their door on the right, buttons below."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.devices.window.geometry import Box
from palpate.devices.window.paint_text import Laid
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.frame import fitted
from palpate.devices.window.typeset import LABEL_STEPS, line_px

NUMBERS = 4.6
"""Text size of numbers and legends."""
COLUMN = 23.0
"""Width of a slider with its words, in the design's millimetres."""
PLAYS = ("play", "stop", "confirm")
"""Keys of the texts of the main button."""
LEFT_BUTTONS = ("undo", "redo", "compare", "save", "open", "export", "reset", "help")


@dataclass(frozen=True)
class Columns:
    """The parts of the sliders' card, one entry per attribute: words above, slider, words below, the two numbers."""

    highs: tuple[Box, ...]
    sliders: tuple[Box, ...]
    lows: tuple[Box, ...]
    wished: tuple[Box, ...]
    feels: tuple[Box, ...]


@dataclass(frozen=True)
class Panel:
    """The parts of the door's card."""

    force_axis: Box
    chips: tuple[Box, Box]
    plot: Box
    angle_axis: Box
    legend: Box
    smoothing_label: Box
    smoothing: Box
    smoothing_value: Box
    words: Box


@dataclass(frozen=True)
class Layout:
    """The whole window: a head with a button to close, the card of the wishes, the card of the door, a foot."""

    head: Box
    close: Box
    wishes: Box
    columns: Columns
    door: Box
    panel: Panel
    foot: Box


def lay_out(page: Page, count: int) -> Layout:
    """Return the layout for `count` sliders."""
    metrics, unit = page.metrics, page.metrics.unit
    margin = unit(7)
    head = Box(margin, unit(3.5), metrics.width_px - 2 * margin, metrics.target(10))
    foot_height = metrics.target(12)
    foot = Box(margin, metrics.height_px - unit(5) - foot_height, metrics.width_px - 2 * margin, foot_height)
    top, bottom = head.bottom + unit(2.5), foot.top - unit(4)
    wishes = Box(margin, top, min(count * unit(COLUMN), round(0.56 * foot.width)) + unit(4), bottom - top)
    door = Box(wishes.right + unit(4), top, foot.right - wishes.right - unit(4), bottom - top)
    close = Box(head.right - unit(28), head.top, unit(28), head.height)
    return Layout(head, close, wishes, _columns(page, wishes, count), door, _panel(page, door), foot)


def _columns(page: Page, card: Box, count: int) -> Columns:
    unit, line = page.metrics.unit, line_px(page, NUMBERS)
    pad, two = unit(2), 2 * line + unit(0.5)
    width = (card.width - 2 * pad) // count
    lefts = [card.left + pad + width * number for number in range(count)]
    high, wished = card.top + unit(2), card.bottom - unit(2) - 2 * line
    low = wished - unit(1) - two
    slider = high + two + unit(1)

    def row(top: int, height: int, gap: int) -> tuple[Box, ...]:
        return tuple(Box(left + gap // 2, top, width - gap, height) for left in lefts)

    tight, apart = unit(0.6), page.metrics.mm(1.0) + 1
    sliders = row(slider, low - unit(1) - slider, apart)
    numbers = row(wished, line, tight), row(wished + line, line, tight)
    return Columns(row(high, two, tight), sliders, row(low, two, tight), *numbers)


def _panel(page: Page, card: Box) -> Panel:
    unit, metrics, line = page.metrics.unit, page.metrics, line_px(page, NUMBERS)
    chip, inner = metrics.target(8), card.grown(-unit(3))
    force = Box(inner.left, inner.top, inner.width - 2 * chip - unit(6), chip)
    left_chip = Box(inner.right - 2 * chip - unit(2), inner.top, chip, chip)
    words_height = 3 * line_px(page, 4.2) + unit(1)
    words = Box(inner.left, inner.bottom - words_height, inner.width, words_height)
    band = metrics.target(8.5)
    smooth, label, value = words.top - unit(1.5) - band, unit(30), unit(25)
    smoothing = Box(inner.left + label, smooth, inner.width - label - value, band)
    legend = Box(inner.left, smooth - unit(1) - line, inner.width, line)
    axis = Box(inner.left, legend.top - line, inner.width, line)
    plot_top, numbers = force.bottom + unit(3), unit(11)
    plot = Box(inner.left + numbers, plot_top, inner.width - numbers - unit(4), axis.top - line - line // 3 - plot_top)
    return Panel(
        force, (left_chip, Box(inner.right - chip, inner.top, chip, chip)), plot, axis, legend,
        Box(inner.left, smooth, label, band), smoothing, Box(smoothing.right, smooth, value, band), words,
    )  # fmt: skip


def buttons(page: Page, foot: Box, words: dict[str, str], play: str) -> dict[str, tuple[Box, Laid]]:
    """Return boxes and words of the foot's buttons: the main one on the right, the others from the left.

    The main button is as wide as its widest wording; `play` is the key of its current wording.
    """
    unit = page.metrics.unit
    answers = {key: fitted(page, page.texts(key), unit(80), foot.height, LABEL_STEPS, bold=True) for key in PLAYS}
    main = max(unit(46), *(text.width + unit(8) for text in answers.values()))
    placed = {"play": (Box(foot.right - main, foot.top, main, foot.height), answers[play])}
    room, gap = foot.width - main - unit(6), unit(2.4)
    for step in LABEL_STEPS:
        for pad in (7.0, 5.0, 3.6):
            laid = {name: fitted(page, text, room, foot.height, (step,)) for name, text in words.items()}
            widths = {name: max(page.metrics.target(9), box.width + unit(pad)) for name, box in laid.items()}
            if sum(widths.values()) + gap * (len(widths) - 1) <= room:
                return placed | _in_a_row(foot, laid, widths, gap)
    narrow = (room - gap * (len(words) - 1)) // len(words)
    laid = {
        name: fitted(page, text, narrow - page.metrics.unit(2), foot.height, LABEL_STEPS, even=True)
        for name, text in words.items()
    }
    return placed | _in_a_row(foot, laid, dict.fromkeys(words, narrow), gap)


def _in_a_row(foot: Box, laid: dict[str, Laid], widths: dict[str, int], gap: int) -> dict[str, tuple[Box, Laid]]:
    placed, x = {}, foot.left
    for name, width in widths.items():
        placed[name] = Box(x, foot.top, width, foot.height), laid[name]
        x += width + gap
    return placed
