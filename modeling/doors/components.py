"""Principal components of force profiles, as the models beside the networks use them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.signals.arrays import Array

NEGLIGIBLE = 1e-9
"""A component whose singular value is below this share of the greatest force is rounding."""


@dataclass(frozen=True)
class Components:
    """`directions` (k, points), orthonormal, the one of greatest variance first, around `mean` (points,)."""

    mean: Array
    directions: Array

    def codes(self, x: Array) -> Array:
        """(n, points) to (n, k)."""
        return (x - self.mean) @ self.directions.T


def components_of(x: Array, most: int) -> Components:
    """The first components of the rows (n, points), at most `most`; fewer where there are fewer, none of equal rows.

    Source: Jolliffe 2002, by singular value decomposition.
    """
    mean = x.mean(axis=0)
    _, singular, right = np.linalg.svd(x - mean, full_matrices=False)
    real = int(np.sum(singular > NEGLIGIBLE * float(np.abs(x).max())))
    return Components(mean, right[: min(most, real)])
