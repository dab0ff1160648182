"""The height field of a surface: roughness, pattern and large bumps.

A pattern repeats over a surface, woven, moulded, cut or grown: height from 0 to 1, and the places of a second colour.
Scattered cells have seeds; every point of the sample belongs to the cells with seeds around it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from palpate.devices.surfaces.fields import PIXELS, SIZE_MM, Field, chance, felted, lattice, narrow, self_affine, shares
from palpate.devices.surfaces.table import Surface
from palpate.protocols.keyed import Key

WIRE = 0.36
"""Width of a mesh's wire, in pitches."""


@dataclass(frozen=True)
class Relief:
    """Height over the mean in micrometres, of shape (pixels, pixels), and the pattern's share of the second colour.

    Row 0 is the far edge, column 0 the left one; the field repeats at its borders.
    """

    height_um: Field
    mix: Field


def relief(surface: Surface, *key: Key, pixels: int = PIXELS) -> Relief:
    """Return the relief of a surface, mean 0: self-affine roughness, pattern and bumps, seeded by its id and key."""
    key = ("relief", surface.id, *key)
    shape = patterned(surface, pixels, *key)
    height = np.float32(surface.pattern_um) * shape.height
    if surface.rms_um > 0:
        height = height + np.float32(surface.rms_um) * self_affine(
            pixels, surface.correlation_mm, surface.hurst, surface.finest_mm, surface.stretch, surface.grain_deg,
            *key, "roughness",
        )  # fmt: skip
    if surface.bumps_um > 0:
        height = height + np.float32(surface.bumps_um) * narrow(pixels, surface.bumps_mm, *key, "bumps")
    return Relief((height - np.float32(height.mean(dtype=np.float64))).astype(np.float32), shape.mix)


@dataclass(frozen=True)
class Pattern:
    """Height, and the share of the second colour; both from 0 to 1, of shape (pixels, pixels)."""

    height: Field
    mix: Field


def patterned(surface: Surface, pixels: int, *key: Key) -> Pattern:
    """Return the surface's pattern; the key seeds its irregularity."""
    return MADE[surface.pattern](surface, pixels, ("pattern", *key))


def _none(_surface: Surface, pixels: int, _key: tuple[Key, ...]) -> Pattern:
    flat = np.zeros((pixels, pixels), np.float32)
    return Pattern(flat, flat)


def _lattice(surface: Surface, pixels: int, key: tuple[Key, ...], repeat: int = 1) -> tuple[Field, Field]:
    irregular = 0.3 * (1 - surface.regularity)
    return lattice(pixels, surface.pitch_mm, surface.aspect, surface.pattern_deg, irregular, repeat, *key)


