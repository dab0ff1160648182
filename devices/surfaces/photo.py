"""Photos of a surface from above, under one of ten lights (thesis 3.4.2).

Lambert's law and a Blinn-Phong gloss on the slopes of the same height field that the tool touches; shadows by searching
along the light's direction, hollows darkened by their depth in their surroundings; shot and read noise of a camera.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from palpate.devices.surfaces.fields import SIZE_MM, Field, chance, lattice, self_affine, shares
from palpate.devices.surfaces.relief import Relief
from palpate.devices.surfaces.table import Surface, SurfaceDataError
from palpate.protocols.files import open_bytes
from palpate.protocols.keyed import Key, uniform

LIGHTS = 10
PENUMBRA_DEG = 4.0
"""Half the angular size of the lamp as seen from the sample."""
LAMP_MM = 450.0
"""Distance of the lamp: nearer corners are brighter."""
FULL_WELL = 12_000.0
"""Electrons of a pixel at full scale: its shot noise."""
READ_NOISE = 0.0015
"""Read noise as a share of full scale."""
ELEVATIONS_DEG = (14.0, 44.0)
"""Lamps are low, so that shading shows the relief: a slope counts by the cotangent of the lamp's elevation."""
GRAY = 0.25
"""The mean brightness (linear, share of full scale) to which the camera exposes automatically."""
LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Weights of linear red, green and blue in the metered brightness (ITU-R BT.709)."""
Image = NDArray[np.uint8]
RING_MM = 7.0
"""Approximate distance of a board's growth rings."""
REACH_MM = 6.0
"""Greatest length of a computed shadow."""
HOLLOWS_MM = (0.25, 0.8, 2.5)
"""Sizes of the surroundings in which the depth of a point is computed."""


@dataclass(frozen=True)
class Light:
    """A lamp: azimuth from the x axis, elevation over the sample's plane, strength, and the share of ambient light."""

    azimuth_deg: float
    elevation_deg: float
    strength: float
    ambient: float

    @property
    def toward(self) -> tuple[float, float, float]:
        """Return the unit vector from the sample's middle to the lamp."""
        azimuth, elevation = math.radians(self.azimuth_deg), math.radians(self.elevation_deg)
        flat = math.cos(elevation)
        return flat * math.cos(azimuth), flat * math.sin(azimuth), math.sin(elevation)


def light(number: int, *key: Key) -> Light:
    """Return the light of photo 0 to 9: azimuths all around, 14 to 44 degrees high, varied a little by the key.

    Raises SurfaceDataError for another number.
    """
    if not 0 <= number < LIGHTS:
        raise SurfaceDataError(f"light {number}: from 0 to {LIGHTS - 1} are expected")
    drawn = [uniform("light", number, what, *key) for what in ("azimuth", "elevation", "strength", "ambient")]
    low, high = ELEVATIONS_DEG
    elevation = low + (high - low) * ((number * 7) % LIGHTS + drawn[1]) / LIGHTS
    return Light(36 * number + 24 * (drawn[0] - 0.5), elevation, 0.8 + 0.4 * drawn[2], 0.2 + 0.25 * drawn[3])


def photograph(surface: Surface, field: Relief, lamp: Light, *key: Key) -> Image:
    """Return the photo, of shape (pixels, pixels, 3), in sRGB.

    The key seeds paint and noise; the paint does not depend on the light.
    """
    return next(photographs(surface, field, (lamp,), *key))


def photographs(surface: Surface, field: Relief, lamps: Iterable[Light], *key: Key) -> Iterator[Image]:
    """Yield the photo under each light; parts independent of the light (0.8 of a photo's time) are computed once."""
    right, up = slopes(field.height_um)
    open_sky = 1 - np.float32(0.75) * hollowness(field.height_um)
    painted = albedo(surface, field, *key)
    still = _Still(field.height_um, right, up, np.sqrt(1 + right * right + up * up), open_sky, painted)
    for lamp in lamps:
        # Light that falls on each point, as a share of what a white sheet under full light sends back.
        x, y, z = (np.float32(part) for part in lamp.toward)
        facing = np.maximum(z - still.right * x - still.up * y, 0) / still.steep
        direct = facing * shadow(still.height_um, lamp.azimuth_deg, lamp.elevation_deg, PENUMBRA_DEG) / z
        near = _falloff(still.height_um.shape[0], lamp)
        soft = np.float32(min(0.5, 0.15 * math.log10(1 + 20 / surface.stiffness_N_mm)))
        # Soft, fibrous stuff scatters light inside: part of the shading is that of the open sky.
        spread = (1 - soft) * direct + soft * still.open_sky
        mixed = (1 - np.float32(lamp.ambient)) * spread + np.float32(lamp.ambient) * still.open_sky
        lit = np.asarray(np.float32(lamp.strength) * near * mixed, dtype=np.float32)
        glossy = np.float32(0.35 * surface.gloss) * _glint(surface, still, lamp)
        # A metal's glint has the metal's colour.
        hue = np.float32(surface.gloss if surface.category in ("aluminum", "mesh") else 0.0)
        colour = still.painted * lit[..., np.newaxis] + glossy[..., np.newaxis] * (hue * still.painted + (1 - hue))
        yield _developed(colour, surface.id, lamp, *key)


