"""The mean of the training set, whatever the profile: what every other method has to beat."""

from __future__ import annotations

import numpy as np

from palpate.modeling.doors.linear import Linear
from palpate.modeling.doors.methods import Learning, Method
from palpate.modeling.doors.preparing import checked_forces, rows_of
from palpate.signals.doors.grid import POINTS


def fit(learning: Learning) -> Linear:
    """The mean rating of each attribute over the measured stimuli of the training side."""
    mean = rows_of(learning).rating.mean(axis=0)
    return Linear(np.zeros((len(mean), POINTS)), mean, checked_forces)


MEAN = Method("mean", "Mean of the training set", fit, source="the reference of R2, thesis equation 5.7")
