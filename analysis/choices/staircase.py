"""Staircases: the rule that was followed, the reversals, and the threshold."""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from palpate.analysis.statistics.cells import check_columns, numbers_of
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadOption, BadValue, NoEstimate, TooFew, shown

MOST_IN_A_ROW = 5
FOLLOWED = 0.9  # of the moves: below, the rule counts as unknown


@dataclass(frozen=True)
class Rule:
    """An up-down rule: the level goes down (harder) after `down` hits in a row, up after `up` misses in a row.

    `down_step` and `up_step` are the usual sizes of a move. `converges_at` is the share of hits to which the staircase
    converges. `followed` is the share of trials that the rule explains.
    """

    down: int
    up: int
    down_step: float
    up_step: float
    converges_at: float
    followed: float


@dataclass(frozen=True)
class Staircase:
    """The result: `reversals` (trial, level, kind "peak" or "valley", used) and `threshold`, the mean of the used ones.

    `spread` is the standard deviation of the used reversals (n - 1); neighbours depend on each other, so it is no
    standard error. `rule` is None if none explains the trials. Trials count from 1.
    """

    reversals: pd.DataFrame
    threshold: float
    spread: float
    used: int
    rule: Rule | None
    notes: tuple[str, ...] = ()


def staircase(
    data: pd.DataFrame, level: Hashable, correct: Hashable, order: Hashable | None = None, last: int = 6
) -> Staircase:
    """Return the threshold of one staircase from its last `last` reversals (rows in order of trials, or by `order`).

    An even number is used, so that peaks and valleys balance. Higher levels must be easier; negate the levels if they
    are not. Raises TooFew for fewer than two reversals, NoEstimate where the level never changes, BadValue. Source:
    Levitt 1971.
    """
    if isinstance(last, bool) or not isinstance(last, int) or last < 2 or last % 2:
        raise BadOption(f"last={shown(last)}: expected an even number of reversals from 2")
    check_columns(data, [level, correct] if order is None else [level, correct, order])
    levels, hits = (numbers_of(data[name], name) for name in (level, correct))
    for name, values in ((level, levels), (correct, hits)):
        if np.isnan(values).any():
            row = int(np.flatnonzero(np.isnan(values))[0]) + 1
            raise BadValue(f"column {name!r} has no value in row {row}; a staircase needs every trial")
    if not np.isin(hits, (0, 1)).all():
        raise BadValue(f"column {correct!r} must be 0 or 1 (or true and false) in each trial of a staircase")
    if order is not None:
        # The rows in order of the trials.
        numbers = numbers_of(data[order], order)
        if len(np.unique(numbers)) != len(numbers) or np.isnan(numbers).any():
            raise BadValue(f"column {order!r} does not give each trial its own position; is this one staircase?")
        sorting = np.argsort(numbers)
        levels, hits = levels[sorting], hits[sorting]
    if not np.diff(levels).any():
        raise NoEstimate(f"the level is {levels[0]:g} in all {len(levels)} trials: this is not a staircase")
    moves = np.diff(levels)
    steps = np.flatnonzero(moves)
    turns = np.flatnonzero(np.sign(moves[steps[1:]]) != np.sign(moves[steps[:-1]]))
    places = steps[turns + 1]
    kinds = np.where(moves[steps[turns]] > 0, "peak", "valley")
    table = pd.DataFrame({"trial": places + 1, "level": levels[places], "kind": kinds})
    if len(table) < 2:
        raise TooFew(f"{len(table)} reversals in {len(levels)} trials; a threshold needs two or more")
    used = min(last, len(table) - len(table) % 2)
    table["used"] = np.arange(len(table)) >= len(table) - used
    chosen = table.loc[table["used"], "level"]
    rule = explaining_rule(levels, hits)
    notes = [] if used == last else [f"{used} of the {last} reversals requested: there were {len(table)}"]
    notes += _leap_notes(levels, int(table["trial"].iloc[0]))
    if rule is None:
        notes.append("no up-down rule explains the moves: where the reversals converge is unknown")
    return Staircase(table, float(chosen.mean()), float(chosen.std(ddof=1)), used, rule, tuple(notes))


def _leap_notes(levels: Floats, first_reversal: int) -> list[str]:
    """Return notes on the first move after trial `first_reversal` that is more than twice every move before it.

    It may be the first move of another staircase in the same table.
    """
    sizes = np.abs(np.diff(levels))
    most = np.maximum.accumulate(sizes)
    after = np.arange(1, len(sizes)) >= first_reversal
    leaps = 1 + np.flatnonzero(after & (sizes[1:] > 2 * most[:-1] * (1 + 1e-9)))
    return [
        f"the level leaps by {sizes[i]:.3g} before trial {i + 2}, more than twice any move until then: where several "
        "staircases are in one table, name the column that identifies them"
        for i in leaps[:1].tolist()
    ]


def explaining_rule(levels: Floats, hits: Floats) -> Rule | None:
    """Return the simplest up-down rule among those that explain most moves, if it explains nine in ten."""
    tried = [
        (_explained(levels, hits, down, up), -down - up, down, up)
        for down in range(1, MOST_IN_A_ROW + 1)
        for up in range(1, MOST_IN_A_ROW + 1)
    ]
    followed, _, down, up = max(tried)
    if followed < FOLLOWED:
        return None
    moves = np.diff(levels)
    if not (moves < 0).any() or not (moves > 0).any():
        return None
    down_step, up_step = float(np.median(-moves[moves < 0])), float(np.median(moves[moves > 0]))
    # The share p of hits where the expected move is none: P(down first) x down step = P(up first) x up step. For
    # one up and equal steps p^down = 1/2 (Levitt 1971: .7071 for two down, .7937 for three); with unequal steps
    # p^down = up step / (up step + down step) (Kaernbach 1991; Garcia-Perez 1998).
    ratio = down_step / up_step
    low, high = 0.0, 1.0
    for _ in range(60):
        p = (low + high) / 2
        falls, q = p, 1 - p
        if p not in (0.0, 1.0):  # `down` hits in a row come before `up` misses in a row (Feller 1968, XIII.7)
            hits_first = p ** (down - 1) * -math.expm1(up * math.log(q))
            misses_first = q ** (up - 1) * -math.expm1(down * math.log(p))
            falls = hits_first / (hits_first + misses_first)
        if falls * ratio < 1 - falls:
            low = p
        else:
            high = p
    return Rule(down, up, down_step, up_step, (low + high) / 2, followed)


def _explained(levels: Floats, hits: Floats, down: int, up: int) -> float:
    """Return the share of moves (a change after a trial, or none) that the rule predicts.

    At an end of the range, no move counts as predicted. The counts of hits and misses restart after each move.
    """
    low, high = float(levels.min()), float(levels.max())
    run, right = 0, 0
    for place, move in enumerate(np.sign(np.diff(levels)).tolist()):
        hit = bool(hits[place])
        run = (max(run, 0) + 1) if hit else (min(run, 0) - 1)
        due = -1 if run >= down else (1 if -run >= up else 0)
        stuck = (due < 0 and levels[place] == low) or (due > 0 and levels[place] == high)
        right += move == due or (stuck and move == 0)
        run = 0 if due else run
    return right / (len(levels) - 1)
