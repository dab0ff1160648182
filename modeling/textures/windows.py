"""Windows of the past and the next sample of each, within stretches of a recording (thesis equation 4.1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from palpate.modeling.textures.recording import CHANNELS, Parts, Recording, Scale, TextureDataError, Windows
from palpate.signals.arrays import Array

LENGTHS = (10, 15, 20, 25, 30)
"""Window lengths that are compared (thesis 4.6.2; 4.4.5 says 14 and 26 instead of 15 and 25)."""

Stretches = Sequence[tuple[int, int]]
SAME = 1e-12
"""Variation of a channel below this share of its size is rounding."""


def windows(recording: Recording, stretches: Stretches, m: int) -> Windows:
    """Return every window of m samples within a stretch [start, stop), with the acceleration that follows it.

    `given` is (n, 3, m) in units, oldest first; `target` (n,); `at` (n,) the target's index in the recording. A stretch
    of s samples gives s - m windows. Raises TextureDataError on m below 1, stretches that leave the recording, and
    where no stretch is longer than m.
    """
    if m < 1:
        raise TextureDataError(f"windows of {m} samples: at least 1 is expected")
    n = recording.signals.shape[1]
    for start, stop in stretches:
        if not 0 <= start <= stop <= n:
            raise TextureDataError(
                f"{recording.texture}: a stretch [{start}, {stop}) of {n} samples; one within is due"
            )
    pieces = [(start, stop) for start, stop in stretches if stop - start > m]
    if not pieces:
        longest = max((stop - start for start, stop in stretches), default=0)
        raise TextureDataError(
            f"{recording.texture}: no stretch is longer than a window of {m} samples (the longest has {longest}); "
            "record longer, or choose a shorter window or fewer frames"
        )
    at = np.concatenate([np.arange(start + m, stop, dtype=np.int64) for start, stop in pieces])
    of_all = sliding_window_view(recording.signals, m, axis=1)
    given = np.ascontiguousarray(of_all[:, at - m].transpose(1, 0, 2))
    return Windows(given, recording.signals[0, at], at)


def samples_of(recording: Recording, stretches: Stretches) -> Array:
    """Return the signals (3, n) of the stretches, one after another."""
    cuts = [recording.signals[:, start:stop] for start, stop in stretches]
    return np.concatenate(cuts, axis=1) if cuts else np.empty((CHANNELS, 0))


def scale_of(recording: Recording, parts: Parts) -> Scale:
    """Return mean and SD (3,) of the training part; the SD of a constant channel is 1 (thesis 4.3.3)."""
    trained = samples_of(recording, parts.train)
    if not trained.shape[1]:
        raise TextureDataError(f"{recording.texture}: the training part is empty")
    first = trained[:, :1]
    offsets = trained - first  # a constant channel far from zero has an SD of exactly 0 so
    sd = offsets.std(axis=1)
    still = sd <= np.abs(trained).max(axis=1) * SAME
    return Scale(first[:, 0] + offsets.mean(axis=1), np.where(still, 1.0, sd))
