"""The inverse that is made for the loop: a wish to a profile that is felt as wished, or to the nearest one.

A forward model on engineered features has no usable gradient, and searching through it takes seconds. So the search is
done beforehand. Plausible profiles are made from the measured ones and rated by the forward model; a small network, the
student, learns these ratings from a short code of the profile; a second one, the generator, learns which code the
student feels as wished, for wishes over the whole range. What the generator then makes is rated by the forward model
and added to what the student learns from, a few times over, so that the student is right where the generator goes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.random import PCG64, SeedSequence
from numpy.random import Generator as Chance
from numpy.typing import NDArray

from palpate.modeling.doors import generator_networks as networks
from palpate.modeling.doors.data import TOP, ModelDataError
from palpate.modeling.doors.generator_networks import Generator, How, Layers, Size, fresh
from palpate.modeling.doors.generator_shapes import Code, code_of, opened, plausible
from palpate.modeling.doors.generator_teacher import Teacher, foreign_to
from palpate.modeling.doors.methods import Learning, Method
from palpate.modeling.doors.preparing import PLAYABLE, checked_wishes, on_one_thread, rows_of
from palpate.modeling.files.exported import Exported
from palpate.signals.arrays import Array
from palpate.signals.doors.limits import bounded_profiles
from palpate.signals.models.card import Activation, Affine, Clip, Dense

STRAY = 0.3
"""SD by which half of the generator's own codes are moved before they are rated: the student sees around them."""


@dataclass(frozen=True)
class Recipe:
    """How much of everything; how the numbers were chosen is told in docs/explanation/making-a-door.md.

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
    how = How(learning.seed, **_given(learning.settings), report=learning.report)
    return Generated(_trained(recipe, teacher, first, rows.rating, how), code)


def _trained(recipe: Recipe, teacher: Teacher, codes: Array, had: Array, how: How) -> Layers:
    """Round by round: teach the student, aim the generator, rate what it makes."""
    size, (components, attributes) = recipe.size, (codes.shape[1], had.shape[1])
    student = fresh(lambda: networks.student_network(components, attributes, size.student), how.drawn("student", 99))
    generator = fresh(lambda: Generator(attributes, components, size.generator, recipe.span), how.drawn("aim", 99))
    said, prices = teacher.says(codes), (recipe.code_price, recipe.foreign_price)
    for number in range(recipe.rounds + 1):
        epochs = size.student_epochs if number == 0 else size.student_epochs // 2
        networks.teach(student, codes, said, how.settings("student", number, epochs, size))
        networks.aim(generator, student, had, prices, size, how.settings("aim", number, size.generator_epochs, size))
        layers = generator.numbers()
        if number < recipe.rounds:
            wishes = networks.random_wishes(had, recipe.own, how.drawn("own", number))
            own = _strayed(layers.code(wishes), recipe.span, number, how)
            codes, said = np.r_[codes, own], np.r_[said, teacher.says(own)]
        how.report(f"generator: round {number + 1} of {recipe.rounds + 1}, {_off(teacher, layers, had):.2f} of 100 off")
    return layers


def _strayed(own: Array, span: float, number: int, how: How) -> Array:
    chance = _chance(how.seed, 2 + number)
    moved = STRAY * chance.standard_normal(own.shape) * (chance.random((len(own), 1)) < 0.5)
    return np.clip(own + moved, -span, span)


def _off(teacher: Teacher, layers: Layers, had: Array) -> float:
    """How far the forward model's ratings of what is made lie from wishes that measured profiles have."""
    return float(np.abs(teacher.says(layers.code(had))[:, :-1] - had).mean())


def _chance(seed: int, use: int) -> Chance:
    return Chance(PCG64(SeedSequence([seed, use])))


def _given(settings: Mapping[str, Any]) -> dict[str, Any]:
    return {name: settings[name] for name in ("threads", "checkpoint") if settings.get(name) is not None}


GENERATOR = Method(
    "generator",
    "Generator trained in the loop",
    fit,
    needs_forward="gaussian_process",
    source="Jordan and Rumelhart 1992 (distal learning); Ross, Gordon and Bagnell 2011 (learning where one goes)",
)
