"""The inverse that is made for the loop: a wish to a profile that is felt as wished, or to the nearest one.

A forward model on engineered features has no usable gradient, and searching through it takes seconds. So the search is
done beforehand. Plausible profiles are made from the measured ones and rated by the forward model; a small network, the
student, learns these ratings from a short code of the profile; a second one, the generator, learns which code the
student feels as wished, for wishes over the whole range. What the generator then makes is rated by the forward model
and added to what the student learns from, a few times over, so that the student is right where the generator goes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.random import PCG64, SeedSequence
from numpy.random import Generator as Chance
from numpy.typing import NDArray

from palpate.modeling.doors import generator_networks as networks
from palpate.modeling.doors.data import TOP, ModelDataError
from palpate.modeling.doors.generator_networks import Generator, How, Layers, Size, fresh
from palpate.modeling.doors.methods import Fitted, Learning, Method
from palpate.modeling.doors.preparing import PLAYABLE, checked_wishes, on_one_thread, rows_of
from palpate.modeling.files.model_files import Exported
from palpate.modeling.regression import Standard, standard_of
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG
from palpate.signals.doors.limits import bounded_profiles
from palpate.signals.doors.model_features import features
from palpate.signals.models.card import Activation, Affine, Clip, Dense

MIXED = 3
"""At most so many measured profiles are mixed."""
KNOTS = 6
"""Angles at which a mixture's features are moved, the two ends of the motion among them."""
MOVED_DEG = 3.5
"""How far they are moved at most."""
SCALES = 5
"""Angles at which a mixture's force is scaled."""
SCALED = 0.4
"""By how much at most, as a share."""
SHRINK = 0.1
"""Added to the variance of every standardised feature, so that 72 doors tell about forty of them."""
MOST_FOREIGN = 6.0
"""Beyond this, more foreign says nothing more: it keeps single odd profiles from ruling a student's training."""
STRAY = 0.3
"""SD by which half of the generator's own codes are moved before they are rated: the student sees around them."""


@dataclass(frozen=True)
class Code:
    """force = mean + code @ basis: mean (621,), basis (components, 621), both in newtons; a code has SD 1."""

    mean: Array
    basis: Array

    def decoded(self, code: Array) -> Array:
        """(n, components) to (n, 621) newtons, not bounded yet."""
        force: Array = self.mean + code @ self.basis
        return force

    def encoded(self, force_N: Array) -> Array:
        """(n, 621) newtons to the nearest code (n, components); the rows of the basis are orthogonal."""
        code: Array = (force_N - self.mean) @ self.basis.T / np.sum(self.basis**2, axis=1)
        return code


def opened(force_N: Array) -> Array:
    """Profiles (n, 621) as doors that open all the way, within the limits: the last force goes on to the end.

    Zeros behind the end of a motion are padding; mixed with other doors they would become a step in the force.
    """
    return bounded_profiles(np.array([_filled(profile) for profile in force_N]))


def plausible(doors: Array, count: int, chance: Chance) -> Array:
    """`count` profiles (count, 621) beside the measured (n, 621): mixed, their features moved, their force scaled."""
    return np.array([_varied(_mixture(doors, chance), chance) for _ in range(count)])


def code_of(profiles: Array, components: int) -> Code:
    """Return the principal components of profiles (n, 621), scaled so that their codes have SD 1.

    Raises ModelDataError where all profiles are equal.
    """
    mean = profiles.mean(axis=0)
    _, singular, right = np.linalg.svd(profiles - mean, full_matrices=False)
    kept = min(components, int(np.sum(singular > 1e-9 * max(singular[0], 1e-9))))
    if kept == 0:
        raise ModelDataError("all profiles to learn from are equal: no other can be generated from them.")
    right = right[:kept] * np.sign(right[np.arange(kept), np.argmax(np.abs(right[:kept]), axis=1)])[:, None]
    return Code(mean, right * (singular[:kept, None] / np.sqrt(len(profiles))))


def _filled(profile: Array) -> Array:
    moving = np.flatnonzero(profile)
    if not moving.size:
        return profile
    end = int(moving[-1])
    return np.concatenate([profile[: end + 1], np.full(POINTS - end - 1, profile[end])])


def _mixture(doors: Array, chance: Chance) -> Array:
    count = chance.integers(1, MIXED + 1)
    mixed: Array = chance.dirichlet(np.ones(count)) @ doors[chance.integers(0, len(doors), count)]
    return mixed


def _varied(profile: Array, chance: Chance) -> Array:
    """Features moved along the angle, piecewise linear, and the force scaled by a share that varies along it."""
    grid, end = np.arange(POINTS, dtype=np.float64), POINTS - 1
    knots = np.linspace(0, end, KNOTS)
    moved = knots + np.r_[0, chance.uniform(-MOVED_DEG, MOVED_DEG, KNOTS - 2) * POINTS_PER_DEG, 0]
    shifted = np.interp(np.interp(grid, moved, knots), grid, profile)
    strength = chance.uniform(0, SCALED)
    shares = 1 + strength * chance.uniform(-1, 1, SCALES)
    return np.asarray(shifted * np.interp(grid, np.linspace(0, end, SCALES), shares))


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
    """Return the measure for these measured profiles (n, 621)."""
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
        answer: Array = np.c_[self.forward.predict(force), self.foreign(force)]
        return answer


def _distance(z: Array, inverse: Array) -> Array:
    distance: Array = np.sqrt(np.maximum(np.sum((z @ inverse) * z, axis=1), 0))
    return distance


