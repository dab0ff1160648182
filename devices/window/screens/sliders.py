"""Rating on lines: their layout, the effect of a press, and the answers.

There are no ticks unless the scale has some, no numbers, and no marker before the first touch; Next is off until all
are answered. For every marker its answer, when and how often it was touched, and its path are recorded. A line is on a
card for its attribute, with the two words and the explanation.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from palpate.devices.window.geometry import Box, Placed, WindowError
from palpate.devices.window.inputs import Key, Moved, Pressed, Released
from palpate.devices.window.paint import ACCENT, CARD, INK, QUIET, TINT, plain
from palpate.devices.window.paint_text import Laid, lay
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base, Missing, back_and_next
from palpate.devices.window.screens.cards import dealt, sheets_of, stacked
from palpate.devices.window.screens.elements import Card, Element, Label, hair, rounding
from palpate.devices.window.screens.frame import MARGIN, STEPS, Frame, fitted, trial_frame
from palpate.devices.window.screens.targets import Target
from palpate.protocols.events import Ask, Samples
from palpate.protocols.forms import Sliders
from palpate.protocols.study import Attribute, Scale

if TYPE_CHECKING:
    from PIL import Image

FINE = 100
"""Steps from end to end by keyboard if the scale has none."""
COARSE = 10
"""Number of steps of the page keys."""
ROW = struct.Struct("<3f")
WIDEST_WORDS, NARROWEST_WORDS = 76.0, 24.0
"""Room for the words beside a line, in the design's millimetres."""
BAND = 10.0
OVERHANG = 5.0
"""How far the band that takes presses extends beyond the line's ends."""
SMALLER = 0.86
"""Size of explanations and labels relative to the words."""
PAD = 0.8


class SliderScreen(Base):
    """A form with one line for each attribute."""

    def __init__(self, ask: Ask, form: Sliders, page: Page, t0_ns: int) -> None:
        super().__init__(self._frame_for(page, ask, form), may_go_back=ask.may_go_back)
        self.form = form
        self.marks = Marks(form, t0_ns, dict(ask.previous or {}))
        self._sheets = self._lines()
        self.lay_out_on(len(self._sheets))

    def _frame_for(self, page: Page, ask: Ask, _form: Sliders, /) -> Frame:
        left, right = back_and_next(page)
        return trial_frame(page, ask, "sliders_prompt", page.texts("sliders_hint"), left, right)

    def _lines(self) -> list[list[PlacedAttribute]]:
        return rows(self.page, self.form.attributes, self.room, self.form.scale)

    @property
    def room(self) -> Box:
        """Return the room for the lines."""
        return self.frame.body

    def body(self) -> Iterator[Element]:
        for row in self._sheets[self.sheet]:
            yield from row.fixed
            answer = self.marks.answers.get(self.form.attributes[self._attribute(row.track.name)].name)
            scale = self.form.scale
            share = None if answer is None else (answer - scale.low) / (scale.high - scale.low)
            yield replace(row.track, share=share, held=row.track.name == self.held)

    def missing(self) -> Sequence[Missing]:
        sliders = [(row.track.name, self._attribute(row.track.name)) for row in self._sheets[self.sheet]]
        return [
            (name, f"{self.page.say(self.form.attributes[n].low)} – {self.page.say(self.form.attributes[n].high)}")
            for name, n in sliders
            if self.form.attributes[n].name not in self.marks.answers
        ]

    def value(self) -> dict[str, Any]:
        return self.marks.value()

    def so_far(self) -> Mapping[str, float]:
        return dict(self.marks.answers)

    def samples(self) -> tuple[Samples, ...]:
        return self.marks.samples()

    def pressed(self, name: str, event: Pressed) -> None:
        if name.startswith("slider "):
            self.marks.touch(self._attribute(name))
            self._set_from(name, event)

    def dragged(self, name: str, event: Moved | Released) -> None:
        if name.startswith("slider "):
            self._set_from(name, event)

    def key(self, name: str | None, event: Key) -> bool:
        if event.name in ("up", "down"):
            self.move_focus(1 if event.name == "down" else -1, [row.track.name for row in self._sheets[self.sheet]])
            return True
        if name is None and event.name in ("left", "right", "home", "end", "pageup", "pagedown"):
            self.focus = name = self._sheets[self.sheet][0].track.name
        if name is None or not name.startswith("slider "):
            return False
        number = self._attribute(name)
        value = keyed(self.form.scale, self.marks.answers.get(self.form.attributes[number].name), event)
        if value is None:
            return False
        self.marks.touch(number, by_key=True)
        self._put(number, value)
        return True

    def show(self, answers: Mapping[str, Any]) -> None:
        self.marks.answers.update(answers)

    def _set_from(self, name: str, event: Pressed | Moved | Released) -> None:
        row = next(row for row in self._sheets[self.sheet] if row.track.name == name)
        scale = self.form.scale
        self._put(self._attribute(name), scale.low + row.track.share_at(event.x) * (scale.high - scale.low))

    def _put(self, number: int, value: float) -> None:
        self.marks.put(number, value, self.now_s)
        self.notice = ()

    @staticmethod
    def _attribute(name: str) -> int:
        return int(name.removeprefix("slider "))


