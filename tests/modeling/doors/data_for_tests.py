"""Door data of random numbers, for tests that need no lab."""

from __future__ import annotations

import numpy as np

from palpate.modeling.doors.data import DoorData
from palpate.modeling.doors.rated import merged_sources

ATTRIBUTES = ("Easy-to-pull", "Damped", "Consistent", "Pleasant", "New", "Comfort", "Luxurious")
ANTONYMS = ("Hard-to-pull", "Recoiling", "Stepwise", "Unpleasant", "Old", "Discomfort", "Cheap")


def random_doors(places, *, same=(), seed=1):
    """A stimulus for each (door, variant); in each set of rows in `same` all have one profile. Forces of 0 to 60 N."""
    draw = np.random.default_rng(seed)
    ids = tuple(f"{door}_{variant}#{n}" for n, (door, variant) in enumerate(places))
    angle = np.linspace(0, np.pi, 621)
    force = np.array([30 * np.sin(k * angle) + level for k, level in draw.uniform(0, 30, (len(ids), 2))])
    for rows in same:
        force[list(rows)] = force[rows[0]]
    rating = draw.uniform(-8, 8, (len(ids), 7))
    return DoorData(
        attributes=ATTRIBUTES, antonyms=ANTONYMS, scale=(-10.0, 10.0), ids=ids,
        doors=tuple(door for door, _ in places), variants=tuple(variant for _, variant in places),
        source=merged_sources(ids, force), groups=("1",) * len(ids), force_N=force, rating=rating,
        sd=np.ones_like(rating), raters=np.full(len(ids), 20), simulated=True,
    )  # fmt: skip


def crossed(doors, variants, **how):
    """Every door in every variant."""
    return random_doors([(f"D{d}", f"g{v}") for d in range(doors) for v in range(variants)], **how)
