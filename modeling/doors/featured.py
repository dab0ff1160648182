"""The way from a profile to standardised engineered features, shared by the models that look at nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from palpate.modeling.columns import Standard, standard_of
from palpate.modeling.doors.preparing import Rows, checked_forces
from palpate.signals.arrays import Array
from palpate.signals.doors.model_features import FEATURES, features
from palpate.signals.models.card import Affine, DoorFeatures, Step


@dataclass(frozen=True)
class Featured:
    """Profiles (n, 621) in newtons to standardised features (n, features) (thesis 5.3.4.1, figure 5.6).

    A feature that was constant in training becomes 0: nothing is known of its effect.
    """

    standard: Standard

    def __call__(self, force_N: Array) -> Array:
        """Raises ModelDataError for profiles that are none."""
        return self.standard(features(checked_forces(force_N)))

    @property
    def steps(self) -> tuple[Step, ...]:
        """The same as steps of a card."""
        return DoorFeatures(names=FEATURES), Affine(gain="feature_gain", offset="feature_offset")

    @property
    def tensors(self) -> Mapping[str, Array]:
        """What the steps name."""
        return {"feature_gain": self.standard.gain, "feature_offset": self.standard.offset}


def featured(rows: Rows) -> tuple[Featured, Array]:
    """The way to the features, fitted to these rows, and their standardised features (n, features)."""
    raw = features(rows.force_N)
    standard = standard_of(raw)
    return Featured(standard), standard(raw)
