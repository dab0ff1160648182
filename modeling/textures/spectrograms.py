"""Spectrograms of a recording in blocks: the log magnitudes of a few frames, and the hand's speed and force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from palpate.modeling.textures.recording import Recording, TextureDataError
from palpate.modeling.textures.windows import Stretches
from palpate.signals.arrays import Array

FAINTEST = 1e-3
"""Magnitudes below this share of the texture's own level count as this: the log of silence has no end."""


@dataclass(frozen=True)
class Frames:
    """Frames of `size` samples (even), Hann-windowed, `hop` apart, `count` a block."""

    size: int
    hop: int
    count: int

    def __post_init__(self) -> None:
        if self.size < 8 or self.size % 2 or not 1 <= self.hop <= self.size // 2 or self.count < 1:
            raise TextureDataError(
                f"{self.count} frames of {self.size} samples, {self.hop} apart: an even size of at least 8, a hop of "
                "at most half of it and at least one frame are expected."
            )

    @property
    def bins(self) -> int:
        """Frequencies from 0 to half the rate."""
        return self.size // 2 + 1

    @property
    def span(self) -> int:
        """Samples that a block's frames reach over."""
        return self.size + (self.count - 1) * self.hop


@dataclass(frozen=True)
class Spectra:
    """Blocks: natural logs of the magnitudes (n, count, bins), and the speed and force (n, 2) that each begins at."""

    log_magnitude: Array
    drive: Array


def magnitudes(acceleration: Array, frames: Frames) -> Array:
    """(n, span) to (n, count, bins): magnitudes of the FFT of each Hann-windowed frame, the periodic window."""
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(frames.size) / frames.size)
    cut = sliding_window_view(acceleration, frames.size, axis=-1)[..., :: frames.hop, :]
    found: Array = np.abs(np.fft.rfft(cut * window, axis=-1))
    return found


def spectra(recording: Recording, stretches: Stretches, frames: Frames, apart: int, floor: float) -> Spectra:
    """Every block that lies within a stretch, `apart` samples after the one before it; none where all are shorter.

    `floor` is the least magnitude.
    """
    starts = [np.arange(start, stop - frames.span + 1, apart) for start, stop in stretches]
    at: NDArray[Any] = np.concatenate([np.empty(0, dtype=np.int64), *starts]).astype(np.int64)
    blocks = recording.signals[0][at[:, None] + np.arange(frames.span)]
    found = magnitudes(blocks, frames)
    return Spectra(np.log(np.maximum(found, floor)), recording.signals[1:, at].T.copy())
