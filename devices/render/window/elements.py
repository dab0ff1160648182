"""Elements of the renderer's window: the picture, gauges, and the last second of output with its spectrum."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from palpate.devices.window.geometry import Box, Placed
from palpate.devices.window.paint import ACCENT, CARD, HAIR, INK, TINT, Colour, plain
from palpate.devices.window.screens.elements import Element, hair
from palpate.devices.window.screens.profile import GRID
from palpate.devices.window.screens.targets import Target
from palpate.signals.arrays import Array

if TYPE_CHECKING:
    from PIL import Image

    from palpate.devices.window.screen import Page

COURSE: Colour = ACCENT
HERTZ = (0, 100, 200, 300, 400, 500)
DECIBELS = (-60, -40, -20, 0, 20)
RATE_HZ = 1000
SHOWN = 1000
FRAME, HOP = 250, 125
"""Samples of the Hann windows that a spectrum is averaged over: lines are 4 Hz apart."""
LEAST_DB, MOST_DB = -60.0, 20.0
"""The spectrum's axis, in dB re 1 m/s^2 (RMS of each line)."""
SCALES = (1.0, 2.0, 5.0)


@dataclass(frozen=True)
class Touched(Target):
    """The picture to stroke over. `shown` is painted in the middle of the box; None: an empty background."""

    shown: Image.Image | None = field(default=None, compare=False, repr=False)
    of: str = ""

    @property
    def stops(self) -> bool:
        return False

    def paint(self, image: Image.Image, page: Page) -> None:
        plain(image, self.box, TINT)
        if self.shown is not None:
            left = self.box.left + (self.box.width - self.shown.width) // 2
            top = self.box.top + (self.box.height - self.shown.height) // 2
            image.paste(self.shown, (left, top))
        page.shapes.frame(image, self.box, 1, hair(page) * (3 if self.held else 1), ACCENT if self.held else INK)


