"""Thurstone's law of comparative judgement, case V."""

from __future__ import annotations

import math
from collections.abc import Hashable
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd
from scipy.special import log_ndtr, ndtr, ndtri

from palpate.analysis.choices.bradley_terry import pair_table
from palpate.analysis.choices.counted import Counted, gather_choices
from palpate.analysis.choices.scales import (
    DONE,
    HALVINGS,
    STEPS,
    SUM_ZERO,
    Scale,
    constraint_matrix,
    covariance_over_people,
    effect_table,
    fit_against_free,
    inverse,
    refuse_unconnected,
    value_table,
)
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.draws import check_share
from palpate.analysis.statistics.refusals import BadOption, IncompleteCells, NoEstimate, listed, refuse_idle, shown

Method: TypeAlias = Literal["likelihood", "least_squares"]
LOG_ROOT = 0.5 * math.log(2 * math.pi)


def thurstone(
    data: pd.DataFrame,
    winner: Hashable,
    loser: Hashable,
    count: Hashable | None = None,
    method: Method = "likelihood",
    constraint: Hashable = SUM_ZERO,
    confidence: float = 0.95,
    participant: Hashable | None = None,
) -> Scale:
    """Return the values of items in units of a difference's standard deviation: P(i over j) = Phi(value_i - value_j).

    "likelihood" is maximum likelihood, which allows proportions of 0 and 1. "least_squares" is the classical solution,
    the mean of each item's normal deviates: every pair must have been compared and neither item always chosen
    (IncompleteCells), and it has no standard errors (NaN). Standard errors of "likelihood" are over people where
    `participant` names two or more (`covariance_over_people`), else as if all choices were independent. Raises
    NoEstimate where no finite estimate exists, UnknownColumn, BadValue, TooFew, BadOption. Sources: Thurstone 1927;
    Mosteller 1951 (least squares); Bock & Jones 1968 (likelihood).
    """
    check_share(confidence, "confidence")
    if method not in ("likelihood", "least_squares"):
        raise BadOption(f"method={shown(method)} is unknown: 'likelihood' or 'least_squares'")
    if method == "least_squares":
        refuse_idle("confidence", confidence, 0.95, "with method='least_squares', which has no intervals")
    counted = gather_choices(data, winner, loser, None, None, count, participant)
    turn = constraint_matrix(counted.items, constraint)
    refuse_unconnected(counted)
    people = len(counted.people) if len(counted.people) > 1 and method == "likelihood" else 0
    if method == "likelihood":
        raw, spread, fitted, value, lacking = _most_likely(counted)
        model = "Thurstone, case V, maximum likelihood"
    else:
        raw, fitted = _least_squares(counted)
        spread, value, lacking = np.full((len(raw), len(raw)), math.nan), math.nan, ()
        model = "Thurstone, case V, least squares"
    covariance = turn @ spread @ turn.T
    shares = np.column_stack([fitted, 1 - fitted])
    deviance, df, p, notes = fit_against_free(counted.counts[:, :2], shares, len(raw) - 1)
    if math.isnan(value):
        notes = (*notes, "least squares gives no standard errors; the likelihood does")
    labels = pd.Index(list(counted.items))
    return Scale(
        value_table(counted, turn @ raw, covariance, confidence, people),
        pd.DataFrame(covariance, index=labels, columns=labels),
        effect_table([], np.array([]), np.array([]), confidence),
        pair_table(counted, shares),
        deviance,
        df,
        p,
        value,
        constraint,
        model,
        (*lacking, *notes),
        people,
    )


def _least_squares(counted: Counted) -> tuple[Floats, Floats]:
    wins = counted.wins()
    total = wins + wins.T
    apart = ~np.eye(len(wins), dtype=bool)
    extreme = np.argwhere(np.triu(apart & ((wins == 0) | (wins == total)))).tolist()
    if extreme:
        names = listed((f"{counted.items[i]!r} and {counted.items[j]!r}" for i, j in extreme), len(extreme))
        raise IncompleteCells(
            f"one was always chosen, or nobody compared: {names}; least squares has no deviate there: "
            "use method='likelihood'"
        )
    share = np.divide(wins, total, out=np.full_like(wins, 0.5), where=apart)
    values = np.asarray(ndtri(share).mean(axis=1))
    return values, np.asarray(ndtr(values[counted.one] - values[counted.two]))


def _most_likely(counted: Counted) -> tuple[Floats, Floats, Floats, float, tuple[str, ...]]:
    """Return values (the first 0), covariance (over people, or from the expected information), shares, likelihood and
    notes.
    """
    pairs, items = len(counted.one), len(counted.items)
    design = np.zeros((pairs, items))
    design[np.arange(pairs), counted.one] = 1.0
    design[np.arange(pairs), counted.two] = -1.0
    design, counts = design[:, 1:], counted.counts[:, :2]
    place = np.zeros(items - 1)
    for _ in range(STEPS):
        value, slope, bend = _around(design, counts, place)
        step: Floats = np.asarray(np.linalg.solve(bend, slope), dtype=np.float64)
        moved: Floats | None = None
        for halving in range(HALVINGS):
            further = place + step * 0.5**halving
            if _around(design, counts, further)[0] > value:
                moved = further
                break
        if float(step @ slope) <= DONE * max(1.0, abs(value)) or moved is None:
            break
        place = moved
    else:
        raise NoEstimate(f"the estimates still move after {STEPS} steps; the comparisons are too few")
    shares = np.asarray(ndtr(design @ place))
    spread = np.zeros((items, items))
    total = counts.sum(axis=1)
    z = design @ place
    weight = np.exp(-z * z - 2 * LOG_ROOT - log_ndtr(z) - log_ndtr(-z))
    notes: tuple[str, ...] = ()
    if len(counted.people) > 1:
        spread[1:, 1:], notes = covariance_over_people(counted, lambda own: _around(design, own[:, :2], place)[1:])
    else:
        spread[1:, 1:] = inverse((design.T * (total * weight)) @ design)
    return np.concatenate(([0.0], place)), spread, shares, value, notes


def _around(design: Floats, counts: Floats, place: Floats) -> tuple[float, Floats, Floats]:
    """Return the log likelihood, gradient and (positive) curvature; density over tail loses no digits far out."""
    z = design @ place
    won, lost = log_ndtr(z), log_ndtr(-z)
    up, down = np.exp(-0.5 * z * z - LOG_ROOT - won), np.exp(-0.5 * z * z - LOG_ROOT - lost)
    slope = counts[:, 0] * up - counts[:, 1] * down
    bend = counts[:, 0] * up * (z + up) + counts[:, 1] * down * (down - z)
    value = float((counts[:, 0] * won + counts[:, 1] * lost).sum())
    return value, design.T @ slope, (design.T * bend) @ design
