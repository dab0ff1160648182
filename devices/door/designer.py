"""From wishes to the door that a rig plays, and its predicted feel: two model files and NumPy, nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from palpate.devices.models.lookup import FOLDER, SHIPPED, find_model
from palpate.protocols.did_you_mean import nearest
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG, DoorDataError
from palpate.signals.doors.limits import LIMIT_N, STEEPEST_N_DEG, bounded
from palpate.signals.models.errors import ModelFileError
from palpate.signals.models.file import CARD_SUFFIX, read_model
from palpate.signals.models.runtime import Model

Wish = Mapping[str, float] | ArrayLike

FORCE, PERCEPTION = "door-force", "door-perception"
"""Names of the two models."""
LOWEST, HIGHEST = 0.0, 100.0
TOLERANCE = 10.0
"""A wish is attainable if every attribute comes within this difference, which people just notice (thesis 5.5.4.1)."""
MOST_SMOOTHING_DEG = 10.0
REACH = 4
"""A Gaussian is cut off at this many SDs."""


@dataclass(frozen=True)
class Designed:
    """A door made from wishes: 621 forces in newtons, and its predicted ratings by the perception model, 0..100.

    `off` is the prediction minus the wish. `words` name the unattainable wishes with the nearest values found; they are
    empty if all are attainable.
    """

    force_N: Array
    predicted: Array
    off: Array
    attainable: bool
    words: str


@dataclass(frozen=True)
class Designer:
    """Two models of one data set: from ratings to a profile, and from a profile to ratings.

    Raises ModelFileError if they do not fit each other.
    """

    force: Model
    perception: Model
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        _require("force", self.force, "ratings", "force_profile")
        _require("perception", self.perception, "force_profile", "ratings")
        wished, felt = self.force.card.takes, self.perception.card.gives
        if wished.names != felt.names:
            raise ModelFileError(
                f"{self.force.card.name} takes {', '.join(wished.names)}, {self.perception.card.name} gives "
                f"{', '.join(felt.names)}: the same attributes in one order are expected. Train both on one data set."
            )
        if None not in (wished.scale, felt.scale) and wished.scale != felt.scale:
            raise ModelFileError(
                f"0 and 100 are {wished.scale} in {self.force.card.name}, {felt.scale} in {self.perception.card.name}: "
                "one scale is expected. Train both on one data set."
            )

    @property
    def attributes(self) -> tuple[str, ...]:
        """Return the low word of each wish, in order."""
        return self.force.card.takes.names

    @property
    def antonyms(self) -> tuple[str, ...]:
        """Return the opposite of each low word, in order."""
        return self.force.card.takes.antonyms or self.perception.card.gives.antonyms

    @cached_property
    def identity(self) -> Mapping[str, str]:
        """Return the models' names and the SHA-256 of their weights, for the record."""
        pair = {"force": self.force.card, "perception": self.perception.card}
        names = {f"{what}_model": card.name for what, card in pair.items()}
        return names | {f"{what}_sha256": card.weights.sha256 for what, card in pair.items()}

    def design(self, wish: Wish, smoothing_deg: float = 0.0) -> Designed:
        """Return the door for a wish, and its predicted ratings.

        `wish` is a value from 0 (the attribute's word) to 100 (its antonym) by name, or all of them in order.
        `smoothing_deg` is the SD of a Gaussian over the angle; both ends of the profile keep their force.

        Raises:
            DoorDataError: a wish that is missing, unknown or outside 0..100, or a smoothing outside 0..10 degrees.
        """
        wished = self.checked(wish)
        made = smoothed(self.force.run(wished), smoothing_deg)
        shown = bounded(made, LIMIT_N, STEEPEST_N_DEG)
        predicted = np.clip(self.perception.run(shown), LOWEST, HIGHEST)
        off = predicted - wished
        within, words = bool(np.all(np.abs(off) <= self.tolerance)), ""
        if not within:
            named = zip(self.attributes, wished, predicted, strict=True)
            missed = [f"{name} {had:.0f} (wished {w:.0f})" for name, w, had in named if abs(had - w) > self.tolerance]
            words = f"These wishes cannot be met together. The nearest door found: {', '.join(missed)}."
        return Designed(shown, predicted, off, within, words)

    def checked(self, wish: Wish) -> Array:
        """Return the wishes in order. Raises DoorDataError as `design` does."""
        wished = self._in_order(wish) if isinstance(wish, Mapping) else _numbers(wish)
        if wished.shape != (len(self.attributes),):
            raise DoorDataError(f"{len(self.attributes)} wishes are expected, found an array of shape {wished.shape}.")
        for name, value in zip(self.attributes, wished.tolist(), strict=True):
            if not LOWEST <= value <= HIGHEST:
                raise DoorDataError(f"the wish for {name} is {value!r}: from {LOWEST:g} to {HIGHEST:g} is expected.")
        return wished

    def _in_order(self, wish: Mapping[str, float]) -> Array:
        for name in wish:
            if name not in self.attributes:
                raise DoorDataError(f"there is no attribute {name!r}; {nearest(name, self.attributes)}")
        if missing := [name for name in self.attributes if name not in wish]:
            raise DoorDataError(f"no wish for {', '.join(missing)}: one for each attribute is expected.")
        return _numbers([wish[name] for name in self.attributes])


