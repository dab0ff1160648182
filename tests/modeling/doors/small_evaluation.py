"""A few stimuli and methods that cost nothing, to evaluate with."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from palpate.modeling.doors.data import DoorData
from palpate.modeling.doors.gaussian_process import GAUSSIAN_PROCESS
from palpate.modeling.doors.linear import MEAN, RIDGE
from palpate.modeling.doors.methods import Method
from palpate.modeling.doors.nearest import NEAREST
from palpate.modeling.doors.rated import Individual, Rated
from palpate.modeling.doors.reading import read_profile
from palpate.modeling.doors.results import DoorOptions
from palpate.modeling.files.model_files import Exported
from palpate.signals.models.card import Nearest
from palpate.studies.catalogue import SHIPPED

ATTRIBUTES = ("Easy-to-pull", "Damped", "Consistent", "Pleasant", "New", "Comfort", "Luxurious")
ANTONYMS = ("Hard-to-pull", "Recoiling", "Stepwise", "Unpleasant", "Old", "Discomfort", "Cheap")
DOORS, VARIANTS = ("BC3", "FORD", "K8"), ("g0", "g1", "g4", "g8", "g12")


def small_data(simulated: bool = False, doors: tuple[str, ...] = DOORS) -> DoorData:
    """Fifteen real stimuli; the ratings follow mean force, greatest force and roughness, with a little noise."""
    names = [(door, variant) for door in doors for variant in VARIANTS]
    ids = tuple(f"{door}_{variant}" for door, variant in names)
    force = np.array([read_profile(SHIPPED / "door_ratings" / "profiles" / f"{name}.csv") for name in ids])
    columns = np.stack([force.mean(axis=1), force.max(axis=1), np.abs(np.diff(force)).mean(axis=1)], axis=1)
    z = (columns - columns.mean(axis=0)) / columns.std(axis=0)
    draw = np.random.Generator(np.random.PCG64(5))
    rating = np.clip(2.0 * z @ draw.normal(size=(3, 7)) + 0.1 * draw.normal(size=(len(ids), 7)), -10, 10)
    return DoorData(
        ATTRIBUTES, ANTONYMS, (-10.0, 10.0), ids, tuple(d for d, _ in names), tuple(v for _, v in names), ids,
        ("",) * len(ids), force, rating, np.full_like(rating, 2.0), np.full(len(ids), 20), simulated, ("made up",),
    )  # fmt: skip


def small_rated() -> Rated:
    """The same with ten people's own ratings."""
    data = small_data(simulated=True)
    noise = np.random.Generator(np.random.PCG64(6)).normal(size=(10, *data.rating.shape))
    value = data.rating[None] + noise - noise.mean(axis=0)
    return Rated(data, Individual(tuple(f"P{i:03d}" for i in range(10)), ("",) * 10, value))


@dataclass(frozen=True)
class Remembering:
    """Answers with the rating of the known profile that is the very same, else with 1000."""

    force_N: np.ndarray
    rating: np.ndarray

    def predict(self, given):
        off = np.abs(self.force_N[None] - np.asarray(given)[:, None]).max(axis=2)
        return np.where((off.min(axis=1) == 0)[:, None], self.rating[off.argmin(axis=1)], 1000.0)

    def exported(self):
        return Exported((Nearest(points="points", values="values"),), {"points": self.force_N, "values": self.rating})


def remember(learning):
    counted(learning, "fits")
    return Remembering(learning.train.force_N, learning.scaling.rating_up(learning.train.rating))


def counted(learning, name):
    """Write down that this was fitted, and with which checkpoint."""
    place = learning.settings.get("log")
    if place is not None:
        with Path(place).open("a") as file:
            file.write(f"{name} {learning.settings.get('checkpoint')}\n")


def above(learning):
    counted(learning, "above")
    return NEAREST.fit(learning)


def below(learning):
    counted(learning, "below")
    return RIDGE.fit(learning)


REMEMBER = Method("remember", "Remembers", remember)
BELOW = Method("below", "A forward model that others build on", below)
ABOVE = Method("above", "Builds on a forward model", above, needs_forward="below")
METHODS = {
    "forward": {
        "mean": MEAN,
        "ridge": RIDGE,
        "gaussian_process": GAUSSIAN_PROCESS,
        "remember": REMEMBER,
        "below": BELOW,
    },
    "inverse": {"nearest": NEAREST, "above": ABOVE},
}


def options(forward: str = "", inverse: str = "", **more) -> DoorOptions:
    """These methods, one process, three folds, no other split."""
    chosen = {"forward": tuple(forward.split()), "inverse": tuple(inverse.split())}
    return replace(DoorOptions(methods=chosen, workers=1, folds=3, beside=False), **more)
