"""Columns brought to mean 0 and SD 1, as what is learned from them wants them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.signals.arrays import Array

CONSTANT = 1e-9
"""What has an SD below this share of its greatest value differs by rounding only."""


@dataclass(frozen=True)
class Standard:
    """z = gain * x + offset: mean 0 and SD 1 on the training rows; a column that is constant there becomes 0."""

    gain: Array
    offset: Array

    def __call__(self, x: Array) -> Array:
        """(n, columns) to the same shape."""
        return x * self.gain + self.offset


def standard_of(x: Array) -> Standard:
    """The standardisation of these columns (n, columns)."""
    mean, sd = x.mean(axis=0), x.std(axis=0)
    varies = sd > CONSTANT * np.max(np.abs(x), axis=0)
    gain = np.divide(1.0, sd, out=np.zeros_like(sd), where=varies)
    return Standard(gain, -mean * gain)
