"""The height field of a surface: roughness, pattern and large bumps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.devices.surfaces.fields import PIXELS, Field, narrow, self_affine
from palpate.devices.surfaces.patterns import patterned
from palpate.devices.surfaces.table import Surface
from palpate.protocols.keyed import Key


@dataclass(frozen=True)
class Relief:
    """Height over the mean in micrometres, of shape (pixels, pixels), and the pattern's share of the second colour.

    Row 0 is the far edge, column 0 the left one; the field repeats at its borders.
    """

    height_um: Field
    mix: Field


def relief(surface: Surface, *key: Key, pixels: int = PIXELS) -> Relief:
    """The field of a surface: self-affine roughness, pattern and bumps, mean 0; id and key decide it."""
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
