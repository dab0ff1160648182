"""The inverse method that is trained in the loop: from wished ratings to a profile with these or the nearest ratings.

A forward model on engineered features has no usable gradient, and searching through it takes seconds, so the search is
done in training. Plausible profiles are varied from the measured ones and rated by the forward model (the teacher). A
small network, the student, learns these ratings from a short code of the profile. A second one, the generator, learns
the code that the student rates as wished, for wishes over the whole range. For a few rounds the generator's profiles
are rated by the teacher and added to the student's training data, so that the student is accurate where they lie.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.random import PCG64, SeedSequence
from numpy.random import Generator as Rng
from numpy.typing import NDArray

from palpate.modeling.doors import generator_networks as networks
from palpate.modeling.doors.data import TOP
from palpate.modeling.doors.generator_networks import Generator, Layers, Size, TrainingOptions
from palpate.modeling.doors.methods import Fitted, Learning, Method
from palpate.modeling.doors.preparing import PLAYABLE, checked_wishes, on_one_thread, rows_of
from palpate.modeling.doors.training_variants import motion_end
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.modeling.files.model_files import Exported
from palpate.modeling.regression import Standard, standard_of
from palpate.modeling.training.seeding import seeded
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG
from palpate.signals.doors.limits import bounded_profiles
from palpate.signals.doors.model_features import features
from palpate.signals.models.card import Activation, Affine, Clip, Dense

MIXED = 3
"""The most measured profiles that are mixed."""
KNOTS = 6
"""The number of angles at which a mixture's features are moved, including both ends of the motion."""
MOVED_DEG = 3.5
"""The most degrees that they are moved by."""
SCALES = 5
"""The number of angles at which a mixture's force is scaled."""
SCALED = 0.4
"""The greatest change of scale, as a share."""
SHRINK = 0.1
"""Added to the variance of every standardised feature, as 72 doors do not determine the covariance of forty."""
MOST_FOREIGN = 6.0
"""The upper bound of the distance, so that single odd profiles do not dominate a student's training."""
STRAY = 0.3
"""The SD of random changes to half of the generator's codes before they are rated, to cover their neighbourhood."""


@dataclass(frozen=True)
class Code:
    """A linear code, force = mean + code @ basis: mean (621,), basis (components, 621) in newtons; a code has SD 1."""

    mean: Array
    basis: Array

    def decoded(self, code: Array) -> Array:
        """Return the profiles (n, 621) in newtons of codes (n, components), not yet bounded."""
        force: Array = self.mean + code @ self.basis
        return force

    def encoded(self, force_N: Array) -> Array:
        """Return the nearest codes (n, components) of profiles (n, 621) in newtons; the basis is orthogonal."""
        code: Array = (force_N - self.mean) @ self.basis.T / np.sum(self.basis**2, axis=1)
        return code


def open_fully(force_N: Array) -> Array:
    """Return profiles (n, 621) as doors that open completely, within the limits: the last force continues to the end.

    Zeros behind the end of a motion are padding; mixed with other doors they would become a step in the force.
    """
    doors = [(profile, motion_end(profile) + 1) for profile in force_N]
    return bounded_profiles(np.array([np.pad(door[:end], (0, POINTS - end), mode="edge") for door, end in doors]))


def plausible_profiles(doors: Array, count: int, rng: Rng) -> Array:
    """Return random profiles (count, 621): mixtures of measured ones (n, 621), moved along the angle and scaled.

    Features move piecewise linearly along the angle, and the force is scaled by a share that varies along it.
    """
    grid, end = np.arange(POINTS, dtype=np.float64), POINTS - 1
    knots, scaled_at = np.linspace(0, end, KNOTS), np.linspace(0, end, SCALES)
    profiles = np.empty((count, POINTS))
    for row in range(count):
        size = rng.integers(1, MIXED + 1)
        mixture = rng.dirichlet(np.ones(size)) @ doors[rng.integers(0, len(doors), size)]
        moved = knots + np.r_[0, rng.uniform(-MOVED_DEG, MOVED_DEG, KNOTS - 2) * POINTS_PER_DEG, 0]
        shifted = np.interp(np.interp(grid, moved, knots), grid, mixture)
        strength = rng.uniform(0, SCALED)
        shares = 1 + strength * rng.uniform(-1, 1, SCALES)
        profiles[row] = shifted * np.interp(grid, scaled_at, shares)
    return profiles


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


@dataclass(frozen=True)
class Foreign:
    """The distance of a profile's features from those of the measured ones, in units of their median distance.

    It is a Mahalanobis distance with a shrunk covariance: the square root of a ridge regression's leverage, which grows
    where a model of these features extrapolates (Hoaglin and Welsch 1978). `usual` is the median of the measured ones.
    """

    standard: Standard
    inverse: Array
    usual: float

    def __call__(self, force_N: Array) -> Array:
        """Return the distances (n,) of profiles (n, 621) in newtons, at most MOST_FOREIGN."""
        distance = _distance(self.standard(features(force_N)), self.inverse)
        return np.minimum(distance / self.usual, MOST_FOREIGN)


def foreign_to(measured_N: Array) -> Foreign:
    """Return the distance to these measured profiles (n, 621)."""
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
        """Return the profiles (n, 621) in newtons, within the limits, of codes (n, components)."""
        return bounded_profiles(self.code.decoded(code))

    def rate(self, code: Array) -> Array:
        """Return ratings on 0..100 and the foreignness (n, attributes + 1) of codes (n, components)."""
        force = self.profiles(code)
        answer: Array = np.c_[self.forward.predict(force), self.foreign(force)]
        return answer


