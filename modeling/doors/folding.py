"""Splits of the data into training and test rows that have no source in common (thesis 5.5.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import block_array, csr_array, eye_array, kron

from palpate.modeling.doors.data import DoorData, rows_by_label, source_groups
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.keyed import shuffled
from palpate.protocols.wording import count
from palpate.signals.arrays import Indices

Kinds = Literal["grouped", "leave_one_door_out", "leaky"]
KINDS: tuple[Kinds, ...] = ("grouped", "leave_one_door_out", "leaky")
WEIGHT = {"door": 4.0, "variant": 1.0, "row": 2.0}
"""The cost of an uneven spread by label: doors before fold sizes before variants."""
LEAST_SOURCES = 2
"""The least number of sources to train on in every split: with one, all ratings of an attribute are equal."""
MOST_NODES = 40
"""The number of nodes at which the search for a perfect balance stops with the best one so far.

It is a count, not a time, so that slow and fast machines give the same result. The study's 90 profiles need none beyond
the first.
"""
ROUNDING = 1e-9
Counts = NDArray[np.int64]


@dataclass(frozen=True)
class Fold:
    """One split: the rows to train on and the rows to test on, each in the data's order."""

    name: str
    train: Indices
    test: Indices


def folds(data: DoorData, k: int = 5, kind: Kinds = "grouped", seed: int = 0) -> tuple[Fold, ...]:
    """Return the splits of the data.

    `grouped`: k folds; no source, and no (nearly) identical profile, lies on both sides; every row is tested once; each
    door and each variant is spread over the folds as evenly as whole sources can be. `leave_one_door_out`: a fold for
    each door; stimuli that share a source with it are left out of both sides. `leaky`: rows are assigned whatever their
    source, as in the thesis: with training variants, those of one stimulus lie on both sides. Row order does not
    matter. Raises ModelDataError where a training side would have fewer than two sources.
    """
    if kind not in KINDS:
        raise ModelDataError(f"no split is called {kind!r}; {nearest(kind, KINDS)}")
    groups = source_groups(data)
    if kind == "leave_one_door_out":
        folds = []
        for door in sorted(set(data.doors)):
            test = np.array([name == door for name in data.doors])
            folds.append(_fold(door, ~np.isin(groups, groups[test]), test))
    else:
        if k < 2:
            raise ModelDataError(
                f"{count(k, 'fold')}: at least 2 are expected, one to test on and the others to train on"
            )
        parts = _assign_parts(data, np.arange(len(data)) if kind == "leaky" else groups, [1 / k] * k, seed)
        folds = [_fold(f"fold {place + 1}", parts != place, parts == place) for place in range(k)]
    for fold in folds:
        _demand_enough(fold, groups, kind)
    return tuple(folds)


def held_share(train: DoorData, share: float = 0.15, seed: int = 0) -> tuple[Indices, Indices]:
    """Return the rows to learn from and those held out to stop early, in the data's order: no source on both sides.

    About `share` of the rows is held, balanced over doors and variants, at least one source. Raises ModelDataError on
    an invalid share, and on fewer than three sources.
    """
    if not 0 < share < 1:
        raise ModelDataError(f"a share of {share:g} cannot be held back: a number between 0 and 1 is expected")
    groups = source_groups(train)
    if len(set(groups.tolist())) <= LEAST_SOURCES:
        raise ModelDataError(f"{_source_count(groups)}: none can be held back; at least {LEAST_SOURCES + 1} are needed")
    parts = _assign_parts(train, groups, [1 - share, share], seed)
    fold = _fold("held", parts == 0, parts == 1)
    _demand_enough(fold, groups, "held back")
    return fold.train, fold.test