def designer_for(lab: Path | None, model: str | None = None) -> Designer:
    """Return the lab's own pair of models if it has trained door-force, else the shipped pair.

    `model` names another force model of the lab or the shipped ones, or its card; the perception model beside it is
    used. Raises ModelFileError for a model that is missing, damaged or of another data set.
    """
    name = f"{FORCE}{CARD_SUFFIX}"
    if model is not None:
        card = find_model(model, lab if lab is not None else SHIPPED)
    elif lab is not None and (lab / FOLDER / name).is_file():
        card = lab / FOLDER / name
    else:
        card = SHIPPED / name
    force, beside = read_model(card), card.with_name(PERCEPTION + CARD_SUFFIX)
    if not beside.is_file():
        raise ModelFileError(
            f"{beside}: missing. A door made from wishes is shown with its predicted ratings: train both models, "
            "`palpate train doors`."
        )
    return Designer(force, read_model(beside))


def smoothed(force_N: Array, smoothing_deg: float) -> Array:
    """Return a profile (621,) smoothed by a Gaussian of this SD in degrees; the forces at both ends stay.

    An SD of 0 changes nothing.
    """
    if not 0 <= smoothing_deg <= MOST_SMOOTHING_DEG:
        raise DoorDataError(f"smoothing over {smoothing_deg!r} degrees: from 0 to {MOST_SMOOTHING_DEG:g} is expected.")
    sd = smoothing_deg * POINTS_PER_DEG
    reach = int(np.ceil(REACH * sd))
    if reach == 0:
        return force_N.copy()
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sd) ** 2)
    before = 2 * force_N[0] - force_N[reach:0:-1]
    after = 2 * force_N[-1] - force_N[-2 : -reach - 2 : -1]
    return np.convolve(np.r_[before, force_N, after], weights / weights.sum(), mode="valid")


def _require(what: str, model: Model, takes: str, gives: str) -> None:
    card = model.card
    if (card.takes.kind, card.gives.kind) != (takes, gives):
        raise ModelFileError(
            f"{card.name}: takes {card.takes.kind} and gives {card.gives.kind}; a {what} model takes {takes} and gives "
            f"{gives}."
        )
    for port, names in ((card.takes, card.takes.names), (card.gives, card.gives.names)):
        expected = POINTS if port.kind == "force_profile" else len(names)
        if port.size != expected:
            raise ModelFileError(
                f"{card.name}: a {port.kind} of {port.size}; {expected} are expected, ratings by name."
            )


def _numbers(wish: ArrayLike | Sequence[float]) -> Array:
    try:
        return np.asarray(wish, dtype=np.float64)
    except (TypeError, ValueError):
        raise DoorDataError(f"wishes are numbers, found {wish!r}.") from None
