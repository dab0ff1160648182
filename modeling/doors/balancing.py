"""Dealing indivisible groups of rows into parts so that every label is spread as evenly as can be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import block_array, csr_array, eye_array, kron

from palpate.modeling.doors.data import ModelDataError
from palpate.signals.arrays import Indices

MOST_NODES = 40
"""Where the search for a perfect balance stops and the best one found is taken. It is a count and no time, so that a
slow machine finds what a fast one finds. The study's 90 profiles need none beyond the first."""
ROUNDING = 1e-9

Counts = NDArray[np.int64]


def balanced(counts: Counts, weight: Sequence[float], shares: Sequence[float]) -> Indices:
    """The part (0, 1, ...) of each group; `shares` are how much of everything each part should get, 1 in all.

    `counts` is (labels, groups): how many rows with each label a group holds. A label's rows are well spread where
    every part gets its share of them, rounded down or up; minimised is the sum of what falls outside that, each label
    by its `weight`. No part stays empty. It is an integer programme, solved by HiGHS (Huangfu and Hall 2018).
    Raises ModelDataError where there are fewer groups than parts.
    """
    labels, groups = counts.shape
    parts = len(shares)
    if groups < parts:
        raise ModelDataError(f"{groups} sources cannot be dealt into {parts} parts without leaving one empty")
    wanted = np.outer(counts.sum(axis=1), shares).ravel()
    spread = kron(csr_array(counts.astype(np.float64)), eye_array(parts))
    slack = eye_array(labels * parts)
    rows = [
        [kron(eye_array(groups), np.ones((1, parts))), None],  # each group lies in one part
        [kron(np.ones((1, groups)), eye_array(parts)), None],  # no part is empty
        [spread, -slack],
        [spread, slack],
    ]
    low = np.r_[np.ones(groups + parts), np.full(len(wanted), -np.inf), np.floor(wanted + ROUNDING)]
    high = np.r_[np.ones(groups), np.full(parts, np.inf), np.ceil(wanted - ROUNDING), np.full(len(wanted), np.inf)]
    chosen = groups * parts
    found = milp(
        np.r_[np.zeros(chosen), np.repeat(np.asarray(weight, dtype=np.float64), parts)],
        integrality=np.r_[np.ones(chosen), np.zeros(len(wanted))],
        bounds=Bounds(0, np.r_[np.ones(chosen), np.full(len(wanted), np.inf)]),
        constraints=LinearConstraint(block_array(rows, format="csr"), low, high),
        options={"node_limit": MOST_NODES},
    )
    if found.x is None:
        raise ModelDataError(f"no split was found ({found.message}); ask for fewer folds")
    return np.asarray(found.x[:chosen].reshape(groups, parts).argmax(axis=1), dtype=np.int64)
