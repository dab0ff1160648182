"""A small thing to learn from: shipped door profiles, rated by rules that are linear in what a hand feels."""

from functools import cache
from pathlib import Path

import numpy as np

from palpate.modeling.doors.data import DoorData, scaling_of
from palpate.modeling.doors.methods import Learning
from palpate.signals.models.card import Card, Port, Weights
from palpate.signals.models.runtime import Model

PROFILES = Path(__file__).parents[3] / "studies" / "door_ratings" / "profiles"
ATTRIBUTES = ("Easy-to-pull", "Damped", "Consistent", "Pleasant", "New", "Comfort", "Luxurious")
SEEN = tuple(f"{door}_{variant}" for variant in ("g0", "g2", "g5", "g8") for door in ("BC3", "FORD", "G90", "K3"))
UNSEEN = tuple(f"{door}_{variant}" for variant in ("g1", "g9") for door in ("BC3", "FORD", "G90", "K3"))


@cache
def profile(name):
    return np.loadtxt(PROFILES / f"{name}.csv", delimiter=",", skiprows=1)[:, 1]


def profiles(names):
    """(n, 621) newtons."""
    return np.array([profile(name) for name in names])


def felt(force_N):
    """(n, 7) ratings on -100..100 that follow the greatest, mean, first, last and swinging forces."""
    columns = [force_N.max(1), force_N.mean(1), force_N[:, :60].mean(1), force_N[:, -60:].mean(1), force_N.std(1)]
    felt = np.array(columns).T @ np.array([[1, 0, 1, 0, 1, 0, 1], [1, 1, 0, 0, 1, 1, 0], [0, 1, 0, 1, 0, 1, 0],
                                           [0, 0, 1, 1, 0, 0, 1], [0, 1, 1, 0, 1, 0, 1]])  # fmt: skip
    return np.clip((felt - 40.0) * 1.2, -100.0, 100.0)


def data_of(names, force_N=None, rating=None):
    """Stimuli, each a source of its own."""
    force_N = profiles(names) if force_N is None else force_N
    rating = felt(force_N) if rating is None else rating
    rows = len(names)
    return DoorData(
        attributes=ATTRIBUTES, antonyms=tuple(f"not {name}" for name in ATTRIBUTES), scale=(-100.0, 100.0),
        ids=tuple(names), doors=tuple(name[:2] for name in names), variants=("g0",) * rows, source=tuple(names),
        groups=("A",) * rows, force_N=force_N, rating=rating, sd=np.full_like(rating, 20.0),
        raters=np.full(rows, 20), simulated=True,
    )  # fmt: skip


def learning(train=None, held=None, forward=None, seed=5, **settings):
    """What a method may learn from: sixteen profiles, eight to watch, one thread."""
    train = data_of(SEEN) if train is None else train
    held = data_of(UNSEEN) if held is None else held
    return Learning(
        train=train, measured=train, held=held, scaling=scaling_of(train), seed=seed,
        settings={"threads": 1, **settings}, forward=forward,
    )  # fmt: skip


def of_the_mean(learned, loss):
    """The loss of an answer that is always the mean of the training ratings, on the held-out stimuli."""
    up = learned.scaling.rating_up
    return loss(up(learned.train.rating).mean(axis=0) - up(learned.held.rating))


def run_by_numpy(exported, takes, gives):
    """The same model in the rig's own runtime; `takes` and `gives` are how many numbers go in and come out."""
    kinds = {621: ("force_profile", "N"), 7: ("ratings", "0..100")}
    ports = [Port(kind=kinds[size][0], size=size, unit=kinds[size][1]) for size in (takes, gives)]
    weights = Weights(file="tried.safetensors", sha256="0" * 64, bytes=0)
    card = Card(
        name="tried", title="Tried", method="network", weights=weights, takes=ports[0], gives=ports[1],
        steps=exported.steps,
    )  # fmt: skip
    return Model(card, exported.tensors)