@dataclass(frozen=True)
class Wave(Element):
    """The last second of the output; `scale` is the end of the axis."""

    acceleration: bytes = b""
    scale: float = 1.0

    def paint(self, image: Image.Image, page: Page) -> None:
        box, thin = self.box, hair(page)
        plain(image, box, CARD)
        for tenth in range(0, 11, 2):
            plain(image, Box(box.left + tenth * (box.width - 1) // 10, box.top, thin, box.height), GRID)
        for row in (0, box.height - thin):
            plain(image, Box(box.left, box.top + row, box.width, thin), GRID)
        plain(image, Box(box.left, box.middle[1], box.width, thin), HAIR)
        low, high = columns(np.frombuffer(self.acceleration), box.width)
        _paste(image, box, self._rows(high), self._rows(low))

    def _rows(self, values: Array) -> Array:
        half = (self.box.height - 1) / 2
        return np.asarray(half - np.clip(values / self.scale, -1, 1) * half)


@dataclass(frozen=True)
class Spectrum(Element):
    """The spectrum of the last second, 0 to 500 Hz."""

    acceleration: bytes = b""

    def paint(self, image: Image.Image, page: Page) -> None:
        box, thin = self.box, hair(page)
        plain(image, box, CARD)
        for hertz in HERTZ:
            plain(image, Box(self.x(hertz), box.top, thin, box.height), GRID)
        for level in DECIBELS:
            plain(image, Box(box.left, self.y(level), box.width, thin), GRID)
        levels = spectrum_dB(np.frombuffer(self.acceleration))
        at = np.interp(np.arange(box.width), np.linspace(0, box.width - 1, len(levels)), levels)
        rows = (MOST_DB - at) / (MOST_DB - LEAST_DB) * (box.height - 1)
        _paste(image, box, rows, np.full(box.width, box.height - 1.0), TINT, floor=at <= LEAST_DB)
        back = np.concatenate([rows[:1], rows[:-1]])
        _paste(image, box, np.minimum(rows, back), np.maximum(rows, back), floor=at <= LEAST_DB)

    def x(self, hertz: float) -> int:
        """Return the pixel column of a frequency."""
        return self.box.left + round(hertz / HERTZ[-1] * (self.box.width - 1))

    def y(self, level_dB: float) -> int:
        """Return the pixel row of a level."""
        return self.box.top + round((MOST_DB - level_dB) / (MOST_DB - LEAST_DB) * (self.box.height - 1))


@dataclass(frozen=True)
class Gauge(Element):
    """A bar that shows a value as a share of its greatest."""

    share: float = 0.0

    def placed(self, _page: Page, /) -> Iterator[Placed]:
        yield Placed(self.name, "mark", self.box, within=self.within)

    def paint(self, image: Image.Image, _page: Page, /) -> None:
        plain(image, self.box, HAIR)
        width = round(min(max(self.share, 0.0), 1.0) * self.box.width)
        if width:
            plain(image, Box(self.box.left, self.box.top, width, self.box.height), ACCENT)


def _paste(
    image: Image.Image, box: Box, tops: Array, bottoms: Array, colour: Colour = COURSE, floor: Array | None = None
) -> None:
    """Paint a column of colour from top to bottom at each place, antialiased at both ends; none where `floor` is
    true.
    """
    from PIL import Image

    rows = np.arange(box.height, dtype=np.float32)[:, None]
    cover = np.minimum(rows - (tops - 1.0), (bottoms + 1.0) - rows).clip(0.0, 1.0)
    if floor is not None:
        cover[:, floor.astype(bool)] = 0.0
    mask = Image.fromarray((255 * cover).astype(np.uint8))
    image.paste(colour, (box.left, box.top), mask)


@dataclass(frozen=True)
class Heard:
    """The last second: acceleration (m/s^2) as float64 bytes, current speed and force, RMS of the part with sound."""

    acceleration: bytes = b""
    speed_mm_s: float = 0.0
    force_N: float = 0.0
    level_m_s2: float = 0.0

    @property
    def samples(self) -> Array:
        """Return the acceleration, oldest first."""
        return np.frombuffer(self.acceleration)


def heard(last: Array) -> Heard:
    """Return the display of signals (3, n): acceleration, speed, force at 1 kHz."""
    if not last.shape[1]:
        return Heard()
    shown = np.ascontiguousarray(last[:, -SHOWN:])
    sounds = shown[0][shown[0] != 0]
    level = float(np.sqrt(np.mean(sounds**2))) if sounds.size else 0.0
    return Heard(shown[0].tobytes(), round(float(shown[1, -1])), round(float(shown[2, -1]), 2), level)


def columns(samples: Array, width: int) -> tuple[Array, Array]:
    """Return the lowest and highest value in each column of pixels, with the newest sample in the last one."""
    last = np.zeros(SHOWN)
    if len(samples):
        last[-len(samples) :] = samples
    edges = np.linspace(0, SHOWN, width + 1).astype(int)
    starts = np.minimum(edges[:-1], SHOWN - 1)
    # A column reaches back to the last sample of the one before, so that the line has no gaps.
    back = np.maximum(starts - 1, 0)
    low = np.minimum(np.minimum.reduceat(last, starts), last[back])
    high = np.maximum(np.maximum.reduceat(last, starts), last[back])
    return low, high


def spectrum_dB(samples: Array) -> Array:
    """Return the RMS of each line, 0 to 500 Hz in steps of 4, in dB re 1 m/s^2, limited to the axis."""
    if len(samples) < FRAME:
        return np.full(FRAME // 2 + 1, LEAST_DB)
    window = np.hanning(FRAME + 1)[:-1]
    starts = range(0, len(samples) - FRAME + 1, HOP)
    pieces = np.array([samples[start : start + FRAME] for start in starts]) * window
    power = 2 * (np.abs(np.fft.rfft(pieces)) ** 2).mean(axis=0) / (FRAME * float(window @ window))
    return np.asarray(np.clip(10 * np.log10(np.maximum(power, 1e-30)), LEAST_DB, MOST_DB))


def scale_for(greatest: float) -> float:
    """Return the end of an axis that holds a value: 1, 2 or 5 times a power of ten."""
    if not greatest > 0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(greatest))
    return next(step * decade for step in (*SCALES, 10.0) if step * decade >= greatest * (1 - 1e-9))