def keyed(scale: Scale, before: float | None, event: Key) -> float | None:
    """Return the value that a key sets on a scale, from the value before; None for a key that sets none."""
    step = float(scale.step) if scale.step is not None else (scale.high - scale.low) / FINE
    moves = {"left": -step, "right": step, "pagedown": -COARSE * step, "pageup": COARSE * step}
    ends = {"home": float(scale.low), "end": float(scale.high)}
    if event.name in ends:
        return ends[event.name]
    if event.name not in moves:
        return None
    return (scale.low + scale.high) / 2 if before is None else before + moves[event.name]


@dataclass
class Marks:
    """Markers by attribute; an untouched marker has no answer, which is not the same as zero."""

    form: Sliders
    t0_ns: int
    answers: dict[str, float] = field(default_factory=dict)
    at_s: dict[str, float] = field(default_factory=dict)
    touches: dict[str, int] = field(default_factory=dict)
    path: bytearray = field(default_factory=bytearray)
    _keyed: int | None = None

    def touch(self, number: int, by_key: bool = False) -> None:
        """Count a touch of a marker; consecutive keys on one marker are one touch."""
        if by_key and self._keyed == number:
            return
        self._keyed = number if by_key else None
        name = self.form.attributes[number].name
        self.touches[name] = self.touches.get(name, 0) + 1

    def put(self, number: int, value: float, at_s: float) -> None:
        """Set a marker to the scale's nearest answer, and record the change as a sample."""
        name = self.form.attributes[number].name
        answer = float(self.form.scale.nearest(value)) + 0.0  # a plain float, and never -0.0
        self.at_s[name] = round(at_s, 3)
        if self.answers.get(name) != answer:
            self.answers[name] = answer
            self.path += ROW.pack(number, at_s, answer)

    def value(self) -> dict[str, Any]:
        """Return the answers in the form's order, with times and touches of the touched markers."""
        return {
            part: {name: known[name] for name in self.form.items() if name in known}
            for part, known in (("answers", self.answers), ("at_s", self.at_s), ("touches", self.touches))
        }

    def samples(self) -> tuple[Samples, ...]:
        """Return the paths of the markers; empty if none was moved."""
        if not self.path:
            return ()
        channels, units = ("item", "time", "value"), ("index", "s", "scale")
        return (Samples("marker", channels, units, 0.0, self.t0_ns, bytes(self.path)),)


