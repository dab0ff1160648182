"""The inverse method that returns the profile whose ratings are nearest to the wish."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.modeling.doors.methods import Learning, Method
from palpate.modeling.doors.preparing import checked_wishes, rows_of
from palpate.modeling.files.model_files import Exported
from palpate.signals.arrays import Array
from palpate.signals.models import card as model_card


@dataclass(frozen=True)
class Nearest:
    """Profiles `force_N` (n, 621) with their ratings (n, attributes) on 0..100."""

    rating: Array
    force_N: Array

    def predict(self, given: Array) -> Array:
        """Return the nearest rated profiles (n, 621) in newtons to wishes (n, attributes) on 0..100 (Euclidean)."""
        wish = checked_wishes(given, self.rating.shape[1])
        return self.force_N[[int(np.argmin(np.sum((self.rating - row) ** 2, axis=1))) for row in wish]]

    def exported(self) -> Exported:
        """Return one step that holds all rated profiles."""
        step = model_card.Nearest(points="rating", values="force_N")
        return Exported((step,), {"rating": self.rating, "force_N": self.force_N})


def fit(learning: Learning) -> Nearest:
    """Return the look-up table of the measured stimuli of the training side."""
    rows = rows_of(learning)
    return Nearest(rows.rating, rows.force_N)


NEAREST = Method("nearest", "Nearest rated profile", fit, source="Cover and Hart 1967")
