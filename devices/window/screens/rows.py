"""Where rating lines stand: a card for each attribute with its explanation, its two words and its line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from palpate.devices.window.geometry import Box, WindowError
from palpate.devices.window.paint import QUIET
from palpate.devices.window.paint_text import Laid, lay
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.cards import dealt, sheets_of, stacked
from palpate.devices.window.screens.elements import Card, Element, Label, rounding
from palpate.devices.window.screens.frame import MARGIN, STEPS, fitted
from palpate.devices.window.screens.targets import Track
from palpate.protocols.study import Attribute, Scale

WIDEST_WORDS, NARROWEST_WORDS = 76.0, 24.0
"""Room for the words beside a line, in the design's millimetres."""
BAND = 10.0
OVERHANG = 5.0
"""How far the band that takes presses reaches beyond the line's ends."""
SMALLER = 0.86
"""Explanations and labels are set so much smaller than the words."""
PAD = 0.8


@dataclass(frozen=True)
class Row:
    """One attribute's place: `fixed` never changes, `track` is the line before its first touch."""

    fixed: tuple[Element, ...]
    track: Track


@dataclass(frozen=True)
class Across:
    """Widths that all rows share."""

    page: Page
    line_px: int
    words_px: int

    @property
    def band_px(self) -> int:
        """The height of the band that takes presses."""
        return self.line_px + 2 * self.page.metrics.unit(OVERHANG)

    @property
    def card_px(self) -> int:
        """The width of the card: words, band, words, and the gaps between them."""
        return self.band_px + 2 * (self.words_px + 2 * self.page.metrics.unit(3))

    @property
    def told_px(self) -> int:
        """The width of the explanation."""
        return self.card_px - 2 * self.page.metrics.unit(3)


@dataclass(frozen=True)
class _Set:
    """An attribute's texts at one size."""

    low: Laid
    high: Laid
    explanation: Laid | None
    labels: tuple[tuple[float, Laid], ...]
    height: int

    @property
    def labels_px(self) -> int:
        """The height of the labels below the line."""
        return max((laid.height for _, laid in self.labels), default=0)


def rows(page: Page, attributes: Sequence[Attribute], room: Box, scale: Scale) -> list[list[Row]]:
    """Return the rows of every sheet: one sheet where all fit, at the largest size at which they do.

    Raises WindowError where a word does not fit, or the line itself.
    """
    widths = _across(page, room)
    ticks = tuple(_share(scale, value) for value in scale.ticked)

    def sets(size: int) -> list[_Set] | None:
        labels = _labels(widths, scale, size)
        sets_at_size = [None if labels is None else _set(widths, attribute, size, labels) for attribute in attributes]
        return None if None in sets_at_size else [item for item in sets_at_size if item is not None]

    def heights(size: int) -> list[int] | None:
        sets_at_size = sets(size)
        return None if sets_at_size is None else [item.height for item in sets_at_size]

    chosen = sheets_of(page, room, len(attributes), heights)
    if chosen is None or (sets_at_size := sets(chosen[1])) is None:
        raise _refusal(widths, attributes, room, scale)
    return _placed(_narrowed(widths, sets_at_size), room, dealt(sets_at_size, chosen[0]), ticks)


def _across(page: Page, room: Box) -> Across:
    """Return the widths for a screen. Raise WindowError where the line with its words is wider than the screen."""
    unit = page.metrics.unit
    widths = Across(page, page.metrics.mm(page.length_mm), unit(NARROWEST_WORDS))
    if widths.card_px > room.width:
        needed = (widths.card_px + 2 * unit(MARGIN)) / page.metrics.px_per_mm
        raise WindowError(
            f"a line of {page.length_mm:g} mm with its words needs a screen at least {needed:.0f} mm wide; "
            f"this one has {page.metrics.width_px / page.metrics.px_per_mm:.0f} mm ({page.metrics}); "
            "take a larger screen, or calibrate again if it is larger"
        )
    spare = (room.width - widths.card_px) // 2
    return replace(widths, words_px=min(widths.words_px + spare, unit(WIDEST_WORDS)))


def _narrowed(widths: Across, sets: Sequence[_Set]) -> Across:
    """Return the widths with cards no wider than their widest words and explanations need."""
    words = max(max(item.low.width, item.high.width) for item in sets) + widths.page.metrics.unit(2)
    widest = max(item.explanation.width if item.explanation is not None else 0 for item in sets)
    words = max(words, max((_overhang(widths, share, laid) for share, laid in sets[0].labels), default=0))
    least = words + (max(0, widest - replace(widths, words_px=words).told_px) + 1) // 2
    return replace(widths, words_px=min(widths.words_px, max(least, widths.page.metrics.unit(46))))


def _share(scale: Scale, value: float) -> float:
    return (value - scale.low) / (scale.high - scale.low)


def _overhang(widths: Across, share: float, laid: Laid) -> int:
    """Return how much room a label takes beside the band, under the words, in pixels."""
    beyond = laid.width // 2 - round(min(share, 1 - share) * widths.line_px)
    return max(0, beyond - widths.page.metrics.unit(OVERHANG))


