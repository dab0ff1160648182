"""Non-metric multidimensional scaling: a map whose distances follow the order of the dissimilarities.

Also its stress by number of dimensions, and against dissimilarities in random order.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.random import Generator
from scipy.spatial.distance import pdist, squareform

from palpate.analysis.spaces.classical import check_dimensions
from palpate.analysis.spaces.dissimilarities import Dissimilarities
from palpate.analysis.spaces.matrices import frame_of, principal, unit_size
from palpate.analysis.spaces.stress import (
    Order,
    Ties,
    classical_start,
    disparities,
    minimise_stress,
    order_of,
    refine_map,
)
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.draws import check_draws, p_of_draws, stream
from palpate.analysis.statistics.refusals import BadOption, listed, refuse_idle, shown

HOPS_PER_START = 3
EXACT = 1e-4
ALIKE = 1e-4
COLLAPSED = 1e-3  # of the root mean square distance from the centroid
STEP = 1e-3  # of the largest disparity: smaller ones belong to the same step
ZERO = 1e-3
FEW_STEPS = 3
POINTS_PER_DIMENSION = 4
REFINED, SETTLING = 3000, 500
LOWER = 1e-9
ENOUGH = 40  # steps: the last digits of a stress do not matter beside its spread over shuffles


@dataclass(frozen=True)
class NonMetric:
    """`points` (objects x `Dim1`, ...) with a root mean square distance of 1 from their centroid; `stress` formula 1.

    `starts` has every start's stress, the classical one first, and `reached` is how many came within 1e-4 of the best.
    `shepard` has one row per pair: a, b, dissimilarity, distance, disparity. `degenerate` says that the map shows a
    flaw of the fit rather than of the objects (see the notes).
    """

    points: pd.DataFrame
    stress: float
    starts: tuple[float, ...]
    reached: int
    shepard: pd.DataFrame
    ties: Ties
    degenerate: bool
    notes: tuple[str, ...] = ()


def nonmetric_mds(
    between: Dissimilarities, dimensions: int = 2, ties: Ties = "primary", starts: int = 20, seed: int = 0
) -> NonMetric:
    """Return the map of least stress-1 from the classical start, `starts` random ones and 3 x `starts` hops.

    Each is improved by majorisation (SMACOF) and then by a quasi-Newton descent of stress itself, with new disparities
    at every step. Ties: "primary" or "secondary" (see `isotone.Order`). Raises BadOption. Sources: Kruskal 1964a, b; de
    Leeuw 1977 (majorisation); Wales & Doye 1997 (hops).
    """
    check_dimensions(dimensions, len(between.labels))
    order = checked_order(between, ties)
    if isinstance(starts, bool) or not isinstance(starts, int) or starts < 0:
        raise BadOption(f"starts={shown(starts)}: expected a whole number from 0")
    if not starts:
        refuse_idle("seed", seed, 0, "with starts=0: the classical start is not random")
    rng = stream(seed, f"starts in {dimensions} dimensions")
    best = search_maps(between.values, dimensions, order, starts, HOPS_PER_START * starts, rng)
    points = unit_size(principal(best.points))
    fitted = disparities(pdist(points), order)
    flaws = degeneracies(points, fitted, order, best.stress, between.labels)
    first, second = np.triu_indices(len(between.labels), 1)
    shepard = pd.DataFrame(
        {
            "a": [between.labels[i] for i in first.tolist()],
            "b": [between.labels[i] for i in second.tolist()],
            "dissimilarity": squareform(between.values, checks=False),
            "distance": pdist(points),
            "disparity": fitted,
        }
    )
    return NonMetric(
        frame_of(points, between.labels, [f"Dim{i + 1}" for i in range(dimensions)]),
        best.stress,
        best.starts,
        sum(stress <= best.stress + ALIKE for stress in best.starts),
        shepard,
        ties,
        bool(flaws),
        (*between.notes, *_rare(best), *too_few_points(len(points), dimensions), *flaws),
    )


def _rare(best: Searched) -> list[str]:
    """Return warnings: on places that can move, or a best map that only a hop reached."""
    if best.stress < EXACT:
        return ["stress is 0: the order of the pairs is met exactly, so places can move without cost"]
    if not best.hopped or min(best.starts) <= best.stress + ALIKE:
        return []
    return ["the best map was reached from none of the starts, only by hops from the best of them: ask for more starts"]


def checked_order(between: Dissimilarities, ties: Ties) -> Order:
    """Return the order of the dissimilarities. Raises BadOption for an unknown treatment of ties, or no order."""
    if not isinstance(ties, str) or ties not in ("primary", "secondary"):
        raise BadOption(f"ties={shown(ties)} is unknown: 'primary' or 'secondary'")
    order = order_of(squareform(between.values, checks=False), ties)
    if len(order.sizes) < 2:
        raise BadOption("every pair is equally dissimilar: there is no order that a map could follow")
    return order


def too_few_points(points: int, dimensions: int) -> list[str]:
    """Return a note by Kruskal and Wish's rule (1978, p. 34): more than four objects for each dimension."""
    if points > POINTS_PER_DIMENSION * dimensions:
        return []
    return [
        f"{points} objects in {dimensions} dimensions: stress is low for any data; "
        f"expected more than {POINTS_PER_DIMENSION * dimensions} objects (Kruskal & Wish 1978)"
    ]


