"""Five training variants of each stimulus, with ratings that are adjusted a little (thesis 5.5.1).

The thesis names the five changes and says that each variant got "an adjusted perceptual rating to reflect the expected
perceptual shifts"; it gives neither sizes nor shifts. Both are our choice, derived from the words of the attributes:
see `KINDS`. Nobody rated a variant, so no evaluation counts variants.

All changes but the amplitude preserve the force at 0 degrees, and all preserve the zeros after the motion of a door
that opens less far. `amount` is in the unit of the entry of the change in `KINDS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from palpate.modeling.doors.data import DoorData
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.protocols.keyed import keyed_bits
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS_PER_DEG

Change = Callable[[Array, float, np.random.Generator], Array]

RAMP_DEG = 5.0
"""The first and last degrees of the motion, over which a shift grows from zero and returns to zero."""
SMOOTHED_DEG = 20.0
"""The length of the smoothed stretch; over a quarter of it at each end, the smoothed values merge into the original."""
SPIKE_DEG = 1.0
"""Width of a spike at its foot."""
MARK = "~"
"""The separator between a stimulus and its change in the name of a training variant: BC3_g0~noise."""


def noise(force_N: Array, amount: float, draw: np.random.Generator) -> Array:
    """Return the profile (621,) with white Gaussian noise of SD `amount` newtons at every point of the motion."""
    end = motion_end(force_N)
    changed = force_N.copy()
    changed[1 : end + 1] += amount * draw.standard_normal(end)
    return changed


def shift(force_N: Array, amount: float, _draw: np.random.Generator) -> Array:
    """Return the profile (621,) moved `amount` degrees later (below 0: earlier); the ends of the motion stay."""
    end = motion_end(force_N)
    place = np.arange(end + 1) / POINTS_PER_DEG
    ramp = min(RAMP_DEG, place[-1] / 2)
    if ramp == 0:
        return force_N.copy()
    share = np.minimum(1.0, np.minimum(place, place[-1] - place) / ramp)
    # farther than the ramp is long, two angles would change their order
    moved = place + float(np.clip(amount, -0.9 * ramp, 0.9 * ramp)) * share
    changed = force_N.copy()
    changed[: end + 1] = np.interp(place, moved, force_N[: end + 1])
    return changed


def smoothing(force_N: Array, amount: float, draw: np.random.Generator) -> Array:
    """Return the profile (621,) smoothed by a moving average of `amount` degrees along a random stretch of 20."""
    end = motion_end(force_N)
    points = 2 * round(amount * POINTS_PER_DEG / 2) + 1
    moving = force_N[: end + 1]
    padded = np.pad(moving, points // 2, mode="edge")
    average = np.convolve(padded, np.full(points, 1 / points), mode="valid")
    middle = draw.uniform(0.0, 1.0) * end / POINTS_PER_DEG
    away = np.abs(np.arange(end + 1) / POINTS_PER_DEG - middle) / (SMOOTHED_DEG / 2)
    share = np.clip(2 * (1 - away), 0.0, 1.0)
    share[0] = 0.0
    changed = force_N.copy()
    changed[: end + 1] = moving + share * (average - moving)
    return changed


def amplitude(force_N: Array, amount: float, _draw: np.random.Generator) -> Array:
    """Return the profile (621,) with every force `amount` percent greater."""
    return force_N * (1 + amount / 100)


def spike(force_N: Array, amount: float, draw: np.random.Generator) -> Array:
    """Return the profile (621,) with a raised cosine of `amount` newtons and 1 degree at a random angle."""
    end = motion_end(force_N)
    reach = SPIKE_DEG / 2
    middle = draw.uniform(reach, max(reach, end / POINTS_PER_DEG - reach))
    away = np.abs(np.arange(end + 1) / POINTS_PER_DEG - middle) / reach
    changed = force_N.copy()
    changed[: end + 1] += np.where(away < 1, amount / 2 * (1 + np.cos(np.pi * away)), 0.0)
    return changed


def motion_end(force_N: Array) -> int:
    """Return the index of the last force before the zeros behind the motion; the last of all where all are 0."""
    moving = np.flatnonzero(force_N)
    return int(moving[-1]) if moving.size else len(force_N) - 1


@dataclass(frozen=True)
class Kind:
    """A change, whose amount is drawn uniformly between `least` and `most`, and the assumed effect of a unit of it.

    `effect` is in percent of the scale's length, toward an attribute's second word where it is above 0; attributes
    that it does not name keep their ratings. The adjustment is the amount times the effect.
    """

    name: str
    change: Change
    unit: str
    least: float
    most: float
    effect: Mapping[str, float]


KINDS = (
    Kind("noise", noise, "N (SD)", 0.02, 0.10,
         {"Consistent": 3.0, "Pleasant": 1.0, "New": 2.0, "Luxurious": 1.0}),
    Kind("shift", shift, "deg later", -1.0, 1.0, {"Easy-to-pull": -0.3, "Comfort": -0.2}),
    Kind("smoothing", smoothing, "deg", 0.5, 2.0,
         {"Damped": -0.2, "Consistent": -0.4, "Pleasant": -0.2, "New": -0.4, "Luxurious": -0.2}),
    Kind("amplitude", amplitude, "%", -5.0, 5.0,
         {"Easy-to-pull": 0.6, "Damped": 0.3, "Consistent": 0.1, "Pleasant": 0.2, "New": 0.2, "Comfort": 0.4,
          "Luxurious": 0.1}),
    Kind("spike", spike, "N", 0.5, 2.0,
         {"Damped": 0.1, "Consistent": 0.6, "Pleasant": 0.2, "New": 0.2, "Comfort": 0.1, "Luxurious": 0.2}),
)  # fmt: skip


def with_variants(data: DoorData, seed: int = 0) -> DoorData:
    """Return the data, and after it the five training variants of every stimulus: 90 rows become 540.

    A variant has its stimulus' source, door, variant, raters and SD; its name is the stimulus', `~` and the change's.
    The amounts depend on the seed, the stimulus' name and the change only. Ratings stay on the study's scale. Raises
    ModelDataError on data that holds training variants already.
    """
    if variant := next((name for name in data.ids if is_variant(name)), None):
        raise ModelDataError(f"{variant} is a training variant already: give the stimuli as they were rated")
    count = len(data)
    every = data.rows(np.concatenate([np.arange(count), np.repeat(np.arange(count), len(KINDS))]))
    low, high = data.scale
    forces, ratings = [], []
    for row in range(count):
        for kind in KINDS:
            draw = np.random.Generator(np.random.PCG64(keyed_bits("training variant", seed, data.ids[row], kind.name)))
            amount = float(draw.uniform(kind.least, kind.most))
            effect = np.array([kind.effect.get(name, 0.0) for name in data.attributes])
            forces.append(kind.change(data.force_N[row], amount, draw))
            ratings.append(np.clip(data.rating[row] + effect * amount / 100 * (high - low), low, high))
    return replace(
        every,
        ids=(*data.ids, *(f"{name}{MARK}{kind.name}" for name in data.ids for kind in KINDS)),
        force_N=np.concatenate([data.force_N, forces]),
        rating=np.concatenate([data.rating, ratings]),
        made_from=(*data.made_from, f"{len(KINDS)} training variants of each stimulus, seed {seed}"),
    )


def is_variant(name: str) -> bool:
    """Return whether this is the name of a training variant."""
    stimulus, mark, kind = name.rpartition(MARK)
    return bool(stimulus and mark) and kind in {variant.name for variant in KINDS}
