"""What a touch begins with: the sequence that the model made at 45 mm/s and 0.8 N, kept in its file (thesis 4.5.1)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.signals.arrays import Array
from palpate.signals.models.card import Texture
from palpate.signals.textures.normals import Normals
from palpate.signals.textures.range import Range

START_SPEED_MM_S, START_FORCE_N = 45.0, 0.8
"""What hands begin with (thesis 4.5.1; 45 m/s there is a misprint)."""


def start_of(texture: Texture, tensors: Mapping[str, NDArray[Any]], bounds: Range, seed: int) -> tuple[Array, str]:
    """Return the acceleration (window,) in m/s^2 to begin with, and why it is not the card's own ("" where it is).

    Where the card has none, or one that no texture of this level can have made, it is white noise of the training's
    level, which the model turns into its own signal within its window.
    """
    if texture.start is None:
        return _noise(texture, bounds, seed), "the card has no start sequence: begun with noise"
    start = np.asarray(tensors[texture.start], dtype=np.float64)
    if start.shape != (texture.window,):
        why = f"it has shape {start.shape}, and the window {texture.window} samples"
    elif not np.isfinite(start).all():
        why = "it holds a value that is not finite"
    elif np.abs(start).max() > bounds.peak or float(np.sqrt(np.mean(start**2))) > bounds.loud:
        why = f"it reaches {np.abs(start).max():.3g} m/s^2"
    else:
        return start, ""
    return _noise(texture, bounds, seed), f"the start sequence is not used, since {why}: begun with noise"


def _noise(texture: Texture, bounds: Range, seed: int) -> Array:
    normals = Normals(seed, 1)
    level = min(texture.rms_m_s2, bounds.loud / 2)
    return np.clip([level * normals.next() for _ in range(texture.window)], -bounds.peak, bounds.peak)
