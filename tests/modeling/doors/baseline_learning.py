"""What the tests of the plain methods share: the methods, something to learn from, and the way through a file."""

from dataclasses import replace
from functools import cache

import numpy as np

from palpate.modeling.doors.forest import FOREST
from palpate.modeling.doors.gaussian_process import GAUSSIAN_PROCESS
from palpate.modeling.doors.linear import MEAN, PCA_REGRESSION, PCA_RIDGE, RIDGE
from palpate.modeling.doors.nearest import NEAREST
from palpate.modeling.doors.training_variants import with_variants
from palpate.modeling.files.model_files import write_model
from palpate.signals.models.card import Port
from palpate.signals.models.file import read_model
from tests.modeling.doors.network_learning import SEEN, UNSEEN, data_of, learning, profiles

ON_FEATURES = (RIDGE, FOREST, GAUSSIAN_PROCESS)
FORWARD = (MEAN, *ON_FEATURES, PCA_RIDGE)
INVERSE = (NEAREST, PCA_REGRESSION)
CHOOSING = (RIDGE, PCA_RIDGE, PCA_REGRESSION)
"""Those that choose a penalty over inner folds."""


def learn(data=None, *, scaling=None, **settings):
    """What a method may learn from: these stimuli (by default sixteen), and them with their training variants."""
    data = data_of(SEEN) if data is None else data
    given = learning(train=data_of(SEEN), **settings)
    given = replace(given, measured=data, train=with_variants(data, 3))
    return given if scaling is None else replace(given, scaling=scaling)


@cache
def fitted_to_all(method):
    """What the method makes of `learn()`: nothing changes it, so it is made once."""
    return method.fit(learn())


def unseen_rows(method):
    """Something that the method was not fitted to: eight profiles in newtons, or eight wishes."""
    unseen = data_of(UNSEEN)
    return unseen.force_N if method in FORWARD else (unseen.rating + 100) / 2


def through_a_file(exported, folder, takes, gives):
    """The same model, written to a folder and read by the rig's runtime."""
    kinds = {621: ("force_profile", "N")}
    ports = [
        Port(kind=kind, size=size, unit=unit)
        for size in (takes, gives)
        for kind, unit in [kinds.get(size, ("ratings", "0..100"))]
    ]
    return read_model(
        write_model(folder, "tried", exported, title="Tried", method="tried", takes=ports[0], gives=ports[1])
    )


def shuffled(data, seed=0):
    """The same stimuli in another order."""
    return data.rows(np.random.default_rng(seed).permutation(len(data)))


__all__ = ["SEEN", "UNSEEN", "data_of", "profiles"]
