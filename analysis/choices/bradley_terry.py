"""The Bradley-Terry model, optionally with ties and a bias for the first place."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np
import pandas as pd

from palpate.analysis.choices.counted import Counted, gather_choices
from palpate.analysis.choices.scales import (
    SUM_ZERO,
    Maximum,
    Scale,
    around_choices,
    constraint_matrix,
    covariance_over_people,
    effect_table,
    fit_against_free,
    maximise_likelihood,
    refuse_separated,
    refuse_unconnected,
    value_table,
)
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.draws import check_share
from palpate.analysis.statistics.refusals import NoEstimate


def bradley_terry(
    data: pd.DataFrame,
    winner: Hashable,
    loser: Hashable,
    tie: Hashable | None = None,
    first: Hashable | None = None,
    count: Hashable | None = None,
    constraint: Hashable = SUM_ZERO,
    confidence: float = 0.95,
    participant: Hashable | None = None,
) -> Scale:
    """Return the worths of items from choices between pairs of them, by maximum likelihood.

    A value is a log odds: P(i over j) = 1 / (1 + exp(value_j - value_i)). With `tie`, P(tie) is proportional to exp(tie
    + (value_i + value_j) / 2); with `first`, `position` is added to the value of the item presented first (ties
    unchanged). One row per comparison, or per `count` of them. Standard errors are over people where `participant`
    names two or more (`covariance_over_people`), else as if all choices were independent. Raises NoEstimate where
    the likelihood has no finite maximum (naming the items), UnknownColumn, BadValue, TooFew. Sources: Bradley &
    Terry 1952; Ford 1957 (existence); Davidson 1970 (ties); Davidson & Beaver 1977 (position).
    """
    check_share(confidence, "confidence")
    counted = gather_choices(data, winner, loser, tie, first, count, participant)
    turn = constraint_matrix(counted.items, constraint)
    names = [name for name, option in (("tie", tie), ("position", first)) if option is not None]
    if tie is not None and not counted.counts[:, 2].any():
        raise NoEstimate("no comparison was tied, so a tie has no estimate; leave `tie` out")
    refuse_unconnected(counted)
    design, counts = _design(counted, tie is not None, first is not None)
    refuse_separated(_advantages(design, counts), [*map(repr, counted.items[1:]), *names])
    most = maximise_likelihood(design, counts)
    people = len(counted.people) if len(counted.people) > 1 else 0
    lacking: tuple[str, ...] = ()
    if people:
        covariance, lacking = covariance_over_people(
            counted, lambda own: around_choices(design, own[:, : counts.shape[1]], most.parameters)[1:3]
        )
        most = most._replace(covariance=covariance)
    size = len(counted.items)
    raw, spread = _values(most, size)
    covariance = turn @ spread @ turn.T
    deviance, df, p, notes = fit_against_free(counts, most.fitted, len(most.parameters))
    odds = np.exp(raw - raw.max())
    variances = np.diag(most.covariance)[size - 1 :]
    model = "Bradley-Terry" + (", Davidson's ties" if "tie" in names else "")
    return Scale(
        value_table(counted, turn @ raw, covariance, confidence, people).assign(worth=odds / odds.sum()),
        pd.DataFrame(covariance, index=pd.Index(list(counted.items)), columns=pd.Index(list(counted.items))),
        effect_table(names, most.parameters[size - 1 :], variances, confidence, people),
        pair_table(counted, most.fitted),
        deviance,
        df,
        p,
        most.log_likelihood,
        constraint,
        model + (", bias for the first place" if "position" in names else ""),
        (*lacking, *notes),
        people,
    )


def _design(counted: Counted, ties: bool, position: bool) -> tuple[Floats, Floats]:
    """Return the contribution of each parameter to each alternative's utility; the first item's value is 0."""
    pairs, items = len(counted.one), len(counted.items)
    design = np.zeros((pairs, 3 if ties else 2, items + ties + position))
    rows = np.arange(pairs)
    design[rows, 0, counted.one] = design[rows, 1, counted.two] = 1.0
    if ties:
        design[rows, 2, counted.one] = design[rows, 2, counted.two] = 0.5
        design[:, 2, items] = 1.0
    if position:
        design[:, 1, -1] = -1.0
    return design[:, :, 1:], counted.counts[:, : design.shape[1]]


def _advantages(design: Floats, counts: Floats) -> Floats:
    """Return each observed answer's design minus that of every other answer to the pair, without duplicate rows.

    `design` has shape (pairs, answers, parameters), `counts` (pairs, answers), the result (differences, parameters).
    """
    advantages = [
        design[context, answer] - np.delete(design[context], answer, axis=0)
        for context, answer in np.argwhere(counts > 0).tolist()
    ]
    return np.unique(np.concatenate(advantages), axis=0)


def _values(most: Maximum, size: int) -> tuple[Floats, Floats]:
    """Return the values of `size` items, the first of which is 0, and their covariance."""
    covariance = np.zeros((size, size))
    covariance[1:, 1:] = most.covariance[: size - 1, : size - 1]
    return np.concatenate(([0.0], most.parameters[: size - 1])), covariance


def pair_table(counted: Counted, fitted: Floats) -> pd.DataFrame:
    """Return each pair's counts with the shares expected by the model."""
    columns: dict[str, object] = {
        "one": [counted.items[i] for i in counted.one.tolist()],
        "two": [counted.items[i] for i in counted.two.tolist()],
    }
    for place, name in enumerate(("one_wins", "two_wins", "ties")):
        columns[name] = counted.counts[:, place].astype(int)
    columns["expected_one"] = fitted[:, 0]
    if fitted.shape[1] > 2:
        columns["expected_tie"] = fitted[:, 2]
    return pd.DataFrame(columns)
