"""Draw force over angle: antialiased lines and bands as masks, fast enough to follow a slider."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate.devices.window.geometry import Box
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import MAX_ANGLE_DEG, POINTS, POINTS_PER_DEG

if TYPE_CHECKING:
    from PIL import Image

Mask = NDArray[np.uint8]
PixelRows = NDArray[np.float32]
PER_COLUMN = 4
"""Number of places of the profile that are drawn for each column of pixels."""
PIECES = 8
"""Number of pieces of a line, side by side: where it is flat, a move of it touches few rows."""
STEP_N = 10.0
LEAST_N, MOST_N = -20.0, 50.0
"""The axis covers at least this range; a profile beyond extends it by whole steps."""
KEPT = 12
"""Number of masks and pictures that are cached."""


@dataclass(frozen=True)
class Axes:
    """The axes of forces and angles: the plot's box, and the forces at its bottom and top."""

    box: Box
    low_N: float = LEAST_N
    high_N: float = MOST_N

    def x(self, angle_deg: float) -> int:
        """Return the pixel column of an angle."""
        return self.box.left + round(angle_deg / MAX_ANGLE_DEG * (self.box.width - 1))

    def y(self, force_N: float) -> int:
        """Return the pixel row of a force."""
        return self.box.top + round((self.high_N - force_N) / (self.high_N - self.low_N) * (self.box.height - 1))

    @cached_property
    def forces_N(self) -> tuple[float, ...]:
        """Return the forces at the grid's lines, in newtons."""
        steps = round((self.high_N - self.low_N) / STEP_N)
        return tuple(self.low_N + STEP_N * step for step in range(steps + 1))


def axes_for(box: Box, *profiles: Array) -> Axes:
    """Return axes that hold all of these profiles."""
    low = min([LEAST_N, *(float(profile.min()) for profile in profiles)])
    high = max([MOST_N, *(float(profile.max()) for profile in profiles)])
    return Axes(box, STEP_N * math.floor(low / STEP_N + 1e-9), STEP_N * math.ceil(high / STEP_N - 1e-9))


@dataclass(frozen=True)
class Piece:
    """Some columns of a line: its coverage of each pixel of the box, 0 to 255."""

    box: Box
    cover: bytes


def line_mask(force_N: Array, axes: Axes, thick_px: float) -> tuple[int, Mask]:
    """Return the first row that the profile's line touches, and its coverage of each pixel from there, 0 to 255."""
    return _cover(_course(force_N, axes), axes.box.height, thick_px)


def line_pieces(force_N: Array, axes: Axes, thick_px: float) -> tuple[Piece, ...]:
    """Return the line in pieces, from left to right, where it lies on the screen."""
    course, width = _course(force_N, axes), axes.box.width
    ends, pieces = [width * number // PIECES for number in range(PIECES + 1)], []
    for left, right in itertools.pairwise(ends):
        first, mask = _cover(course[:, left:right], axes.box.height, thick_px)
        box = Box(axes.box.left + left, axes.box.top + first, right - left, len(mask))
        pieces.append(Piece(box, mask.tobytes()))
    return tuple(pieces)


def _course(force_N: Array, axes: Axes) -> PixelRows:
    """Return, by column, the line's middle row, its slope factor there (1: flat), its lowest and its highest row."""
    rows = _rows(force_N, axes)
    middle = rows[:, PER_COLUMN // 2]
    lean = 1.0 / np.sqrt(1.0 + np.gradient(middle) ** 2)
    # The highest and lowest row of each column with its neighbours: no line ends beyond what it goes through.
    low, high = rows.min(axis=1), rows.max(axis=1)
    low[1:-1] = np.minimum(low[1:-1], np.minimum(rows[:-2].min(axis=1), rows[2:].min(axis=1)))
    high[1:-1] = np.maximum(high[1:-1], np.maximum(rows[:-2].max(axis=1), rows[2:].max(axis=1)))
    return np.stack([middle, lean, low, high])


def _cover(course: PixelRows, height: int, thick_px: float) -> tuple[int, Mask]:
    """Return the first row and the mask of a line's columns."""
    middle, lean, lowest, highest = course
    half = np.float32(thick_px / 2 + 0.5)
    first = max(0, int(lowest.min() - half) - 1)
    last = min(height, int(highest.max() + half) + 2)
    y = np.arange(first, last, dtype=np.float32)[:, None]
    cover = half - np.abs(y - middle) * lean
    np.minimum(cover, y - (lowest - half), out=cover)
    np.minimum(cover, (highest + half) - y, out=cover)
    np.clip(cover, 0.0, 1.0, out=cover)
    cover *= np.float32(255.0)
    return first, cover.astype(np.uint8)


def band_mask(low_N: Array, high_N: Array, axes: Axes) -> Mask:
    """Return the mask of the pixels between two profiles."""
    top, bottom = _rows(high_N, axes)[:, PER_COLUMN // 2], _rows(low_N, axes)[:, PER_COLUMN // 2]
    y = np.arange(axes.box.height, dtype=np.float32)[:, None]
    cover = np.clip(np.minimum(y - top + 0.5, bottom - y + 0.5), 0.0, 1.0)
    return np.asarray(255.0 * cover, dtype=np.uint8)


def _rows(force_N: Array, axes: Axes) -> PixelRows:
    """Return the profile's row at several places of every column, from the top of the box."""
    width = axes.box.width
    columns = np.arange(width * PER_COLUMN) / PER_COLUMN - 0.5
    places = np.clip(columns, 0, width - 1) / (width - 1) * MAX_ANGLE_DEG * POINTS_PER_DEG
    force = np.interp(places, np.arange(POINTS), force_N)
    rows = (axes.high_N - force) / (axes.high_N - axes.low_N) * (axes.box.height - 1)
    return rows.astype(np.float32).reshape(width, PER_COLUMN)


@dataclass
class Masks:
    """A cache of the painted parts of the plot, so that unchanged parts are not painted again."""

    lines: dict[tuple[object, ...], tuple[Piece, ...]] = field(default_factory=dict)
    pictures: dict[tuple[object, ...], Image.Image] = field(default_factory=dict)

    def line(self, force_N: Array, axes: Axes, thick_px: float) -> tuple[Piece, ...]:
        """Return the pieces of a line, painted once."""
        key = force_N.tobytes(), axes, thick_px
        if key not in self.lines:
            _make_room(self.lines)
            self.lines[key] = line_pieces(force_N, axes, thick_px)
        return self.lines[key]

    def picture(self, key: tuple[object, ...], make: Callable[[], Image.Image]) -> Image.Image:
        """Return a picture by its key, calling `make` if it is not cached."""
        if key not in self.pictures:
            _make_room(self.pictures)
            self.pictures[key] = make()
        return self.pictures[key]


def _make_room(kept: dict[tuple[object, ...], Any]) -> None:
    """Drop the oldest entry if the cache is full."""
    while len(kept) >= KEPT:
        del kept[next(iter(kept))]