def degeneracies(
    points: Floats, fitted: Floats, order: Order, stress: float, labels: tuple[Hashable, ...]
) -> list[str]:
    """Return what is degenerate about a map of unit size, as text; empty if nothing is."""
    messages = []
    # Pairs of coinciding points whose dissimilarity is not the smallest one.
    near = (pdist(points) < COLLAPSED) & (order.rank > 0)
    first, second = np.triu_indices(len(points), 1)
    together = list(zip(first[near].tolist(), second[near].tolist(), strict=True))
    if together:
        pairs = listed((f"{labels[i]!r} and {labels[j]!r}" for i, j in together), len(together))
        messages.append(f"degenerate: different objects share a place ({pairs}): the map shows clusters only")
    steps = 1 + int((np.diff(np.sort(fitted)) > STEP * fitted.max()).sum())
    if steps <= FEW_STEPS < len(order.sizes):
        messages.append(f"degenerate: {len(order.sizes)} ranks of dissimilarity became {steps} steps of distance")
    if stress < ZERO and too_few_points(*points.shape):
        messages.append("degenerate: stress is nearly 0, so the order of the pairs does not determine the places")
    return messages


@dataclass(frozen=True)
class Searched:
    """The best map, its stress, the stress of every start (the classical one first), and whether a hop improved it."""

    points: Floats
    stress: float
    starts: tuple[float, ...]
    hopped: bool


def search_maps(between: Floats, dimensions: int, order: Order, starts: int, hops: int, rng: Generator) -> Searched:
    """Return the best map from the classical start, `starts` random ones and `hops` displacements of the best."""
    starting = [classical_start(between, dimensions)]
    for _ in range(starts):
        # A random map of one dimension more, led downhill and seen along its smallest axis: objects can pass each
        # other there (Borg & Groenen 2005, 13.3, on local minima in few dimensions).
        higher, _stress = minimise_stress(rng.standard_normal((len(between), dimensions + 1)), order, 15, 20)
        starting.append(principal(higher)[:, :dimensions])
    tried = [minimise_stress(start, order, 40 if i == 0 else 10, 50) for i, start in enumerate(starting)]
    stresses = [stress for _, stress in tried]
    points, stress = tried[int(np.argmin(stresses))]
    for _ in range(hops):
        # Two objects exchanged, or one put anywhere.
        displaced: Floats = unit_size(points - points.mean(axis=0)).copy()
        if rng.random() < 0.5:
            pair = rng.choice(len(displaced), 2, replace=False)
            displaced[pair] = displaced[pair[::-1]]
        else:
            displaced[rng.integers(len(displaced))] = rng.standard_normal(displaced.shape[1])
        moved, reached = minimise_stress(displaced, order, 5, 40)
        if reached < stress - LOWER:
            points, stress = moved, reached
    hopped = stress < min(stresses)
    points, stress = minimise_stress(points, order, 0, REFINED)
    return Searched(refine_map(points, order, SETTLING), stress, tuple(stresses), hopped)


@dataclass(frozen=True)
class StressReference:
    """The stress of dissimilarities in random order, from the same single start as `observed`, and its p."""

    observed: float
    mean: float
    quantile_05: float
    p: float
    draws: int


def stress_scree(
    between: Dissimilarities,
    most: int = 5,
    ties: Ties = "primary",
    starts: int = 4,
    seed: int = 0,
    known: NonMetric | None = None,
) -> pd.DataFrame:
    """Return the least stress-1 in 1, 2, ... dimensions, at most `most` and objects - 2: dimensions, stress, reached.

    `starts` counts each row's starts. A `known` map is not computed again.
    """
    last = max(1, min(most, len(between.labels) - 2))
    held = {} if known is None else {known.points.shape[1]: known}
    maps = [held.get(k) or nonmetric_mds(between, k, ties, starts, seed if starts else 0) for k in range(1, last + 1)]
    return pd.DataFrame(
        {
            "dimensions": range(1, last + 1),
            "stress": [result.stress for result in maps],
            "reached": [result.reached for result in maps],
            "starts": [len(result.starts) for result in maps],
        }
    )


def stress_reference(
    between: Dissimilarities, dimensions: int = 2, ties: Ties = "primary", draws: int = 99, seed: int = 0
) -> StressReference:
    """Compare stress-1 with that of the same dissimilarities shuffled over the pairs; p: "no structure at all".

    Both the observed and each shuffled table start from Torgerson's map alone, so that neither is searched more
    thoroughly. Sources: Spence & Ogilvie 1973; Mair, Borg & Rusch 2016 (permutation).
    """
    check_draws(draws)
    checked_order(between, ties)
    pairs = squareform(between.values, checks=False)
    rng = stream(seed, f"stress in {dimensions} dimensions")
    observed = _one_start(pairs, dimensions, ties)
    random = np.array([_one_start(rng.permutation(pairs), dimensions, ties) for _ in range(draws)])
    reached = int((random <= observed * (1 + 1e-12)).sum())
    return StressReference(
        observed, float(random.mean()), float(np.quantile(random, 0.05)), p_of_draws(reached, draws), draws
    )


def _one_start(pairs: Floats, dimensions: int, ties: Ties) -> float:
    return minimise_stress(classical_start(squareform(pairs), dimensions), order_of(pairs, ties), polished=ENOUGH)[1]
