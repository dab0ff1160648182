"""What repeats over a surface, woven, moulded, cut or grown: height from 0 to 1, and where a second colour lies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from palpate.devices.surfaces.cells import cells, grains, heaps, hollows, strands
from palpate.devices.surfaces.fields import SIZE_MM, Field, felted, lattice
from palpate.devices.surfaces.table import Surface
from palpate.protocols.keyed import Key

WIRE = 0.36
"""Width of a mesh's wire, in pitches."""


@dataclass(frozen=True)
class Pattern:
    """Height, and the share of the second colour; both from 0 to 1, of shape (pixels, pixels)."""

    height: Field
    mix: Field


def patterned(surface: Surface, pixels: int, *key: Key) -> Pattern:
    """The surface's pattern; the key decides where it is irregular."""
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
    """Domes, every second row shifted by half a pitch."""
    along, across = _lattice(surface, pixels, key, 2)
    shifted = along + np.float32(0.5) * (np.floor(across) % 2)
    off = np.hypot(shifted % 1 - np.float32(0.5), (across % 1 - np.float32(0.5)) * np.float32(surface.aspect))
    height = np.sqrt(np.clip(1 - (off / np.float32(0.4)) ** 2, 0, 1))
    return Pattern(height, height)


def _thread(place: Field) -> Field:
    """A thread seen across: round, one a period."""
    return np.asarray(np.sqrt(np.abs(np.sin(np.float32(np.pi) * place))), dtype=np.float32)


def _plain(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Plain weave: each thread goes over one and under the next."""
    along, across = _lattice(surface, pixels, key, 2)
    half = np.float32(0.5)
    warp = _thread(along) * (half + half * np.cos(np.float32(np.pi) * (across - half + np.floor(along))))
    weft = _thread(across) * (half - half * np.cos(np.float32(np.pi) * (along - half + np.floor(across))))
    return Pattern(np.maximum(warp, weft), (weft > warp).astype(np.float32))


def _twill(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Three over, one under, each thread one further than its neighbour: the diagonal of denim."""
    along, across = _lattice(surface, pixels, key, 4)
    half = np.float32(0.5)
    warp = _thread(along) * (1 - _under(across - half + np.floor(along)))
    weft = _thread(across) * _under(along - half + np.floor(across))
    return Pattern(np.maximum(warp, np.float32(0.85) * weft), (weft > warp).astype(np.float32))


def _under(place: Field) -> Field:
    """1 where a warp thread dives under, once in four."""
    off = (place + 2) % 4 - 2
    return np.where(np.abs(off) < 1, np.cos(np.float32(np.pi / 2) * off) ** 2, np.float32(0)).astype(np.float32)


def _mesh(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Crossing wires with holes between; the second colour is what is seen through the holes."""
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
    """Bubbles cut open, large ones with small ones in their walls."""
    large = hollows(pixels, surface.pitch_mm, surface.regularity, *key)
    small = hollows(pixels, 0.4 * surface.pitch_mm, surface.regularity, *key, "small")
    depth = np.maximum(large, np.float32(0.45) * small)
    return Pattern(1 - depth, depth)


def _leather(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Smooth islands between creases."""
    found = cells(pixels, surface.pitch_mm, surface.regularity, *key)
    island = np.clip((found.second - found.first) / np.float32(0.4), 0, 1)
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
    """Loops of terry: short, thick, in every direction."""
    return _laid(surface, pixels, key, 0.45, 1.3, 1.6, 1 - 0.8 * surface.regularity)


def _pile(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Tufts of carpet: soft heaps of yarn that run into each other, and their fibres in every direction."""
    heap, lot = heaps(pixels, surface.pitch_mm, surface.regularity, *key)
    fibres, which = felted(pixels, 0.07 * surface.pitch_mm, 0.7 * surface.pitch_mm, 7, *key, "yarn")
    height = np.float32(0.5) * heap + np.float32(0.5) * fibres * (np.float32(0.4) + heap)
    return Pattern(np.clip(height, 0, 1), np.float32(0.3) * lot + np.float32(0.7) * which)


def _blades(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Blades of artificial grass, lying over each other."""
    return _laid(surface, pixels, key, 0.35, 4.0, 3.0, 1.0)


def _fibres(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Fibres pressed into a sheet."""
    return Pattern(*felted(pixels, 0.08 * surface.pitch_mm, 1.6 * surface.pitch_mm, 7, *key))


def _pores(surface: Surface, pixels: int, key: tuple[Key, ...]) -> Pattern:
    """Vessels of wood, cut open along the grain: short furrows."""
    furrow = _laid(surface, pixels, key, 0.14, 2.5, 0.22, 0.06 * (1 - surface.regularity))
    return Pattern(1 - furrow.height, furrow.height)


MADE: Mapping[str, Callable[[Surface, int, tuple[Key, ...]], Pattern]] = {
    "none": _none, "ribs": _ribs, "plain": _plain, "twill": _twill, "mesh": _mesh, "studs": _studs, "knurl": _knurl,
    "grit": _grit, "foam": _foam, "leather": _leather, "loops": _loops, "pile": _pile, "blades": _blades,
    "fibres": _fibres, "pores": _pores,
}  # fmt: skip
