"""Makers of doors from wishes, for the window, the studies and the stimulus files, and the choice of a maker."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from numpy.typing import ArrayLike

from palpate.signals.arrays import Array
from palpate.signals.doors.grid import FORCE_DECIMALS

LOWEST, NEUTRAL, HIGHEST = 0.0, 50.0, 100.0


class DesignedDoor(Protocol):
    """A door made from wishes; see palpate.devices.door.designer.Designed."""

    @property
    def force_N(self) -> Array:
        """Return the 621 forces."""

    @property
    def predicted(self) -> Array:
        """Return the predicted ratings, 0..100, in the wishes' order."""

    @property
    def off(self) -> Array:
        """Return the difference between prediction and wishes."""

    @property
    def attainable(self) -> bool:
        """Return whether the prediction is near enough to the wishes."""


class Maker(Protocol):
    """A maker of doors; see palpate.devices.door.designer.Designer."""

    @property
    def attributes(self) -> Sequence[str]:
        """Return the low word of each wish, in order."""

    @property
    def antonyms(self) -> Sequence[str]:
        """Return the opposite of each low word, in order."""

    @property
    def identity(self) -> Mapping[str, Any]:
        """Return the models' names and SHA-256."""

    def design(self, wish: Mapping[str, float] | ArrayLike, smoothing_deg: float = 0.0) -> DesignedDoor:
        """Return the door for wishes from 0 to 100, by name or in order; `smoothing_deg` is the SD of a Gaussian.

        Raises DoorDataError for an invalid wish or smoothing.
        """


@dataclass(frozen=True)
class Doors:
    """Doors for wishes by their low words, as a door plays them and a record stores them."""

    maker: Maker

    def force_N(self, wish: Mapping[str, float]) -> tuple[float, ...]:
        """Return the 621 forces rounded to a file's decimals, so that the saved profile is the played one.

        Raises DoorDataError for an attribute that is missing or unknown, or a value outside 0 to 100.
        """
        return tuple(round(float(force), FORCE_DECIMALS) + 0.0 for force in self.maker.design(wish).force_N)


def maker_for(lab: Path | None, model: str | None = None) -> Maker:
    """Return the lab's own models as a maker of doors if it has trained some, else the shipped ones.

    `model` names another force model of either, or its card. Raises ModelFileError for an unavailable model.
    """
    from palpate.devices.door.designer import designer_for

    return designer_for(lab, model)