def _assign_parts(data: DoorData, groups: Indices, shares: Sequence[float], seed: int) -> Indices:
    """Return the part of each row (n,), one for all rows of a group; it depends on names and seed, not on row order."""
    members = {"\0".join(sorted(data.ids[row] for row in rows)): rows for rows in rows_by_label(groups).values()}
    order = shuffled(members, "folds", seed)
    labels = [f"{what}\0{name}" for what, names in _labels(data) for name in shuffled(set(names), "labels", seed, what)]
    place = {label: row for row, label in enumerate(labels)}
    counts = np.zeros((len(labels), len(order)), dtype=np.int64)
    for column, name in enumerate(order):
        for row in members[name]:
            for what, names in _labels(data):
                counts[place[f"{what}\0{names[row]}"], column] += 1
    part = balanced(counts, [WEIGHT[label.partition("\0")[0]] for label in labels], shares)
    result = np.empty(len(data), dtype=np.int64)
    for column, name in enumerate(order):
        result[members[name]] = part[column]
    return result


def _labels(data: DoorData) -> tuple[tuple[str, Sequence[str]], ...]:
    """Return the labels that are spread evenly: doors, variants, and the rows themselves."""
    return ("door", data.doors), ("variant", data.variants), ("row", [""] * len(data))


def _fold(name: str, train: NDArray[np.bool_], test: NDArray[np.bool_]) -> Fold:
    return Fold(name, np.flatnonzero(train).astype(np.int64), np.flatnonzero(test).astype(np.int64))


def _demand_enough(fold: Fold, groups: Indices, kind: str) -> None:
    left = groups[fold.train]
    if len(set(left.tolist())) < LEAST_SOURCES:
        raise ModelDataError(
            f"{kind}, {fold.name}: {_source_count(left)} would be left to train on; at least {LEAST_SOURCES} are"
            " needed: collect more stimuli, or ask for other folds"
        )


def _source_count(groups: Indices) -> str:
    count = len(set(groups.tolist()))
    return f"{count} source" if count == 1 else f"{count} sources"


def balanced(counts: Counts, weight: Sequence[float], shares: Sequence[float]) -> Indices:
    """Return the part (0, 1, ...) of each group; `shares` are how much of everything each part should get, 1 in all.

    `counts` is (labels, groups): how many rows with each label a group holds. A label's rows are well spread where
    every part gets its share of them, rounded down or up; the sum of all deviations from that, each label's by its
    `weight`, is minimised. No part stays empty. It is an integer programme, solved by HiGHS (Huangfu and Hall 2018).
    Raises ModelDataError where there are fewer groups than parts.
    """
    labels, groups = counts.shape
    parts = len(shares)
    if groups < parts:
        raise ModelDataError(f"{groups} sources cannot be dealt into {parts} parts without leaving one empty")
    targets = np.outer(counts.sum(axis=1), shares).ravel()
    spread = kron(csr_array(counts.astype(np.float64)), eye_array(parts))
    slack = eye_array(labels * parts)
    rows = [
        [kron(eye_array(groups), np.ones((1, parts))), None],  # each group lies in one part
        [kron(np.ones((1, groups)), eye_array(parts)), None],  # no part is empty
        [spread, -slack],
        [spread, slack],
    ]
    low = np.r_[np.ones(groups + parts), np.full(len(targets), -np.inf), np.floor(targets + ROUNDING)]
    high = np.r_[np.ones(groups), np.full(parts, np.inf), np.ceil(targets - ROUNDING), np.full(len(targets), np.inf)]
    chosen = groups * parts
    solution = milp(
        np.r_[np.zeros(chosen), np.repeat(np.asarray(weight, dtype=np.float64), parts)],
        integrality=np.r_[np.ones(chosen), np.zeros(len(targets))],
        bounds=Bounds(0, np.r_[np.ones(chosen), np.full(len(targets), np.inf)]),
        constraints=LinearConstraint(block_array(rows, format="csr"), low, high),
        options={"node_limit": MOST_NODES},
    )
    if solution.x is None:
        raise ModelDataError(f"no split was found ({solution.message}); ask for fewer folds")
    return np.asarray(solution.x[:chosen].reshape(groups, parts).argmax(axis=1), dtype=np.int64)
