"""Co-occurrence of gray levels of neighbouring pixels (thesis 3.4.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.features.pictures import Gray, PictureError

LEVELS = 16
"""Number of gray levels (thesis 3.4.2), hence 16 x 16 numbers."""
DISTANCES = (1,)
"""Distance of a pair in pixels: neighbours; the thesis does not say."""
ANGLES = (0.0, np.pi / 4, np.pi / 2, 3 * np.pi / 4)
"""Directions in radians whose matrices are averaged, since a texture has no orientation; the thesis does not say."""


def glcm(values: Gray) -> NDArray[np.float32]:
    """Return the shares (256,) of pairs of neighbours by their two levels, row by row; they sum to 1.

    `values` (rows, columns) are brightness from 0 to 1, which is quantised to sixteenths. The result is the mean over
    the four directions of scikit-image's `graycomatrix` (distance 1, symmetric, normed). Raises PictureError on fewer
    than 2 x 2 pixels and on numbers outside 0 to 1.
    """
    from skimage.feature import graycomatrix

    if values.ndim != 2 or min(values.shape) < 2:
        raise PictureError(f"{values.shape} pixels have no neighbours in every direction: 2 x 2 are the least")
    counted = graycomatrix(levels(values), DISTANCES, ANGLES, levels=LEVELS, symmetric=True, normed=True)
    return np.asarray(counted.mean(axis=(2, 3)).ravel(), dtype=np.float32)


def levels(values: Gray) -> NDArray[np.uint8]:
    """Return brightness from 0 to 1 as levels 0 to 15, each a sixteenth. Raises PictureError outside 0 to 1."""
    if not (np.isfinite(values).all() and values.min() >= 0 and values.max() <= 1):
        raise PictureError("brightness is not from 0 to 1 everywhere")
    return np.minimum(values * LEVELS, LEVELS - 1).astype(np.uint8)