@dataclass(frozen=True)
class Track(Target):
    """A rating line in the band that takes presses; `share` is the marker's position, None before the first touch.

    `ticks` are the shares of the line that have a tick mark.
    """

    line_px: int = 0
    ticks: tuple[float, ...] = ()
    share: float | None = None

    @property
    def line(self) -> Box:
        """Return the line's box, whose width is the prescribed length."""
        thick = max(2, self.box.height // 20)
        left = self.box.left + (self.box.width - self.line_px) // 2
        return Box(left, self.box.top + (self.box.height - thick) // 2, self.line_px, thick)

    @property
    def marker(self) -> Box | None:
        """Return the marker's box, whose middle is the answer."""
        if self.share is None:
            return None
        width = max(5, self.box.height // 5) | 1
        height = round(0.72 * self.box.height)
        x = self.line.left + round(self.share * (self.line_px - 1))
        return Box(x - width // 2, self.box.top + (self.box.height - height) // 2, width, height)

    @property
    def strokes(self) -> tuple[Box, ...]:
        """Return the ticks, each centred on its value."""
        line, height = self.line, round(0.36 * self.box.height)
        middles = (line.left + round(share * (self.line_px - 1)) for share in self.ticks)
        top = self.box.top + (self.box.height - height) // 2
        return tuple(Box(middle - line.height // 2, top, line.height, height) for middle in middles)

    def share_at(self, x: float) -> float:
        """Return the position of a point along the line, 0 at its first pixel and 1 at its last, clipped."""
        return min(max((x - self.line.left) / (self.line_px - 1), 0.0), 1.0)

    def placed(self, _page: Page, /) -> Iterator[Placed]:
        yield Placed(self.name, "target", self.box, within=self.within)
        yield Placed(f"{self.name}.line", "mark", self.line, within=self.name)
        if (marker := self.marker) is not None:
            yield Placed(f"{self.name}.marker", "marker", marker, within=self.name)

    def paint(self, image: Image.Image, page: Page) -> None:
        if self.held or self.focused:
            page.shapes.fill(image, self.box, rounding(page), TINT)
        plain(image, self.line, INK)
        for stroke in self.strokes:
            plain(image, stroke, INK)
        if (marker := self.marker) is not None:
            page.shapes.fill(image, marker.grown(hair(page)), marker.width, CARD)
            page.shapes.fill(image, marker, marker.width // 2, ACCENT)
        self._ring(image, page)


@dataclass(frozen=True)
class PlacedAttribute:
    """An attribute's place: `fixed` never changes, `track` is the line before its first touch."""

    fixed: tuple[Element, ...]
    track: Track


@dataclass(frozen=True)
class Across:
    """The widths that all rows share."""

    page: Page
    line_px: int
    words_px: int

    @property
    def band_px(self) -> int:
        """Return the height of the band that takes presses."""
        return self.line_px + 2 * self.page.metrics.unit(OVERHANG)

    @property
    def card_px(self) -> int:
        """Return the width of the card: words, band, words, and the gaps between them."""
        return self.band_px + 2 * (self.words_px + 2 * self.page.metrics.unit(3))

    @property
    def explanation_px(self) -> int:
        """Return the width of the explanation."""
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
        """Return the height of the labels below the line."""
        return max((laid.height for _, laid in self.labels), default=0)


def rows(page: Page, attributes: Sequence[Attribute], room: Box, scale: Scale) -> list[list[PlacedAttribute]]:
    """Return the rows of every sheet: one sheet if all fit, at the largest possible size.

    Raises WindowError if a word, or the line itself, does not fit.
    """
    widths = across(page, room)
    ticks = tuple(share_of(scale, value) for value in scale.ticked)

    def sets(size: int) -> list[_Set] | None:
        labels = labels_below(widths, scale, size)
        sets_at_size = [None if labels is None else _set(widths, attribute, size, labels) for attribute in attributes]
        return None if None in sets_at_size else [item for item in sets_at_size if item is not None]

    def heights(size: int) -> list[int] | None:
        sets_at_size = sets(size)
        return None if sets_at_size is None else [item.height for item in sets_at_size]

    chosen = sheets_of(page, room, len(attributes), heights)
    if chosen is None or (sets_at_size := sets(chosen[1])) is None:
        raise _refusal(widths, attributes, room, scale)
    return _placed(_narrowed(widths, sets_at_size), room, dealt(sets_at_size, chosen[0]), ticks)


def across(page: Page, room: Box) -> Across:
    """Return the widths for a screen. Raises WindowError if the line with its words is wider than the screen."""
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
    least = words + (max(0, widest - replace(widths, words_px=words).explanation_px) + 1) // 2
    return replace(widths, words_px=min(widths.words_px, max(least, widths.page.metrics.unit(46))))


def share_of(scale: Scale, value: float) -> float:
    """Return where a value stands on the line, from 0 at its low end to 1 at its high end."""
    return (value - scale.low) / (scale.high - scale.low)


def _overhang(widths: Across, share: float, laid: Laid) -> int:
    """Return the width of a label's part beside the band, under the words, in pixels."""
    beyond = laid.width // 2 - round(min(share, 1 - share) * widths.line_px)
    return max(0, beyond - widths.page.metrics.unit(OVERHANG))


def labels_below(widths: Across, scale: Scale, size: int) -> tuple[tuple[float, Laid], ...] | None:
    """Return the scale's labels with their shares of the line, or None if one is wider than its place.

    A label has half the distance to its neighbours; one at an end of the line also has the room under the words.
    """
    page, small = widths.page, max(round(SMALLER * size), widths.page.metrics.text(0))
    shares = [share_of(scale, value) for value, _ in scale.labelled]
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
    """Return the texts at a size, or None if a word is too wide."""
    page, unit = widths.page, widths.page.metrics.unit
    low, high = (
        lay(page.fonts, page.say(text), size, widths.words_px, bold=True, even=True)
        for text in (attribute.low, attribute.high)
    )
    small = max(round(SMALLER * size), page.metrics.text(0))
    words = page.say(attribute.explanation) if attribute.explanation else None
    explanation = lay(page.fonts, words, small, widths.explanation_px, even=True) if words else None
    if low is None or high is None or (words and explanation is None):
        return None
    height = max(page.metrics.target(BAND), low.height, high.height)
    height += explanation.height if explanation is not None else 0
    height += max((laid.height for _, laid in labels), default=0)
    return _Set(low, high, explanation, labels, height + 2 * unit(PAD))


def _placed(
    widths: Across, room: Box, sheets: list[list[_Set]], ticks: tuple[float, ...]
) -> list[list[PlacedAttribute]]:
    sheets_of_rows, number = [], 0
    for sheet in sheets:
        boxes = stacked(widths.page, room, widths.card_px, [item.height for item in sheet])
        pairs = zip(sheet, boxes, strict=True)
        sheets_of_rows.append(
            [_row(widths, texts, card, n, ticks) for n, (texts, card) in enumerate(pairs, start=number)]
        )
        number += len(sheet)
    return sheets_of_rows


def _row(widths: Across, texts: _Set, card: Box, number: int, ticks: tuple[float, ...]) -> PlacedAttribute:
    unit, name = widths.page.metrics.unit, f"row {number}"
    spare = card.height - texts.height
    top, bottom = card.top + unit(PAD) + spare // 3, card.bottom - unit(PAD) - spare // 4
    fixed: list[Element] = [Card(name, card, radius=rounding(widths.page))]
    if texts.explanation is not None:
        place = Box(card.left + unit(3), top, widths.explanation_px, texts.explanation.height)
        fixed.append(Label(f"{name} explanation", place, name, texts.explanation, QUIET, "centre"))
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
    return PlacedAttribute(tuple(fixed), track)


def _refusal(widths: Across, attributes: Sequence[Attribute], room: Box, scale: Scale) -> WindowError:
    """Return an error that names the text that does not fit; raise it directly if it is a single text."""
    page = widths.page
    for attribute in attributes:
        for text in (attribute.low, attribute.high):
            fitted(page, page.say(text), widths.words_px, room.height // 2, STEPS, bold=True)
        if attribute.explanation:
            fitted(page, page.say(attribute.explanation), widths.explanation_px, room.height // 2, STEPS)
    if labels_below(widths, scale, 1) is None:
        shown = ", ".join(repr(page.say(text)) for _, text in scale.labelled)
        return WindowError(f"the labels {shown:.200} do not fit below a line of {page.length_mm:g} mm; shorten them")
    return WindowError(f"a line with its explanation does not fit on a screen of {page.metrics}; take a larger one")