@dataclass(frozen=True)
class _Still:
    """The parts of a photo independent of the light: heights, slopes, a step's length up the slope, open sky, paint."""

    height_um: Field
    right: Field
    up: Field
    steep: Field
    open_sky: Field
    painted: Field


def save_photo(image: Image, path: Path) -> None:
    """Write a photo as an 8-bit PNG."""
    from PIL import Image as Pictures

    with open_bytes(path) as file:
        Pictures.fromarray(image).save(file, "PNG", compress_level=3)


def _falloff(pixels: int, lamp: Light) -> Field:
    """Return the inverse square of the distance to the lamp, 1 in the middle."""
    x, y = ((share - np.float32(0.5)) * np.float32(SIZE_MM) for share in shares(pixels))
    to_x, to_y, to_z = (part * LAMP_MM for part in lamp.toward)
    square = (x - to_x) ** 2 + (y - to_y) ** 2 + to_z**2
    return np.asarray(LAMP_MM**2 / square, dtype=np.float32)


def _glint(surface: Surface, still: _Still, lamp: Light) -> Field:
    """Return the Blinn-Phong highlights, seen from straight above."""
    x, y, z = lamp.toward
    length = math.sqrt(x * x + y * y + (z + 1) ** 2)
    tilted = np.float32((z + 1) / length) - still.right * np.float32(x / length) - still.up * np.float32(y / length)
    along = tilted / still.steep
    # Normalised, so that a duller surface spreads the same light wider.
    bright = np.float32((surface.shine + 8) / 16) * np.maximum(along, 0) ** np.float32(surface.shine)
    return np.asarray(bright, dtype=np.float32)


def _developed(colour: Field, name: str, lamp: Light, *key: Key) -> Image:
    """Apply automatic exposure, noise and the sRGB curve."""
    bright = float(colour.mean(axis=(0, 1), dtype=np.float64) @ LUMINANCE)
    exposed = np.float32(GRAY / max(bright, 1e-6)) * colour
    # The sum of three uniform numbers is bell enough for a camera's noise.
    count = exposed.size
    drawn = chance(count, "camera", name, f"{lamp.azimuth_deg:.6f}", *key).astype(np.float32)
    bell = (drawn + np.roll(drawn, 7919) + np.roll(drawn, 104729) - np.float32(1.5)) * np.float32(2)
    spread = np.sqrt(np.maximum(exposed, 0) / np.float32(FULL_WELL) + np.float32(READ_NOISE**2))
    linear = np.clip(exposed + spread * bell.reshape(exposed.shape), 0, 1)
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-6) ** (1 / 2.4) - 0.055)
    return np.asarray(np.round(255 * curve), dtype=np.uint8)


def albedo(surface: Surface, field: Relief, *key: Key) -> Field:
    """Return the linear reflectance, of shape (pixels, pixels, 3).

    `pattern` and `height` follow the relief (threads, wires, grains); `grain` and `speckle` and the mottle do not.
    """
    pixels = field.mix.shape[0]
    key = ("paint", surface.id, *key)
    share = _share(surface, field, key)[..., np.newaxis]
    first, second = linear(surface.colour), linear(surface.colour2)
    painted = (1 - share) * first + share * second
    if surface.mottle > 0:
        cloud = self_affine(pixels, 2.0, 0.3, 0.15, surface.stretch, surface.grain_deg, *key, "mottle")
        painted = painted * np.exp(np.float32(0.35 * surface.mottle) * cloud)[..., np.newaxis]
    return np.asarray(np.clip(painted, 0, 1), dtype=np.float32)


