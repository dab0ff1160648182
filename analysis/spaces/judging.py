"""How low a stress is: by number of dimensions, and against dissimilarities in random order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.spatial.distance import squareform

from palpate.analysis.spaces.descent import classical_start, improved
from palpate.analysis.spaces.dissimilarities import Dissimilarities
from palpate.analysis.spaces.draws import check_draws, p_of_draws, stream
from palpate.analysis.spaces.isotone import Ties, order_of
from palpate.analysis.spaces.nonmetric import NonMetric, checked_order, nonmetric_mds
from palpate.analysis.statistics.doubles import Floats

ENOUGH = 40  # steps: the last digits of a stress do not matter beside its spread over shuffles


@dataclass(frozen=True)
class StressReference:
    """The stress of dissimilarities in random order, from the same single start as `observed`, and the p of it."""

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
    """The least stress-1 found in 1, 2, ... dimensions, at most `most` and objects - 2: dimensions, stress, reached.

    `starts` counts each row's starts. A map that is `known` already is not looked for again.
    """
    last = max(1, min(most, len(between.labels) - 2))
    held = {} if known is None else {known.points.shape[1]: known}
    found = [held.get(k) or nonmetric_mds(between, k, ties, starts, seed if starts else 0) for k in range(1, last + 1)]
    return pd.DataFrame(
        {
            "dimensions": range(1, last + 1),
            "stress": [each.stress for each in found],
            "reached": [each.reached for each in found],
            "starts": [len(each.starts) for each in found],
        }
    )


def stress_reference(
    between: Dissimilarities, dimensions: int = 2, ties: Ties = "primary", draws: int = 99, seed: int = 0
) -> StressReference:
    """Stress-1 against that of the same dissimilarities shuffled over the pairs; p is that of "no structure at all".

    Both the observed and each shuffled table start from Torgerson's map alone, so that neither is looked for harder.
    Sources: Spence & Ogilvie 1973; Mair, Borg & Rusch 2016 (permutation).
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
    return improved(classical_start(squareform(pairs), dimensions), order_of(pairs, ties), polished=ENOUGH)[1]
