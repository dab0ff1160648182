"""What the GAN's numbers mean: log magnitudes by bin, speed and force, about 0."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.modeling.textures.spectrograms import Spectra
from palpate.signals.arrays import Array

LEAST_SD = 1e-3
"""Of a log magnitude: a bin that hardly varies is not blown up."""


@dataclass(frozen=True)
class SpectraScale:
    """Mean and SD (bins) of the training part's log magnitudes, mean and SD (2) of speed and force.

    A hand that does not vary has SD 1.
    """

    mean: Array
    sd: Array
    hand_mean: Array
    hand_sd: Array

    def down(self, log_magnitude: Array) -> Array:
        """(..., bins) to numbers about 0."""
        return (log_magnitude - self.mean) / self.sd

    def up(self, numbers: Array) -> Array:
        """The way back."""
        return numbers * self.sd + self.mean

    def hand_down(self, drive: Array) -> Array:
        """(..., 2) in mm/s and N to numbers about 0."""
        return (drive - self.hand_mean) / self.hand_sd


def spectra_scale(found: Spectra) -> SpectraScale:
    """Of these blocks."""
    logs = found.log_magnitude.reshape(-1, found.log_magnitude.shape[-1])
    first = found.drive[:1]
    offsets = found.drive - first  # a hand that stays the same far from zero has an SD of exactly 0 so
    sd = offsets.std(axis=0)
    hand_sd = np.where(sd > 1e-12 * np.abs(found.drive).max(axis=0), sd, 1.0)
    return SpectraScale(
        logs.mean(axis=0), np.maximum(logs.std(axis=0), LEAST_SD), first[0] + offsets.mean(axis=0), hand_sd
    )
