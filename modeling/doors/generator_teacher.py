"""What a code is worth: how its profile would be rated, and how foreign it is to the measured ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.modeling.columns import Standard, standard_of
from palpate.modeling.doors.generator_shapes import Code
from palpate.modeling.doors.methods import Fitted
from palpate.signals.arrays import Array
from palpate.signals.doors.limits import bounded_profiles
from palpate.signals.doors.model_features import features

SHRINK = 0.1
"""Added to the variance of every standardised feature, so that 72 doors tell about forty of them."""
MOST_FOREIGN = 6.0
"""Beyond this, more foreign says nothing more: it keeps single odd profiles from ruling a student's training."""


@dataclass(frozen=True)
class Foreign:
    """How far a profile's features lie outside those of the measured ones: 1 is usual among the measured ones.

    It is a Mahalanobis distance with a shrunk covariance: the square root of a ridge regression's leverage, which is
    where a model of these features begins to guess (Hoaglin and Welsch 1978). `usual` is the median of the measured.
    """

    standard: Standard
    inverse: Array
    usual: float

    def __call__(self, force_N: Array) -> Array:
        """(n, 621) newtons to (n,), at most MOST_FOREIGN."""
        distance = _distance(self.standard(features(force_N)), self.inverse)
        return np.minimum(distance / self.usual, MOST_FOREIGN)


def foreign_to(measured_N: Array) -> Foreign:
    """The measure for these measured profiles (n, 621)."""
    raw = features(measured_N)
    standard = standard_of(raw)
    z = standard(raw)
    inverse = np.asarray(np.linalg.inv(z.T @ z / len(z) + SHRINK * np.eye(z.shape[1])), dtype=np.float64)
    usual = float(np.median(_distance(z, inverse)))
    return Foreign(standard, inverse, usual if usual > 0 else 1.0)


@dataclass(frozen=True)
class Teacher:
    """A fitted forward model that rates codes by the profiles that the door would play for them."""

    forward: Fitted
    foreign: Foreign
    code: Code

    def profiles(self, code: Array) -> Array:
        """(n, components) to (n, 621) newtons within the limits."""
        return bounded_profiles(self.code.decoded(code))

    def says(self, code: Array) -> Array:
        """(n, components) to (n, attributes + 1): ratings on 0..100, and how foreign the profile is."""
        force = self.profiles(code)
        said: Array = np.c_[self.forward.predict(force), self.foreign(force)]
        return said


def _distance(z: Array, inverse: Array) -> Array:
    distance: Array = np.sqrt(np.maximum(np.sum((z @ inverse) * z, axis=1), 0))
    return distance
