"""Non-metric multidimensional scaling: a map whose distances follow the order of the dissimilarities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.spatial.distance import pdist, squareform

from palpate.analysis.spaces.classical import check_dimensions
from palpate.analysis.spaces.degenerate import degeneracies, too_few_points
from palpate.analysis.spaces.dissimilarities import Dissimilarities
from palpate.analysis.spaces.draws import stream
from palpate.analysis.spaces.isotone import Order, Ties, disparities, order_of
from palpate.analysis.spaces.matrices import frame_of
from palpate.analysis.spaces.orienting import principal, unit_size
from palpate.analysis.spaces.searching import Searched, searched
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadOption, refuse_idle, shown

HOPS_PER_START = 3
EXACT = 1e-4
ALIKE = 1e-4


@dataclass(frozen=True)
class NonMetric:
    """`points` (objects x `Dim1`, ...) with a root mean square distance of 1 from their centroid; `stress` formula 1.

    `starts` holds every start's stress, the classical one first, and `reached` how many of them came within 1e-4 of the
    best. `shepard` has one row per pair: a, b, dissimilarity, distance, disparity. `degenerate` says that the map shows
    a flaw of the fit rather than of the objects (see the notes).
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
    """The map of least stress-1 over the classical start, `starts` random ones and 3 x `starts` hops from the best.

    Each is improved by majorisation (SMACOF) and then by a quasi-Newton descent of stress itself, with the
    disparities renewed at every step. Ties: "primary" or "secondary" (see `isotone.Order`).
    Raises BadOption. Sources: Kruskal 1964a, b; de Leeuw 1977 (majorisation); Wales & Doye 1997 (hops).
    """
    check_dimensions(dimensions, len(between.labels))
    order = checked_order(between, ties)
    if isinstance(starts, bool) or not isinstance(starts, int) or starts < 0:
        raise BadOption(f"starts={shown(starts)}: expected a whole number from 0")
    if not starts:
        refuse_idle("seed", seed, 0, "with starts=0: the classical start is not random")
    rng = stream(seed, f"starts in {dimensions} dimensions")
    found = searched(between.values, dimensions, order, starts, HOPS_PER_START * starts, rng)
    points = unit_size(principal(found.points))
    fitted = disparities(pdist(points), order)
    flaws = degeneracies(points, fitted, order, found.stress, between.labels)
    return NonMetric(
        frame_of(points, between.labels, [f"Dim{i + 1}" for i in range(dimensions)]),
        found.stress,
        found.starts,
        sum(stress <= found.stress + ALIKE for stress in found.starts),
        _shepard(between, pdist(points), fitted),
        ties,
        bool(flaws),
        (*between.notes, *_rare(found), *too_few_points(len(points), dimensions), *flaws),
    )


def _rare(found: Searched) -> list[str]:
    """A word of caution: places that can move, or a best map that only a hop, no start by itself, found."""
    if found.stress < EXACT:
        return ["stress is 0: the order of the pairs is met exactly, so places can move without cost"]
    if not found.hopped or min(found.starts) <= found.stress + ALIKE:
        return []
    return ["the best map was reached from none of the starts, only by hops from the best of them: ask for more starts"]


def checked_order(between: Dissimilarities, ties: Ties) -> Order:
    """The order of the dissimilarities; refuses an unknown treatment of ties and a table that has no order."""
    if not isinstance(ties, str) or ties not in ("primary", "secondary"):
        raise BadOption(f"ties={shown(ties)} is unknown: 'primary' or 'secondary'")
    order = order_of(squareform(between.values, checks=False), ties)
    if len(order.sizes) < 2:
        raise BadOption("every pair is equally dissimilar: there is no order that a map could follow")
    return order


def _shepard(between: Dissimilarities, distances: Floats, fitted: Floats) -> pd.DataFrame:
    first, second = np.triu_indices(len(between.labels), 1)
    return pd.DataFrame(
        {
            "a": [between.labels[i] for i in first.tolist()],
            "b": [between.labels[i] for i in second.tolist()],
            "dissimilarity": squareform(between.values, checks=False),
            "distance": distances,
            "disparity": fitted,
        }
    )