@dataclass(frozen=True)
class Recipe:
    """How much of everything; how the numbers were chosen stands in docs/explanation/making-a-door.md.

    `components` and `span` bound a code: so many numbers, each so many SD of the plausible profiles at most. `profiles`
    are made beside the measured ones; in each of `rounds` rounds `own` of the generator's own join them. The prices of
    a code far from the middle and of a foreign profile are in points of 100 (see `aim`).
    """

    components: int = 12
    span: float = 2.5
    profiles: int = 8000
    own: int = 2000
    rounds: int = 5
    code_price: float = 0.04
    foreign_price: float = 2.0
    size: Size = field(default_factory=Size)


QUICK = Recipe(
    profiles=600, own=200, rounds=1,
    size=Size(student=64, student_epochs=15, generator_epochs=15, wishes=2048),
)  # fmt: skip
"""A trial run: seconds, and a loop error that is nothing to go by."""


@dataclass(frozen=True)
class Generated:
    """A fitted generator: its layers, and what its codes mean."""

    layers: Layers
    code: Code

    def predict(self, given: Array) -> Array:
        """(n, attributes) on 0..100 to (n, 621) newtons within the limits; a wish beyond 0..100 counts as its end.

        Raises ModelDataError for wishes that are not finite or far off the scale.
        """
        wish = checked_wishes(given, self.layers.numbers[0][0].shape[1])
        return bounded_profiles(self.code.decoded(self.layers.code(wish)))

    def exported(self) -> Exported:
        """Clip, scale, three dense layers each with tanh, one more that decodes, and the limits."""
        steps: list[Any] = [Clip(low=0, high=TOP), Affine(gain=2 / TOP, offset=-1)]
        tensors: dict[str, NDArray[Any]] = {"decode": self.layers.span * self.code.basis.T, "mean": self.code.mean}
        for number, (weight, bias) in enumerate(self.layers.numbers, start=1):
            tensors |= {f"weight_{number}": weight, f"bias_{number}": bias}
            steps += [Dense(weight=f"weight_{number}", bias=f"bias_{number}"), Activation(function="tanh")]
        return Exported((*steps, Dense(weight="decode", bias="mean"), PLAYABLE), tensors)


@on_one_thread
def fit(learning: Learning) -> Generated:
    """Train it with the full recipe, or with the setting `quick` a small one; `threads`, `checkpoint` are settings too.

    Raises ModelDataError without a forward model, or with fewer than two stimuli.
    """
    return fit_by(QUICK if learning.settings.get("quick") else Recipe(), learning)


def fit_by(recipe: Recipe, learning: Learning) -> Generated:
    """Train it by a recipe. Raises as `fit`."""
    if learning.forward is None:
        raise ModelDataError("the generator learns from a forward model; none was given (needs_forward).")
    rows = rows_of(learning, least=2)
    doors = opened(rows.force_N)
    profiles = np.r_[doors, plausible(doors, recipe.profiles, _chance(learning.seed, 1))]
    code = code_of(profiles, recipe.components)
    teacher = Teacher(learning.forward, foreign_to(rows.force_N), code)
    first = np.clip(code.encoded(profiles), -recipe.span, recipe.span)
    given = {name: value for name in ("threads", "checkpoint") if (value := learning.settings.get(name)) is not None}
    how = How(learning.seed, **given, report=learning.report)
    return Generated(_trained(recipe, teacher, first, rows.rating, how), code)


def _trained(recipe: Recipe, teacher: Teacher, codes: Array, had: Array, how: How) -> Layers:
    """Round by round: teach the student, aim the generator, rate what it makes."""
    size, (components, attributes) = recipe.size, (codes.shape[1], had.shape[1])
    student = fresh(lambda: networks.student_network(components, attributes, size.student), how.drawn("student", 99))
    generator = fresh(lambda: Generator(attributes, components, size.generator, recipe.span), how.drawn("aim", 99))
    ratings, prices = teacher.says(codes), (recipe.code_price, recipe.foreign_price)
    for number in range(recipe.rounds + 1):
        epochs = size.student_epochs if number == 0 else size.student_epochs // 2
        networks.teach(student, codes, ratings, how.settings("student", number, epochs, size))
        networks.aim(generator, student, had, prices, size, how.settings("aim", number, size.generator_epochs, size))
        layers = generator.numbers()
        if number < recipe.rounds:
            wishes = networks.random_wishes(had, recipe.own, how.drawn("own", number))
            own, chance = layers.code(wishes), _chance(how.seed, 2 + number)
            moved = STRAY * chance.standard_normal(own.shape) * (chance.random((len(own), 1)) < 0.5)
            own = np.clip(own + moved, -recipe.span, recipe.span)
            codes, ratings = np.r_[codes, own], np.r_[ratings, teacher.says(own)]
        # how far the forward model's ratings of what is made lie from wishes that measured profiles have
        off = float(np.abs(teacher.says(layers.code(had))[:, :-1] - had).mean())
        how.report(f"generator: round {number + 1} of {recipe.rounds + 1}, {off:.2f} of 100 off")
    return layers


def _chance(seed: int, use: int) -> Chance:
    return Chance(PCG64(SeedSequence([seed, use])))


GENERATOR = Method(
    "generator",
    "Generator trained in the loop",
    fit,
    needs_forward="gaussian_process",
    source="Jordan and Rumelhart 1992 (distal learning); Ross, Gordon and Bagnell 2011 (learning where one goes)",
)