def linear(colour: str) -> Field:
    """Return #rrggbb as linear reflectance, with the sRGB curve undone."""
    coded = np.array([int(colour[n : n + 2], 16) / 255 for n in (1, 3, 5)])
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _share(surface: Surface, field: Relief, key: tuple[Key, ...]) -> Field:
    """Return the share of the second colour at each point, 0 to 1."""
    if surface.paint == "pattern":
        return field.mix
    if surface.paint == "height":
        low, high = np.percentile(field.height_um[::8, ::8], (5, 95))
        return np.clip((field.height_um - np.float32(low)) / np.float32(max(high - low, 1e-6)), 0, 1)
    if surface.paint == "grain":
        # A board's figure: dark late wood at the end of each ring, streaks along the grain, darker pores.
        pixels = field.mix.shape[0]
        _, across = lattice(pixels, RING_MM, 1.0, surface.grain_deg, 0.0, 1)
        bent = self_affine(pixels, 18.0, 1.0, 2.0, 7.0, surface.grain_deg, *key, "figure")
        streaks = self_affine(pixels, 0.8, 0.3, 0.15, 25.0, surface.grain_deg, *key, "streaks")
        ring = (across + np.float32(1.1) * bent) % 1
        late = ring**3 * np.clip((1 - ring) * 8, 0, 1)
        dark = np.float32(0.15) + np.float32(0.75) * late + np.float32(0.16) * streaks + np.float32(0.5) * field.mix
        return np.asarray(np.clip(dark, 0, 1), dtype=np.float32)
    if surface.paint == "speckle":
        fine = self_affine(field.mix.shape[0], 0.4, 0.3, 0.2, 1.0, 0.0, *key, "speckle")
        return np.clip(fine * np.float32(0.35) + np.float32(0.3), 0, 1)
    return np.zeros_like(field.mix)


def slopes(height_um: Field) -> tuple[Field, Field]:
    """Return the rise per length to the right and upward, by central differences."""
    step_um = np.float32(2000 * SIZE_MM / height_um.shape[0])
    right = (np.roll(height_um, -1, 1) - np.roll(height_um, 1, 1)) / step_um
    up = (np.roll(height_um, 1, 0) - np.roll(height_um, -1, 0)) / step_um
    return right, up


def shadow(height_um: Field, azimuth_deg: float, elevation_deg: float, penumbra_deg: float) -> Field:
    """Return the share of the lamp that each point sees: 1 in full light, 0 in full shadow.

    It compares the steepest rise towards the lamp, on steps that grow by a quarter, with the lamp's elevation. Between
    steps nothing is checked: an object thinner than a step may cast no shadow beyond five times its width.
    """
    step_mm = SIZE_MM / height_um.shape[0]
    steepest = np.full_like(height_um, -np.inf)
    for reach in _steps(step_mm):
        rows = -round(reach * math.sin(math.radians(azimuth_deg)))
        columns = round(reach * math.cos(math.radians(azimuth_deg)))
        away_um = 1000 * step_mm * max(math.hypot(rows, columns), 1e-9)
        ahead = np.roll(height_um, (-rows, -columns), (0, 1))
        np.maximum(steepest, (ahead - height_um) / np.float32(away_um), out=steepest)
    low, high = (math.radians(elevation_deg + side * penumbra_deg) for side in (-1, 1))
    hidden = (np.arctan(steepest) - np.float32(low)) / np.float32(high - low)
    return np.asarray(1 - np.clip(hidden, 0, 1), dtype=np.float32)


def _steps(step_mm: float) -> list[float]:
    """Return distances in points: 1, 2, 3, ... then growing by a quarter."""
    reaches, reach = [], 1.0
    while reach * step_mm <= REACH_MM:
        reaches.append(reach)
        reach = max(reach + 1, reach * 1.25)
    return reaches


def hollowness(height_um: Field) -> Field:
    """Return how deep each point lies in a hollow, 0 (open) to 1: its depth below its surroundings of three sizes."""
    deep = np.zeros_like(height_um)
    for size_mm in HOLLOWS_MM:
        around = gaussian_filter(height_um, size_mm * height_um.shape[0] / SIZE_MM / 2, mode="wrap", truncate=3)
        deep += np.maximum(around - height_um, 0) / np.float32(1000 * size_mm / 2)
    return np.asarray(1 - 1 / (1 + deep), dtype=np.float32)
