"""Augmented versions of a picture for training: rotated, mirrored, with noise (thesis 3.4.2)."""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.random import PCG64, Generator, SeedSequence

from palpate.analysis.features.pictures import Gray

NOISE_SD = 0.01
"""SD of the noise relative to full scale: a camera's own at middle brightness. The thesis gives no value."""


def varied(values: Gray, chance: Generator, noise_sd: float = NOISE_SD) -> Gray:
    """Return a square rotated by a random angle, randomly mirrored along each axis, with Gaussian noise, within 0 to 1.

    Corners are filled by mirroring the picture at its edges, like Keras' RandomRotation (the thesis augments by
    TensorFlow); pixels are interpolated linearly.
    """
    from scipy.ndimage import rotate

    angle_deg = chance.uniform(-180.0, 180.0)
    turned = rotate(values, angle_deg, reshape=False, order=1, mode="reflect")
    for axis in (0, 1):
        if chance.random() < 0.5:
            turned = np.flip(turned, axis)
    noise = chance.standard_normal(values.shape, dtype=np.float32) * np.float32(noise_sd)
    return np.asarray(np.clip(turned + noise, 0.0, 1.0), dtype=np.float32)


def chance_of(picture_sha256: str, version: int, seed: int = 0) -> Generator:
    """Return the random generator for a version (1, 2, ...) of a picture, which depends on its content and the seed."""
    content = int.from_bytes(hashlib.sha256(picture_sha256.encode()).digest()[:8], "big")
    return Generator(PCG64(SeedSequence([seed, version, content])))