def _labels(widths: Across, scale: Scale, size: int) -> tuple[tuple[float, Laid], ...] | None:
    """Return the scale's labels with their shares of the line, or None where one is wider than its place.

    A label has half the way to its neighbours, one at an end of the line also the room under the words.
    """
    page, small = widths.page, max(round(SMALLER * size), widths.page.metrics.text(0))
    shares = [_share(scale, value) for value, _ in scale.labelled]
    outer = (widths.words_px + page.metrics.unit(OVERHANG)) / widths.line_px
    edges = [-outer, *((a + b) / 2 for a, b in pairwise(shares)), 1 + outer]
    labels = []
    for (_, text), share, before, after in zip(scale.labelled, shares, edges, edges[1:], strict=False):
        width = round(2 * min(share - before, after - share) * widths.line_px) - page.metrics.unit(1)
        laid = lay(page.fonts, page.say(text), small, width, even=True) if width > 0 else None
        if laid is None:
            return None
        labels.append((share, laid))
    return tuple(labels)


def _set(widths: Across, attribute: Attribute, size: int, labels: tuple[tuple[float, Laid], ...]) -> _Set | None:
    """Return the texts at a size, or None where a word is too wide."""
    page, unit = widths.page, widths.page.metrics.unit
    low, high = (
        lay(page.fonts, page.say(text), size, widths.words_px, bold=True, even=True)
        for text in (attribute.low, attribute.high)
    )
    small = max(round(SMALLER * size), page.metrics.text(0))
    words = page.say(attribute.explanation) if attribute.explanation else None
    explanation = lay(page.fonts, words, small, widths.told_px, even=True) if words else None
    if low is None or high is None or (words and explanation is None):
        return None
    height = max(page.metrics.target(BAND), low.height, high.height)
    height += explanation.height if explanation is not None else 0
    height += max((laid.height for _, laid in labels), default=0)
    return _Set(low, high, explanation, labels, height + 2 * unit(PAD))


def _placed(widths: Across, room: Box, sheets: list[list[_Set]], ticks: tuple[float, ...]) -> list[list[Row]]:
    sheets_of_rows, number = [], 0
    for sheet in sheets:
        boxes = stacked(widths.page, room, widths.card_px, [item.height for item in sheet])
        pairs = zip(sheet, boxes, strict=True)
        sheets_of_rows.append(
            [_row(widths, texts, card, n, ticks) for n, (texts, card) in enumerate(pairs, start=number)]
        )
        number += len(sheet)
    return sheets_of_rows


def _row(widths: Across, texts: _Set, card: Box, number: int, ticks: tuple[float, ...]) -> Row:
    unit, name = widths.page.metrics.unit, f"row {number}"
    spare = card.height - texts.height
    top, bottom = card.top + unit(PAD) + spare // 3, card.bottom - unit(PAD) - spare // 4
    fixed: list[Element] = [Card(name, card, radius=rounding(widths.page))]
    if texts.explanation is not None:
        place = Box(card.left + unit(3), top, widths.told_px, texts.explanation.height)
        fixed.append(Label(f"{name} told", place, name, texts.explanation, QUIET, "centre"))
        top = place.bottom
    bottom -= texts.labels_px
    height = min(bottom - top, widths.page.metrics.target(BAND) + spare // 3)
    tall = max(height, texts.low.height, texts.high.height) if texts.labels else bottom - top
    words = Box(card.left + unit(3), top + (bottom - top - tall) // 2, widths.words_px, tall)
    band = Box(words.right + unit(3), top + (bottom - top - height) // 2, widths.band_px, height)
    fixed.append(Label(f"{name} low", words, name, texts.low, align="right"))
    fixed.append(Label(f"{name} high", words.moved(band.right + unit(3) - words.left, 0), name, texts.high))
    track = Track(f"slider {number}", band, name, line_px=widths.line_px, ticks=ticks)
    for n, (share, laid) in enumerate(texts.labels):
        middle = track.line.left + round(share * (widths.line_px - 1))
        place = Box(middle - (laid.width + 1) // 2, words.bottom, laid.width + 1, laid.height)
        fixed.append(Label(f"{name} label {n}", place, name, laid, QUIET, "centre"))
    return Row(tuple(fixed), track)


def _refusal(widths: Across, attributes: Sequence[Attribute], room: Box, scale: Scale) -> WindowError:
    """Return an error that names the text that does not fit; raise it directly where it is one text alone."""
    page = widths.page
    for attribute in attributes:
        for text in (attribute.low, attribute.high):
            fitted(page, page.say(text), widths.words_px, room.height // 2, STEPS, bold=True)
        if attribute.explanation:
            fitted(page, page.say(attribute.explanation), widths.told_px, room.height // 2, STEPS)
    if _labels(widths, scale, 1) is None:
        shown = ", ".join(repr(page.say(text)) for _, text in scale.labelled)
        return WindowError(f"the labels {shown:.200} do not fit below a line of {page.length_mm:g} mm; shorten them")
    return WindowError(f"a line with its explanation does not fit on a screen of {page.metrics}; take a larger one")
