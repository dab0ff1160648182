"""The rig's side of doors as one object, for the rooms that are handed it because they may not import a device."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from palpate.signals.doors.features import as_profile, describe
from palpate.signals.doors.model_features import FEATURES, features
from palpate.signals.doors.playable import LIMIT_N, STEEPEST_N_DEG, bounded

if TYPE_CHECKING:
    from palpate.signals.models.runtime import Model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DoorSide:
    """Features, limits and model files of doors. It holds no device, opens none, and pickles."""

    limit_N: float = LIMIT_N
    steepest_N_deg: float = STEEPEST_N_DEG

    @property
    def feature_names(self) -> tuple[str, ...]:
        """The names of the engineered features, in order."""
        return FEATURES

    def features(self, force_N: Array) -> Array:
        """(n, 621) newtons to (n, features). Raises DoorDataError that names the row where a profile is none."""
        return features(force_N)

    def described(self, force_N: Array) -> dict[str, float]:
        """The columns of the stimulus table for one profile (621,). Raises DoorDataError where it is none."""
        return describe(as_profile(force_N))

    def bounded(self, force_N: Array) -> Array:
        """One profile (621,) within the limits. Raises DoorDataError where it is none."""
        return bounded(as_profile(force_N), self.limit_N, self.steepest_N_deg)

    def refusal(self, force_N: Array) -> str | None:
        """Why the door simulator, as its twin is set up, would refuse to play this profile (621,), or None."""
        from palpate.devices.door.link.device import Settings, make
        from palpate.devices.door.link.limits import ProfileRefused

        door = make("door", Settings(kind="door", driver="twin"), Path())
        try:
            door.check(np.asarray(force_N, dtype=np.float64).tolist(), "the profile")
        except ProfileRefused as refused:
            return str(refused)
        return None

    def load(self, card: Path) -> Model:
        """A model from its card. Raises ModelFileError for a damaged or foreign file."""
        from palpate.signals.models.file import read_model

        return read_model(card)
