"""Scattered cells: for every point of the sample the cells whose seeds lie around it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from palpate.devices.surfaces.fields import PIXELS, SIZE_MM, Field, chance, shares
from palpate.protocols.keyed import Key


@dataclass(frozen=True)
class Cells:
    """Distances in pitches to the nearest seed and to the second one, and a chance number of the nearest cell."""

    first: Field
    second: Field
    lot: Field


def cells(pixels: int, pitch_mm: float, regularity: float, *key: Key) -> Cells:
    """Seeds on a square grid, each moved about its place: not at all (regularity 1) to anywhere in its cell (0)."""
    first = np.full((pixels, pixels), 9, np.float32)
    second, lot = first.copy(), np.zeros_like(first)
    for distance, drawn in neighbours(pixels, pitch_mm, regularity, *key):
        nearer = distance < first
        np.minimum(second, np.where(nearer, first, distance), out=second)
        np.copyto(lot, drawn, where=nearer)
        np.minimum(first, distance, out=first)
    return Cells(first, second, lot)


def grains(pixels: int, pitch_mm: float, regularity: float, *key: Key) -> tuple[Field, Field]:
    """Sharp grains of different height and breadth (0..1), and the chance number of the one on top."""
    height, lot = np.zeros((pixels, pixels), np.float32), np.zeros((pixels, pixels), np.float32)
    for distance, drawn, tall, broad in neighbours(pixels, pitch_mm, regularity, *key, of=_grain):
        one = tall * (1 - distance / broad)
        np.copyto(lot, drawn, where=one > height)
        np.maximum(height, one, out=height)
    return height, lot


def _grain(lot: Field) -> tuple[Field, ...]:
    return lot, np.float32(0.35) + np.float32(0.65) * lot, np.float32(0.5) + np.float32(0.6) * ((lot * 7) % 1)


def heaps(pixels: int, pitch_mm: float, regularity: float, *key: Key) -> tuple[Field, Field]:
    """Round heaps of different height (0..1) that run into each other, and the chance number of the one on top."""
    height, lot = np.zeros((pixels, pixels), np.float32), np.zeros((pixels, pixels), np.float32)
    for distance, drawn, tall in neighbours(pixels, pitch_mm, regularity, *key, of=_heap):
        one = tall * np.maximum(1 - (distance / np.float32(1.15)) ** 2, 0)
        np.copyto(lot, drawn, where=one > height)
        np.maximum(height, one, out=height)
    return height, lot


def _heap(lot: Field) -> tuple[Field, ...]:
    return lot, np.float32(0.6) + np.float32(0.4) * lot


def hollows(pixels: int, pitch_mm: float, regularity: float, *key: Key) -> Field:
    """Round hollows of different breadth that cut into each other: depth from 0 to 1."""
    depth = np.zeros((pixels, pixels), np.float32)
    for distance, breadth in neighbours(pixels, pitch_mm, regularity, *key, of=_hollow):
        np.maximum(depth, breadth * np.sqrt(np.maximum(1 - (distance / breadth) ** 2, 0)), out=depth)
    return depth / np.float32(0.8)


def _hollow(lot: Field) -> tuple[Field, ...]:
    return (np.float32(0.35) + np.float32(0.45) * lot,)


def _chance_alone(lot: Field) -> tuple[Field, ...]:
    return (lot,)


def neighbours(
    pixels: int, pitch_mm: float, regularity: float, *key: Key, of: Callable[[Field], tuple[Field, ...]] = _chance_alone
) -> Iterator[tuple[Field, ...]]:
    """For each of the nine cells around a point: its seed's distance in pitches, and what `of` makes of its chance."""
    count = max(1, round(SIZE_MM / pitch_mm))
    drawn = chance(3 * count * count, *key).astype(np.float32).reshape(3, count, count)
    moved = np.float32(1 - regularity) * (drawn[:2] - np.float32(0.5)) + np.float32(0.5)
    x, y = (np.float32(count) * each for each in shares(pixels))
    column, row = np.floor(x).astype(np.int32), np.floor(y).astype(np.int32)
    cell = (*moved, *of(drawn[2]))
    for up in (-1, 0, 1):
        for right in (-1, 0, 1):
            rows, columns = (row + up)[:, 0] % count, (column + right)[0] % count
            off_x, off_y, *made = (each.take(columns, axis=1).take(rows, axis=0) for each in cell)
            off_x += column + right - x
            off_y += row + up - y
            yield np.sqrt(off_x * off_x + off_y * off_y), *made


