"""A photo of a surface from above, under one of ten lights (thesis 3.4.2).

Lambert's law and a Blinn-Phong gloss on the slopes of the same height field that the tool touches; shadows by looking
along the light's way, hollows darkened by how deep they lie in their surroundings; shot and read noise of a camera.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.devices.surfaces.albedo import albedo
from palpate.devices.surfaces.fields import SIZE_MM, Field, chance, shares
from palpate.devices.surfaces.relief import Relief
from palpate.devices.surfaces.shading import hollowness, shadow, slopes
from palpate.devices.surfaces.table import Surface, SurfaceDataError
from palpate.protocols.files import open_bytes
from palpate.protocols.keyed import Key, uniform

LIGHTS = 10
PENUMBRA_DEG = 4.0
"""Half the angle that the lamp takes up, as seen from the sample."""
LAMP_MM = 450.0
"""Distance of the lamp: nearer corners are brighter."""
FULL_WELL = 12_000.0
"""Electrons of a pixel at full scale: its shot noise."""
READ_NOISE = 0.0015
"""Of full scale."""
ELEVATIONS_DEG = (14.0, 44.0)
"""Lamps stand low, so that shading tells relief: a slope weighs by the cotangent of the lamp's height."""
GRAY = 0.25
"""The mean brightness (linear, share of full scale) that the camera exposes for by itself."""
LUMINANCE = (0.2126, 0.7152, 0.0722)
"""What linear red, green and blue weigh in the brightness that is metered (ITU-R BT.709)."""
Image = NDArray[np.uint8]


@dataclass(frozen=True)
class Light:
    """A lamp: azimuth from the x axis, height over the sample's plane, strength, and the share of ambient light."""

    azimuth_deg: float
    elevation_deg: float
    strength: float
    ambient: float

    @property
    def toward(self) -> tuple[float, float, float]:
        """Unit vector from the sample's middle to the lamp."""
        azimuth, elevation = math.radians(self.azimuth_deg), math.radians(self.elevation_deg)
        flat = math.cos(elevation)
        return flat * math.cos(azimuth), flat * math.sin(azimuth), math.sin(elevation)


def light(number: int, *key: Key) -> Light:
    """The light of a photo, 0 to 9: all around, from 14 to 44 degrees high; the key varies them a little.

    Raises SurfaceDataError on another number.
    """
    if not 0 <= number < LIGHTS:
        raise SurfaceDataError(f"light {number}: from 0 to {LIGHTS - 1} are expected")
    drawn = [uniform("light", number, what, *key) for what in ("azimuth", "elevation", "strength", "ambient")]
    low, high = ELEVATIONS_DEG
    elevation = low + (high - low) * ((number * 7) % LIGHTS + drawn[1]) / LIGHTS
    return Light(36 * number + 24 * (drawn[0] - 0.5), elevation, 0.8 + 0.4 * drawn[2], 0.2 + 0.25 * drawn[3])


def photograph(surface: Surface, field: Relief, lamp: Light, *key: Key) -> Image:
    """The photo, of shape (pixels, pixels, 3), sRGB; the key decides paint and noise, the paint without the light."""
    return next(photographs(surface, field, (lamp,), *key))


def photographs(surface: Surface, field: Relief, lamps: Iterable[Light], *key: Key) -> Iterator[Image]:
    """The photos under one light after the other; what no light changes is computed once (0.8 of a photo's time)."""
    still = _still(surface, field, *key)
    for lamp in lamps:
        lit = _lit(surface, still, lamp)
        glossy = np.float32(0.35 * surface.gloss) * _glint(surface, still, lamp)
        hue = np.float32(surface.gloss * _metal(surface))
        colour = still.painted * lit[..., np.newaxis] + glossy[..., np.newaxis] * (hue * still.painted + (1 - hue))
        yield _developed(colour, surface.id, lamp, *key)


@dataclass(frozen=True)
class _Still:
    """What no light changes: heights, slopes, how long a step up the slope is, how open the sky is, and the paint."""

    height_um: Field
    right: Field
    up: Field
    steep: Field
    open_sky: Field
    painted: Field


def _still(surface: Surface, field: Relief, *key: Key) -> _Still:
    right, up = slopes(field.height_um)
    open_sky = 1 - np.float32(0.75) * hollowness(field.height_um)
    painted = albedo(surface, field, *key)
    return _Still(field.height_um, right, up, np.sqrt(1 + right * right + up * up), open_sky, painted)


def save_photo(image: Image, path: Path) -> None:
    """Write a photo as an 8-bit PNG."""
    from PIL import Image as Pictures

    with open_bytes(path) as file:
        Pictures.fromarray(image).save(file, "PNG", compress_level=3)


def _metal(surface: Surface) -> float:
    """A metal's glint has the metal's colour."""
    return 1.0 if surface.category in ("aluminum", "mesh") else 0.0


def _lit(surface: Surface, still: _Still, lamp: Light) -> Field:
    """Light that falls on each point, as a share of what a white sheet under full light sends back."""
    x, y, z = (np.float32(each) for each in lamp.toward)
    facing = np.maximum(z - still.right * x - still.up * y, 0) / still.steep
    direct = facing * shadow(still.height_um, lamp.azimuth_deg, lamp.elevation_deg, PENUMBRA_DEG) / z
    near = _falloff(still.height_um.shape[0], lamp)
    soft = np.float32(min(0.5, 0.15 * math.log10(1 + 20 / surface.stiffness_N_mm)))
    # Soft, fibrous stuff scatters light inside: part of the shading is that of the open sky.
    spread = (1 - soft) * direct + soft * still.open_sky
    mixed = (1 - np.float32(lamp.ambient)) * spread + np.float32(lamp.ambient) * still.open_sky
    return np.asarray(np.float32(lamp.strength) * near * mixed, dtype=np.float32)


def _falloff(pixels: int, lamp: Light) -> Field:
    """Inverse square of the distance to the lamp, 1 in the middle."""
    x, y = ((each - np.float32(0.5)) * np.float32(SIZE_MM) for each in shares(pixels))
    to_x, to_y, to_z = (each * LAMP_MM for each in lamp.toward)
    square = (x - to_x) ** 2 + (y - to_y) ** 2 + to_z**2
    return np.asarray(LAMP_MM**2 / square, dtype=np.float32)


def _glint(surface: Surface, still: _Still, lamp: Light) -> Field:
    """Blinn-Phong, seen from straight above."""
    x, y, z = lamp.toward
    length = math.sqrt(x * x + y * y + (z + 1) ** 2)
    tilted = np.float32((z + 1) / length) - still.right * np.float32(x / length) - still.up * np.float32(y / length)
    along = tilted / still.steep
    # Normalised, so that a duller surface spreads the same light wider.
    bright = np.float32((surface.shine + 8) / 16) * np.maximum(along, 0) ** np.float32(surface.shine)
    return np.asarray(bright, dtype=np.float32)


def _developed(colour: Field, name: str, lamp: Light, *key: Key) -> Image:
    """Automatic exposure, noise, and the sRGB curve."""
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
