"""What modeling is told of the rig's side of doors by whoever starts it: it never imports a device itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Protocol

from palpate.modeling.doors.data import Array


class Runs(Protocol):
    """A trained model, read from its files by the rig's own runtime."""

    def run(self, given: Array) -> Array:
        """The answer to one input (in,) as (out,), or to a batch (n, in) as (n, out)."""


class DoorSide(Protocol):
    """The rig's side of doors; `palpate.devices.door.side.DoorSide` is the one that there is. It pickles by name."""

    @property
    def feature_names(self) -> Sequence[str]:
        """The names of the engineered features, in order."""

    @property
    def limit_N(self) -> float:
        """The greatest force that a made profile may have, either way."""

    @property
    def steepest_N_deg(self) -> float:
        """The greatest change of force over angle that a made profile may have."""

    def features(self, force_N: Array) -> Array:
        """(n, 621) newtons to (n, features). Raises a ValueError that names the row where there is none."""

    def described(self, force_N: Array) -> Mapping[str, float]:
        """The columns of the stimulus table for one profile (621,)."""

    def bounded(self, force_N: Array) -> Array:
        """One profile (621,) within the limits."""

    def refusal(self, force_N: Array) -> str | None:
        """Why the door would refuse to play this profile (621,), or None."""

    def load(self, card: Path) -> Runs:
        """A model from its card. Raises a ValueError for a damaged or foreign file."""


Doors = Callable[[], DoorSide]
"""How a command is handed the rig's side: imported only when it is called."""