def strands(
    length_mm: float, width_mm: float, count: int, degrees: float, spread: float, *key: Key, pixels: int = PIXELS
) -> tuple[Field, Field]:
    """Rounded strands laid over each other: height (0..1), and the chance number of the one on top.

    They lie along `degrees`, turned at random by up to `spread` quarter turns to either side, and bend.
    """
    step_mm, drawn = SIZE_MM / pixels, chance(5 * count, *key).reshape(5, count)
    angles = np.radians(degrees) + np.pi * spread * (drawn[2] - 0.5)
    beyond = min(pixels, math.ceil((0.625 * length_mm + 0.5 * width_mm) / step_mm) + 1)
    height, lot = np.zeros((2, pixels + 2 * beyond, pixels + 2 * beyond), np.float32)
    for n in range(count):
        one = Strand(length_mm, width_mm, float(angles[n]), float(drawn[3, n]), float(drawn[4, n]))
        up, right = one.reach(step_mm)
        row, column = (beyond + int(each * pixels) for each in (drawn[1, n], drawn[0, n]))
        place = slice(row - up, row + up + 1), slice(column - right, column + right + 1)
        _lay(one.height(up, right, step_mm), one.tall, height[place], lot[place])
    return _folded(height, lot, beyond)


def _lay(shape: Field, drawn: Field | float, height: Field, lot: Field) -> None:
    """Lay a shape over what is there."""
    np.copyto(lot, np.float32(drawn), where=shape > height)
    np.maximum(height, shape, out=height)


def _folded(height: Field, lot: Field, beyond: int) -> tuple[Field, Field]:
    """What lies beyond the borders, laid over the other side, as the sample repeats."""
    for _axis in (0, 1):
        for outside, inside in (
            (slice(beyond), slice(-2 * beyond, -beyond)),
            (slice(-beyond, None), slice(beyond, 2 * beyond)),
        ):
            _lay(height[outside], lot[outside], height[inside], lot[inside])
        height, lot = height[beyond:-beyond].T, lot[beyond:-beyond].T
    return np.ascontiguousarray(height), np.ascontiguousarray(lot)


@dataclass(frozen=True)
class Strand:
    """Round across, arched along and bent; the tallest reaches 1, the lowest 0.5. Angle in radians, shares 0..1."""

    length_mm: float
    width_mm: float
    angle: float
    tall: float
    bent: float

    def reach(self, step_mm: float) -> tuple[int, int]:
        """Points that it takes up and to the right at most."""
        half, aside = self.length_mm / 2, self.width_mm / 2 + 0.125 * self.length_mm
        cosine, sine = abs(math.cos(self.angle)), abs(math.sin(self.angle))
        return math.ceil((half * sine + aside * cosine) / step_mm), math.ceil((half * cosine + aside * sine) / step_mm)

    def height(self, up: int, right: int, step_mm: float) -> Field:
        """Its height on points around its middle."""
        x = (np.arange(-right, right + 1) * step_mm).astype(np.float32)[np.newaxis, :]
        y = -(np.arange(-up, up + 1) * step_mm).astype(np.float32)[:, np.newaxis]
        cosine, sine = np.float32(math.cos(self.angle)), np.float32(math.sin(self.angle))
        along = (x * cosine + y * sine) * np.float32(2 / self.length_mm)
        square = along * along
        across = (y * cosine - x * sine) * np.float32(2 / self.width_mm)
        across += np.float32((self.bent - 0.5) * self.length_mm / self.width_mm * 0.5) * square
        hidden = np.maximum(1 - across * across, 0) * np.maximum(1 - square, 0)
        return np.asarray(np.float32(0.5 + 0.5 * self.tall) * np.sqrt(hidden), dtype=np.float32)
