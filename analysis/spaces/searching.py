"""Many starts for a map of least stress, since each leads down to a minimum of its own neighbourhood only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from palpate.analysis.spaces.descent import at_rest, classical_start, improved
from palpate.analysis.spaces.isotone import Order
from palpate.analysis.spaces.orienting import principal, unit_size
from palpate.analysis.statistics.doubles import Floats

REFINED, SETTLING = 3000, 500
LOWER = 1e-9


@dataclass(frozen=True)
class Searched:
    """The best map, its stress, the stress of every start (the classical one first), and whether a hop bettered it."""

    points: Floats
    stress: float
    starts: tuple[float, ...]
    hopped: bool


def searched(between: Floats, dimensions: int, order: Order, starts: int, hops: int, rng: Generator) -> Searched:
    """The lowest of the classical start, `starts` random ones and `hops` displacements from the best of these."""
    begun = [classical_start(between, dimensions)]
    begun += [_from_above(len(between), dimensions, order, rng) for _ in range(starts)]
    tried = [improved(each, order, 40 if i == 0 else 10, 50) for i, each in enumerate(begun)]
    stresses = [stress for _, stress in tried]
    points, stress = tried[int(np.argmin(stresses))]
    for _ in range(hops):
        moved, reached = improved(_displaced(points, rng), order, 5, 40)
        if reached < stress - LOWER:
            points, stress = moved, reached
    hopped = stress < min(stresses)
    points, stress = improved(points, order, 0, REFINED)
    return Searched(at_rest(points, order, SETTLING), stress, tuple(stresses), hopped)


def _from_above(objects: int, dimensions: int, order: Order, rng: Generator) -> Floats:
    """A random map of one dimension more, led downhill and seen along its smallest axis: objects can pass each other.

    Borg & Groenen 2005, 13.3, on local minima in few dimensions.
    """
    found, _ = improved(rng.standard_normal((objects, dimensions + 1)), order, 15, 20)
    return principal(found)[:, :dimensions]


def _displaced(points: Floats, rng: Generator) -> Floats:
    """The map with two objects exchanged, or with one put anywhere."""
    moved: Floats = unit_size(points - points.mean(axis=0)).copy()
    if rng.random() < 0.5:
        pair = rng.choice(len(moved), 2, replace=False)
        moved[pair] = moved[pair[::-1]]
    else:
        moved[rng.integers(len(moved))] = rng.standard_normal(moved.shape[1])
    return moved
