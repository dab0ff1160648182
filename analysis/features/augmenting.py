"""Further versions of a picture for training: turned, mirrored, with noise (thesis 3.4.2)."""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.random import PCG64, Generator, SeedSequence

from palpate.analysis.features.pictures import Gray

NOISE_SD = 0.01
"""Of full scale: a camera's own noise at middle brightness. The thesis says Gaussian, not how much."""


def varied(values: Gray, chance: Generator, noise_sd: float = NOISE_SD) -> Gray:
    """Return a square turned by any angle, mirrored or not along each axis, with Gaussian noise; brightness stays in 0
    to 1.

    What a turn brings in at the corners is the picture mirrored at its edges, as Keras' RandomRotation fills them (the
    thesis augments by TensorFlow); pixels between others are interpolated linearly.
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
    """Return the random numbers for a version (1, 2, ...) of a picture: its content and the seed decide, no order."""
    content = int.from_bytes(hashlib.sha256(picture_sha256.encode()).digest()[:8], "big")
    return Generator(PCG64(SeedSequence([seed, version, content])))
