"""The paint of a surface: how much of each colour it sends back, where."""

from __future__ import annotations

import numpy as np

from palpate.devices.surfaces.fields import Field, lattice, self_affine
from palpate.devices.surfaces.relief import Relief
from palpate.devices.surfaces.table import Surface
from palpate.protocols.keyed import Key

RING_MM = 7.0
"""Distance of a board's growth rings, about."""


def albedo(surface: Surface, field: Relief, *key: Key) -> Field:
    """Linear reflectance, of shape (pixels, pixels, 3).

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
    """#rrggbb as linear reflectance: the sRGB curve undone."""
    coded = np.array([int(colour[n : n + 2], 16) / 255 for n in (1, 3, 5)])
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _share(surface: Surface, field: Relief, key: tuple[Key, ...]) -> Field:
    """Where the second colour lies, 0 to 1."""
    if surface.paint == "pattern":
        return field.mix
    if surface.paint == "height":
        low, high = np.percentile(field.height_um[::8, ::8], (5, 95))
        return np.clip((field.height_um - np.float32(low)) / np.float32(max(high - low, 1e-6)), 0, 1)
    if surface.paint == "grain":
        return _grain(surface, field, key)
    if surface.paint == "speckle":
        fine = self_affine(field.mix.shape[0], 0.4, 0.3, 0.2, 1.0, 0.0, *key, "speckle")
        return np.clip(fine * np.float32(0.35) + np.float32(0.3), 0, 1)
    return np.zeros_like(field.mix)


def _grain(surface: Surface, field: Relief, key: tuple[Key, ...]) -> Field:
    """A board's figure: dark late wood at the end of each ring, streaks along the grain, darker pores."""
    pixels = field.mix.shape[0]
    _, across = lattice(pixels, RING_MM, 1.0, surface.grain_deg, 0.0, 1)
    bent = self_affine(pixels, 18.0, 1.0, 2.0, 7.0, surface.grain_deg, *key, "figure")
    streaks = self_affine(pixels, 0.8, 0.3, 0.15, 25.0, surface.grain_deg, *key, "streaks")
    ring = (across + np.float32(1.1) * bent) % 1
    late = ring**3 * np.clip((1 - ring) * 8, 0, 1)
    dark = np.float32(0.15) + np.float32(0.75) * late + np.float32(0.16) * streaks + np.float32(0.5) * field.mix
    return np.asarray(np.clip(dark, 0, 1), dtype=np.float32)