def _distance(z: Array, inverse: Array) -> Array:
    distance: Array = np.sqrt(np.maximum(np.sum((z @ inverse) * z, axis=1), 0))
    return distance


@dataclass(frozen=True)
class Recipe:
    """The sizes of a generator's training; docs/explanation/making-a-door.md says how they were chosen.

    A code has `components` numbers, each within `span` SD of the plausible profiles. `profiles` are varied from the
    measured ones, and in each of `rounds` rounds `own` of the generator's own join them. The penalties of a code far
    from the mean and of a foreign profile are in points of 100 (see `train_generator`).
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
"""A trial run that takes seconds; its loop error means nothing."""


@dataclass(frozen=True)
class Generated:
    """A fitted generator: its layers, and the code that they output."""

    layers: Layers
    code: Code

    def predict(self, given: Array) -> Array:
        """Return profiles (n, 621) in newtons, within the limits, for wishes (n, attributes), clipped to 0..100.

        Raises ModelDataError for wishes that are not finite or far off the scale.
        """
        wish = checked_wishes(given, self.layers.numbers[0][0].shape[1])
        return bounded_profiles(self.code.decoded(self.layers.code(wish)))

    def exported(self) -> Exported:
        """Return the steps: clip, scale, three dense layers each with tanh, one more that decodes, and the limits."""
        steps: list[Any] = [Clip(low=0, high=TOP), Affine(gain=2 / TOP, offset=-1)]
        tensors: dict[str, NDArray[Any]] = {"decode": self.layers.span * self.code.basis.T, "mean": self.code.mean}
        for number, (weight, bias) in enumerate(self.layers.numbers, start=1):
            tensors |= {f"weight_{number}": weight, f"bias_{number}": bias}
            steps += [Dense(weight=f"weight_{number}", bias=f"bias_{number}"), Activation(function="tanh")]
        return Exported((*steps, Dense(weight="decode", bias="mean"), PLAYABLE), tensors)


@on_one_thread
def fit(learning: Learning) -> Generated:
    """Train a generator by the full recipe. Settings: `quick` uses a small one; `threads`, `checkpoint`.

    Raises ModelDataError without a forward model, or with fewer than two stimuli.
    """
    return fit_by(QUICK if learning.settings.get("quick") else Recipe(), learning)


def fit_by(recipe: Recipe, learning: Learning) -> Generated:
    """Train a generator by this recipe. Raises as `fit` does."""
    if learning.forward is None:
        raise ModelDataError("the generator learns from a forward model; none was given (needs_forward).")
    rows = rows_of(learning, least=2)
    doors = open_fully(rows.force_N)
    profiles = np.r_[doors, plausible_profiles(doors, recipe.profiles, _rng(learning.seed, 1))]
    code = code_of(profiles, recipe.components)
    teacher = Teacher(learning.forward, foreign_to(rows.force_N), code)
    first = np.clip(code.encoded(profiles), -recipe.span, recipe.span)
    given = {name: value for name in ("threads", "checkpoint") if (value := learning.settings.get(name)) is not None}
    options = TrainingOptions(learning.seed, **given, report=learning.report)
    return Generated(_train(recipe, teacher, first, rows.rating, options), code)


def _train(recipe: Recipe, teacher: Teacher, codes: Array, attained: Array, options: TrainingOptions) -> Layers:
    """Train the student, then the generator, in each round, and add the generator's own profiles with their ratings."""
    size, (components, attributes) = recipe.size, (codes.shape[1], attained.shape[1])
    student = seeded(
        lambda: networks.student_network(components, attributes, size.student), options.stage_seed("student", 99)
    )
    generator = seeded(
        lambda: Generator(attributes, components, size.generator, recipe.span), options.stage_seed("aim", 99)
    )
    ratings, prices = teacher.rate(codes), (recipe.code_price, recipe.foreign_price)
    for number in range(recipe.rounds + 1):
        epochs = size.student_epochs if number == 0 else size.student_epochs // 2
        networks.train_student(student, codes, ratings, options.settings("student", number, epochs, size))
        settings = options.settings("aim", number, size.generator_epochs, size)
        networks.train_generator(generator, student, attained, prices, size, settings)
        layers = generator.numbers()
        if number < recipe.rounds:
            wishes = networks.random_wishes(attained, recipe.own, options.stage_seed("own", number))
            own, rng = layers.code(wishes), _rng(options.seed, 2 + number)
            moved = STRAY * rng.standard_normal(own.shape) * (rng.random((len(own), 1)) < 0.5)
            own = np.clip(own + moved, -recipe.span, recipe.span)
            codes, ratings = np.r_[codes, own], np.r_[ratings, teacher.rate(own)]
        # the distance of the forward model's ratings from wishes that measured profiles attain
        off = float(np.abs(teacher.rate(layers.code(attained))[:, :-1] - attained).mean())
        options.report(f"generator: round {number + 1} of {recipe.rounds + 1}, {off:.2f} of 100 off")
    return layers


def _rng(seed: int, use: int) -> Rng:
    return Rng(PCG64(SeedSequence([seed, use])))


GENERATOR = Method(
    "generator",
    "Generator trained in the loop",
    fit,
    needs_forward="gaussian_process",
    source="Jordan and Rumelhart 1992 (distal learning); Ross, Gordon and Bagnell 2011 (learning where one goes)",
)