def _ribs(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    along, _ = _lattice(surface, pixels, key)
    height = _raised(along)
    return Pattern(height, height)


def _raised(place: Field) -> Field:
    return np.asarray(0.5 + 0.5 * np.cos(np.float32(2 * np.pi) * place), dtype=np.float32)


def _knurl(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    along, across = _lattice(surface, pixels, key)
    height = np.maximum(_raised(along), _raised(across)) ** 2
    return Pattern(height, height)


def _studs(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Return domes, every second row shifted by half a pitch."""
    along, across = _lattice(surface, pixels, key, 2)
    shifted = along + np.float32(0.5) * (np.floor(across) % 2)
    off = np.hypot(shifted % 1 - np.float32(0.5), (across % 1 - np.float32(0.5)) * np.float32(surface.aspect))
    height = np.sqrt(np.clip(1 - (off / np.float32(0.4)) ** 2, 0, 1))
    return Pattern(height, height)


def _thread(place: Field) -> Field:
    """Return the height of threads in cross-section: round, one per period."""
    return np.asarray(np.sqrt(np.abs(np.sin(np.float32(np.pi) * place))), dtype=np.float32)


def _plain(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Return plain weave: each thread goes over one and under the next."""
    along, across = _lattice(surface, pixels, key, 2)
    half = np.float32(0.5)
    warp = _thread(along) * (half + half * np.cos(np.float32(np.pi) * (across - half + np.floor(along))))
    weft = _thread(across) * (half - half * np.cos(np.float32(np.pi) * (along - half + np.floor(across))))
    return Pattern(np.maximum(warp, weft), (weft > warp).astype(np.float32))


def _twill(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Return twill: three over, one under, shifted by one thread from neighbour to neighbour, like the diagonal of
    denim.
    """
    along, across = _lattice(surface, pixels, key, 4)
    half = np.float32(0.5)
    warp = _thread(along) * (1 - _under(across - half + np.floor(along)))
    weft = _thread(across) * _under(along - half + np.floor(across))
    return Pattern(np.maximum(warp, np.float32(0.85) * weft), (weft > warp).astype(np.float32))


def _under(place: Field) -> Field:
    """Return 1 where a warp thread dives under, once in four."""
    off = (place + 2) % 4 - 2
    return np.where(np.abs(off) < 1, np.cos(np.float32(np.pi / 2) * off) ** 2, np.float32(0)).astype(np.float32)


def _mesh(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Return crossing wires with holes between, which show the second colour."""
    along, across = _lattice(surface, pixels, key, 2)
    first = _wire(along) * _bent(across + np.floor(along))
    second = _wire(across) * _bent(along + np.floor(across) + 1)
    height = np.maximum(first, second)
    return Pattern(height, (height <= 0).astype(np.float32))


def _wire(place: Field) -> Field:
    off = (place % 1 - np.float32(0.5)) / np.float32(WIRE / 2)
    return np.asarray(np.sqrt(np.clip(1 - off * off, 0, 1)), dtype=np.float32)


def _bent(place: Field) -> Field:
    wave = np.cos(np.float32(np.pi) * (place - np.float32(0.5)))
    return np.asarray(np.float32(0.8) + np.float32(0.2) * wave, dtype=np.float32)


def _grit(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    return Pattern(*grains(pixels, surface.pitch_mm, surface.regularity, *key))


def _foam(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Return foam: bubbles cut open, large ones with small ones in their walls."""
    large = hollows(pixels, surface.pitch_mm, surface.regularity, *key)
    small = hollows(pixels, 0.4 * surface.pitch_mm, surface.regularity, *key, "small")
    depth = np.maximum(large, np.float32(0.45) * small)
    return Pattern(1 - depth, depth)


def _leather(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Return smooth islands between creases."""
    nearest = cells(pixels, surface.pitch_mm, surface.regularity, *key)
    island = np.clip((nearest.second - nearest.first) / np.float32(0.4), 0, 1)
    height = island * island * (3 - 2 * island)
    return Pattern(height, 1 - height)


def _laid(
    surface: Surface, pixels: int, key: tuple[Key, ...], width: float, length: float, cover: float, spread: float
) -> Pattern:
    width_mm, length_mm = surface.pitch_mm * width, surface.pitch_mm * length
    count = round(cover * SIZE_MM**2 / (width_mm * length_mm))
    height, lot = strands(length_mm, width_mm, count, surface.pattern_deg, spread, *key, pixels=pixels)
    return Pattern(height, lot)


def _loops(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Return loops of terry: short, thick, in all directions."""
    return _laid(surface, pixels, key, 0.45, 1.3, 1.6, 1 - 0.8 * surface.regularity)


def _pile(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Return tufts of carpet: soft heaps of yarn that merge, and their fibres in all directions."""
    heap, lot = heaps(pixels, surface.pitch_mm, surface.regularity, *key)
    fibres, which = felted(pixels, 0.07 * surface.pitch_mm, 0.7 * surface.pitch_mm, 7, *key, "yarn")
    height = np.float32(0.5) * heap + np.float32(0.5) * fibres * (np.float32(0.4) + heap)
    return Pattern(np.clip(height, 0, 1), np.float32(0.3) * lot + np.float32(0.7) * which)


def _blades(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Return blades of artificial grass, lying over each other."""
    return _laid(surface, pixels, key, 0.35, 4.0, 3.0, 1.0)


def _fibres(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Return fibres pressed into a sheet."""
    return Pattern(*felted(pixels, 0.08 * surface.pitch_mm, 1.6 * surface.pitch_mm, 7, *key))


def _pores(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Return vessels of wood, cut open along the grain: short furrows."""
    furrow = _laid(surface, pixels, key, 0.14, 2.5, 0.22, 0.06 * (1 - surface.regularity))
    return Pattern(1 - furrow.height, furrow.height)


MADE: Mapping[str, Callable[[Surface, int, tuple[Key, ...]], Pattern]] = {
    "none": _none, "ribs": _ribs, "plain": _plain, "twill": _twill, "mesh": _mesh, "studs": _studs, "knurl": _knurl,
    "grit": _grit, "foam": _foam, "leather": _leather, "loops": _loops, "pile": _pile, "blades": _blades,
    "fibres": _fibres, "pores": _pores,
}  # fmt: skip


@dataclass(frozen=True)
class Cells:
    """Distances in pitches to the nearest and the second nearest seed, and a random number of the nearest cell."""

    first: Field
    second: Field
    lot: Field


def cells(pixels: int, pitch_mm: float, regularity: float, *key: Key) -> Cells:
    """Return cells around seeds on a square grid, each moved within its cell; regularity 1 moves none."""
    first = np.full((pixels, pixels), 9, np.float32)
    second, lot = first.copy(), np.zeros_like(first)
    for distance, drawn in neighbours(pixels, pitch_mm, regularity, *key):
        nearer = distance < first
        np.minimum(second, np.where(nearer, first, distance), out=second)
        np.copyto(lot, drawn, where=nearer)
        np.minimum(first, distance, out=first)
    return Cells(first, second, lot)


def grains(pixels: int, pitch_mm: float, regularity: float, *key: Key) -> tuple[Field, Field]:
    """Return sharp grains of varying height and width (0..1), and the random number of the one on top."""
    height, lot = np.zeros((pixels, pixels), np.float32), np.zeros((pixels, pixels), np.float32)
    for distance, drawn, tall, broad in neighbours(pixels, pitch_mm, regularity, *key, of=_grain):
        one = tall * (1 - distance / broad)
        np.copyto(lot, drawn, where=one > height)
        np.maximum(height, one, out=height)
    return height, lot


def _grain(lot: Field) -> tuple[Field, ...]:
    return lot, np.float32(0.35) + np.float32(0.65) * lot, np.float32(0.5) + np.float32(0.6) * ((lot * 7) % 1)


def heaps(pixels: int, pitch_mm: float, regularity: float, *key: Key) -> tuple[Field, Field]:
    """Return round heaps of varying height (0..1) that merge, and the random number of the one on top."""
    height, lot = np.zeros((pixels, pixels), np.float32), np.zeros((pixels, pixels), np.float32)
    for distance, drawn, tall in neighbours(pixels, pitch_mm, regularity, *key, of=_heap):
        one = tall * np.maximum(1 - (distance / np.float32(1.15)) ** 2, 0)
        np.copyto(lot, drawn, where=one > height)
        np.maximum(height, one, out=height)
    return height, lot


def _heap(lot: Field) -> tuple[Field, ...]:
    return lot, np.float32(0.6) + np.float32(0.4) * lot


def hollows(pixels: int, pitch_mm: float, regularity: float, *key: Key) -> Field:
    """Return the depth, from 0 to 1, of round hollows of varying width that cut into each other."""
    depth = np.zeros((pixels, pixels), np.float32)
    for distance, breadth in neighbours(
        pixels, pitch_mm, regularity, *key, of=lambda lot: (np.float32(0.35) + np.float32(0.45) * lot,)
    ):
        np.maximum(depth, breadth * np.sqrt(np.maximum(1 - (distance / breadth) ** 2, 0)), out=depth)
    return depth / np.float32(0.8)


def neighbours(
    pixels: int,
    pitch_mm: float,
    regularity: float,
    *key: Key,
    of: Callable[[Field], tuple[Field, ...]] = lambda lot: (lot,),
) -> Iterator[tuple[Field, ...]]:
    """Yield each neighbouring cell's seed distance in pitches, and `of` applied to its random number (nine cells)."""
    count = max(1, round(SIZE_MM / pitch_mm))
    drawn = chance(3 * count * count, *key).astype(np.float32).reshape(3, count, count)
    moved = np.float32(1 - regularity) * (drawn[:2] - np.float32(0.5)) + np.float32(0.5)
    x, y = (np.float32(count) * share for share in shares(pixels))
    column, row = np.floor(x).astype(np.int32), np.floor(y).astype(np.int32)
    cell = (*moved, *of(drawn[2]))
    for up in (-1, 0, 1):
        for right in (-1, 0, 1):
            rows, columns = (row + up)[:, 0] % count, (column + right)[0] % count
            off_x, off_y, *made = (part.take(columns, axis=1).take(rows, axis=0) for part in cell)
            off_x += column + right - x
            off_y += row + up - y
            yield np.sqrt(off_x * off_x + off_y * off_y), *made


def strands(
    length_mm: float, width_mm: float, count: int, degrees: float, spread: float, *key: Key, pixels: int = PIXELS
) -> tuple[Field, Field]:
    """Return rounded strands laid over each other: height (0..1), and the random number of the one on top.

    They lie along `degrees`, turned at random by up to `spread` quarter turns to either side, and bend.
    """
    step_mm, drawn = SIZE_MM / pixels, chance(5 * count, *key).reshape(5, count)
    angles = np.radians(degrees) + np.pi * spread * (drawn[2] - 0.5)
    beyond = min(pixels, math.ceil((0.625 * length_mm + 0.5 * width_mm) / step_mm) + 1)
    height, lot = np.zeros((2, pixels + 2 * beyond, pixels + 2 * beyond), np.float32)
    for n in range(count):
        one = Strand(length_mm, width_mm, float(angles[n]), float(drawn[3, n]), float(drawn[4, n]))
        up, right = one.reach(step_mm)
        row, column = (beyond + int(share * pixels) for share in (drawn[1, n], drawn[0, n]))
        place = slice(row - up, row + up + 1), slice(column - right, column + right + 1)
        _lay(one.height(up, right, step_mm), one.tall, height[place], lot[place])
    return _folded(height, lot, beyond)


def _lay(shape: Field, drawn: Field | float, height: Field, lot: Field) -> None:
    """Lay a shape over the shapes so far."""
    np.copyto(lot, np.float32(drawn), where=shape > height)
    np.maximum(height, shape, out=height)


def _folded(height: Field, lot: Field, beyond: int) -> tuple[Field, Field]:
    """Fold the strips beyond the borders onto the opposite side, because the sample repeats."""
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
    """A strand, round across, arched along and bent; the tallest reaches 1, the lowest 0.5. Angle in radians, shares
    0..1.
    """

    length_mm: float
    width_mm: float
    angle: float
    tall: float
    bent: float

    def reach(self, step_mm: float) -> tuple[int, int]:
        """Return how many points the strand covers upward and to the right at most."""
        half, aside = self.length_mm / 2, self.width_mm / 2 + 0.125 * self.length_mm
        cosine, sine = abs(math.cos(self.angle)), abs(math.sin(self.angle))
        return math.ceil((half * sine + aside * cosine) / step_mm), math.ceil((half * cosine + aside * sine) / step_mm)

    def height(self, up: int, right: int, step_mm: float) -> Field:
        """Return the strand's height on points around its middle."""
        x = (np.arange(-right, right + 1) * step_mm).astype(np.float32)[np.newaxis, :]
        y = -(np.arange(-up, up + 1) * step_mm).astype(np.float32)[:, np.newaxis]
        cosine, sine = np.float32(math.cos(self.angle)), np.float32(math.sin(self.angle))
        along = (x * cosine + y * sine) * np.float32(2 / self.length_mm)
        square = along * along
        across = (y * cosine - x * sine) * np.float32(2 / self.width_mm)
        across += np.float32((self.bent - 0.5) * self.length_mm / self.width_mm * 0.5) * square
        hidden = np.maximum(1 - across * across, 0) * np.maximum(1 - square, 0)
        return np.asarray(np.float32(0.5 + 0.5 * self.tall) * np.sqrt(hidden), dtype=np.float32)
