"""Play a model that predicts the next sample from the last ones, on its own output (thesis 4.5.1).

A touch begins with the sequence that the model produced at 45 mm/s and 0.8 N, stored in its file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.signals.arrays import Array
from palpate.signals.models.card import Texture
from palpate.signals.models.errors import ModelInputError
from palpate.signals.models.fastest import Runs
from palpate.signals.textures.normals import Normals
from palpate.signals.textures.range import Range

START_SPEED_MM_S, START_FORCE_N = 45.0, 0.8
"""Speed and force at the beginning of a touch (thesis 4.5.1; 45 m/s there is a misprint)."""


def start_of(texture: Texture, tensors: Mapping[str, NDArray[Any]], bounds: Range, seed: int) -> tuple[Array, str]:
    """Return the acceleration (window,) in m/s^2 to begin with, and why it is not the card's own ("" if it is).

    If the card has none, or one that no texture of this level can have produced, it is white noise of the training's
    level, which the model turns into its own signal within its window.
    """
    if texture.start is None:
        return _noise(texture, bounds, seed), "the card has no start sequence: started with noise"
    start = np.asarray(tensors[texture.start], dtype=np.float64)
    if start.shape != (texture.window,):
        why = f"it has shape {start.shape}, and the window {texture.window} samples"
    elif not np.isfinite(start).all():
        why = "it holds a value that is not finite"
    elif np.abs(start).max() > bounds.peak or float(np.sqrt(np.mean(start**2))) > bounds.loud:
        why = f"it reaches {np.abs(start).max():.3g} m/s^2"
    else:
        return start, ""
    return _noise(texture, bounds, seed), f"the start sequence is not used, since {why}: started with noise"


def _noise(texture: Texture, bounds: Range, seed: int) -> Array:
    normals = Normals(seed, 1)
    level = min(texture.rms_m_s2, bounds.loud / 2)
    return np.clip([level * normals.next() for _ in range(texture.window)], -bounds.peak, bounds.peak)


LEAST_LOG_SD = -30.0


class Next:
    """A player that predicts from a window of acceleration, speed and force of the last `window` steps, oldest first.

    At a touch the acceleration is the start sequence, and speed and force are as if the hand had always moved as at
    that step. A model with a conditional scale is sampled if there are `normals`, else its mean is used. Samples that
    are fed back are limited to the peak.
    """

    __slots__ = ("_cold", "_most_log_sd", "_normals", "_peak", "_run", "_size", "_start", "window")

    def __init__(self, runs: Runs, start: Array, peak: float, normals: Normals | None) -> None:
        """Take the model; `start` (window,) is in m/s^2."""
        self._run, self._start, self._peak = runs.run, start, peak
        self._normals = normals if runs.card.gives.size == 2 else None
        self._most_log_sd = math.log(peak)
        self._size = len(start)
        self.window = np.zeros(3 * self._size)
        self.begin()

    def begin(self) -> None:
        """Make the next step the first of a touch."""
        self.window[: self._size] = self._start
        self._cold = True

    def step(self, speed_mm_s: float, force_N: float) -> float:
        """Return the next sample in m/s^2; NaN where the model has no answer."""
        window, size = self.window, self._size
        if self._cold:
            window[size : 2 * size] = speed_mm_s
            window[2 * size :] = force_N
            self._cold = False
        try:
            answer = self._run(window)
        except ModelInputError:
            return math.nan
        sample, peak = float(answer[0]), self._peak
        if self._normals is not None:
            log_sd = float(answer[1])
            if not log_sd >= LEAST_LOG_SD:
                log_sd = LEAST_LOG_SD if log_sd < LEAST_LOG_SD else math.nan
            sample += math.exp(min(log_sd, self._most_log_sd)) * self._normals.next()
        sample = -peak if sample < -peak else min(sample, peak)
        window[:-1] = window[1:]
        window[size - 1], window[2 * size - 1], window[-1] = sample, speed_mm_s, force_N
        return sample
