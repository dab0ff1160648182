"""A scale of items by any model: values, covariance, differences and fit, and whether it exists.

Choices among alternatives whose utilities are linear in some parameters are fitted by maximum likelihood with Newton's
method. No scale exists if one group of items never lost to the rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import linprog
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.special import gammaincc, logsumexp, ndtr, ndtri, xlogy

from palpate.analysis.choices.counted import Counted
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.f_and_t import SMALLEST, adjusted, t_critical, t_two_sided
from palpate.analysis.statistics.refusals import BadOption, NoEstimate, UnknownColumn, listed

SUM_ZERO = "sum_zero"
FEW_EXPECTED = 5.0
STEPS, HALVINGS = 100, 40
DONE = 1e-24
SINGULAR = 1e12  # condition of an information matrix
ALIKE = 1e-9  # a standard error below it is of rounding, of people who all chose alike


@dataclass(frozen=True)
class Scale:
    """A fitted scale of items.

    `values`: item, value, se, ci_low, ci_high, wins, losses, ties, comparisons (and `worth`, the share of the summed
    odds, for Bradley-Terry). `constraint` is "sum_zero" or the item whose value is 0. `covariance` is of the values.
    `effects`: other parameters (effect, estimate, se, t or z, p, ci_low, ci_high). `pairs`: one, two, their counts, and
    how often the model expects `one` to be chosen. `deviance` (`df`, `p`) is against a model with every pair free.
    `people`: number of people who are left out in turn for standard errors (Student's t, people - 1 degrees of
    freedom); 0 where every choice counts as independent (normal distribution).
    """

    values: pd.DataFrame
    covariance: pd.DataFrame
    effects: pd.DataFrame
    pairs: pd.DataFrame
    deviance: float
    df: int
    p: float
    log_likelihood: float
    constraint: Hashable
    model: str
    notes: tuple[str, ...] = ()
    people: int = 0


def value_table(
    counted: Counted, values: Floats, covariance: Floats, confidence: float, people: int = 0
) -> pd.DataFrame:
    """Return the values with their intervals (see `critical`) and the items' counts."""
    wins, ties = counted.wins(), counted.tied()
    se = _standard_errors(np.diag(covariance))
    half = critical(people, confidence) * se
    return pd.DataFrame(
        {
            "item": list(counted.items),
            "value": values,
            "se": se,
            "ci_low": values - half,
            "ci_high": values + half,
            "wins": wins.sum(axis=1).astype(int),
            "losses": wins.sum(axis=0).astype(int),
            "ties": ties.sum(axis=1).astype(int),
            "comparisons": (wins.sum(axis=0) + wins.sum(axis=1) + ties.sum(axis=1)).astype(int),
        }
    )


def constraint_matrix(items: tuple[Hashable, ...], constraint: Hashable) -> Floats:
    """Return the matrix that turns values with any zero into values under the constraint.

    Raises UnknownColumn for a reference that is not an item.
    """
    size = len(items)
    if constraint == SUM_ZERO:
        return np.eye(size) - 1 / size
    if constraint not in items:
        raise UnknownColumn(f"reference {constraint!r} is not one of the items {', '.join(map(repr, items[:12]))}")
    turned = np.eye(size)
    turned[:, items.index(constraint)] -= 1
    return turned


def differences(scale: Scale, correction: str = "holm") -> pd.DataFrame:
    """Return every pair of items: A, B, difference (A minus B), se, t (or z, see `tested`), p, p_corrected.

    `correction`: "none", "bonferroni" or "holm", the family being all pairs.
    """
    names = {"none": "none", "bonferroni": "bonf", "holm": "holm"}
    if correction not in names:
        raise BadOption(f"correction={correction!r} is unknown: 'none', 'bonferroni' or 'holm'")
    items, values = scale.values["item"].tolist(), scale.values["value"].to_numpy()
    spread = scale.covariance.to_numpy()
    rows = []
    for i, j in combinations(range(len(items)), 2):
        gap = float(values[i] - values[j])
        se = float(_standard_errors(spread[i, i] + spread[j, j] - 2 * spread[i, j]))
        rows.append({"A": items[i], "B": items[j], "difference": gap, "se": se, **tested(gap, se, scale.people)})
    table = pd.DataFrame(rows)
    return table.assign(p_corrected=adjusted(table["p"].tolist(), names[correction]))


def effect_table(
    names: list[str], estimates: Floats, variances: Floats, confidence: float, people: int = 0
) -> pd.DataFrame:
    """Return parameters other than the items' values, each with its test (see `tested`) and interval."""
    half = critical(people, confidence)
    rows = [
        {"effect": name, "estimate": b, "se": se, **tested(b, se, people)}
        | {"ci_low": b - half * se, "ci_high": b + half * se}
        for name, b, se in zip(names, estimates.tolist(), _standard_errors(variances).tolist(), strict=True)
    ]
    columns = ["effect", "estimate", "se", "t" if people else "z", "p", "ci_low", "ci_high"]
    return pd.DataFrame(rows, columns=columns)


def _standard_errors(variances: Floats) -> Floats:
    """Return the roots of variances, NaN where they are of rounding alone."""
    se = np.sqrt(np.maximum(variances, 0.0))
    return np.where(se < ALIKE, math.nan, se)


def critical(people: int, confidence: float) -> float:
    """Return half the width of an interval in standard errors: normal, of `people` Student's t."""
    return t_critical(people - 1, confidence) if people else float(ndtri((1 + confidence) / 2))


def tested(estimate: float, se: float, people: int) -> dict[str, float]:
    """Return the test of an estimate against 0: z with its normal p, of `people` Student's t with its own."""
    statistic = estimate / se
    if people:
        return {"t": statistic, "p": t_two_sided(statistic, people - 1)}
    return {"z": statistic, "p": max(float(2 * ndtr(-abs(statistic))), SMALLEST)}


def covariance_over_people(
    counted: Counted, around: Callable[[Floats], tuple[Floats, Floats]]
) -> tuple[Floats, tuple[str, ...]]:
    """Return the covariance of estimates (parameters, parameters) by leaving out each person in turn, and notes.

    `around` returns the gradient and curvature of one person's log likelihood, for counts (pairs, 3), at the estimates.
    The estimates without a person are one step of Newton's method away, so that they exist also where the likelihood of
    the others has no finite maximum. It is NaN if the comparisons without somebody fix no scale, whom a note names.
    Sources: Tukey 1958 (jackknife, t of people - 1); Lipsitz, Laird & Harrington 1990 (one step).
    """
    slopes, bends = map(np.array, zip(*map(around, counted.by_person), strict=True))
    others = bends.sum(axis=0) - bends
    needed = [name for name, bend in zip(counted.people, others, strict=True) if np.linalg.cond(bend) > SINGULAR]
    if needed:
        names = listed(map(repr, needed), len(needed)).replace("; ", ", ")
        note = f"no standard errors over people: without {names} the comparisons fix no scale"
        return np.full_like(bends[0], math.nan), (note,)
    left: Floats = np.linalg.solve(others, -slopes[..., None])[..., 0]
    apart = left - left.mean(axis=0)
    if np.abs(apart).max() < ALIKE:
        return np.full_like(bends[0], math.nan), ("no standard errors over people: all of them chose alike",)
    return (len(left) - 1) / len(left) * apart.T @ apart, ()


def fit_against_free(counts: Floats, fitted: Floats, parameters: int) -> tuple[float, int, float, tuple[str, ...]]:
    """Return the deviance against a model with free probabilities for every pair, with df, p, and a note."""
    total = counts.sum(axis=1, keepdims=True)
    expected = total * fitted
    deviance = max(0.0, 2 * float((xlogy(counts, counts) - xlogy(counts, expected)).sum()))
    df = len(counts) * (counts.shape[1] - 1) - parameters
    if df < 1:
        return deviance, 0, math.nan, ("no test of fit: as many parameters as free probabilities",)
    p = max(float(gammaincc(df / 2, deviance / 2)), SMALLEST)
    low = float((expected < FEW_EXPECTED).mean())
    rough = f"{low:.0%} of the expected counts are below 5: the p of the fit is rough"
    return deviance, df, p, (rough,) if low > 0.2 else ()


class Maximum(NamedTuple):
    """The maximum of a likelihood: parameters, their covariance (inverse information), log likelihood."""

    parameters: Floats
    covariance: Floats
    log_likelihood: float
    fitted: Floats


def inverse(information: Floats) -> Floats:
    """Return the covariance of estimates with this information matrix."""
    return np.asarray(np.linalg.inv(information), dtype=np.float64)


def maximise_likelihood(design: Floats, counts: Floats) -> Maximum:
    """Return the maximum for `design` (contexts, alternatives, parameters) and `counts` (contexts, alternatives).

    The likelihood is concave, so there is one maximum; the caller must check that it exists. Raises NoEstimate where
    Newton's method does not converge. Source: McFadden 1974.
    """
    place = np.zeros(design.shape[2])
    value, slope, bend, fitted = around_choices(design, counts, place)
    for _ in range(STEPS):
        step: Floats = np.asarray(np.linalg.solve(bend, slope), dtype=np.float64)
        gain = float(step @ slope)
        if gain <= DONE * max(1.0, abs(value)):
            return Maximum(place, inverse(bend), value, fitted)
        for halving in range(HALVINGS):
            moved = place + step * 0.5**halving
            around = around_choices(design, counts, moved)
            if around[0] >= value:
                break
        else:
            return Maximum(place, inverse(bend), value, fitted)
        if around[0] == value and gain < 1e-12:
            return Maximum(moved, inverse(around[2]), around[0], around[3])
        place, (value, slope, bend, fitted) = moved, around
    raise NoEstimate(f"the estimates still move after {STEPS} steps of Newton's method; the comparisons are too few")


def around_choices(design: Floats, counts: Floats, place: Floats) -> tuple[float, Floats, Floats, Floats]:
    """Return the log likelihood, its gradient, its (positive) curvature and the probabilities at some parameters."""
    total = counts.sum(axis=1)
    utility = design @ place
    log_share = utility - logsumexp(utility, axis=1, keepdims=True)
    share = np.exp(log_share)
    left = counts - total[:, None] * share
    mean = np.einsum("ca,cap->cp", share, design)
    around = design - mean[:, None, :]
    bend = np.einsum("c,ca,cap,caq->pq", total, share, around, around, optimize=True)
    return float((counts * log_share).sum()), np.einsum("ca,cap->p", left, design), bend, share


def refuse_unconnected(counted: Counted) -> None:
    """Refuse comparisons in which some item cannot be reached from every other through wins or ties.

    Exactly then the maximum of the likelihood is not at finite worths (Ford 1957). Raises NoEstimate naming the items.
    """
    beats = (counted.wins() + counted.tied()) > 0
    weak, group = connected_components(csr_array(beats), connection="weak")
    if weak > 1:
        parts = " and ".join(_names(counted.items, group == i) for i in range(min(weak, 3)))
        raise NoEstimate(
            f"the comparisons fall into {weak} parts that were never compared with each other ({parts}); "
            "scale each part by itself, or compare items across them"
        )
    strong, group = connected_components(csr_array(beats), connection="strong")
    if strong > 1:
        for i in sorted(range(strong), key=lambda i: (int((group == i).sum()), int(np.argmax(group == i)))):
            inside = group == i
            for won, lost, what in ((inside, ~inside, "lost to"), (~inside, inside, "beat")):
                if beats[np.ix_(won, lost)].any() and not beats[np.ix_(lost, won)].any():
                    raise NoEstimate(
                        f"{_names(counted.items, inside)} never {what} any of the other items, so how far apart they "
                        "are has no estimate; leave them out, or add comparisons that could go the other way"
                    )
        raise NoEstimate("the items cannot be brought into one scale: no chain of wins leads back")


def _names(items: tuple[Hashable, ...], chosen: Any) -> str:
    names = [repr(items[i]) for i in np.flatnonzero(chosen).tolist()]
    return listed(names, len(names)).replace("; ", ", ")


def refuse_separated(better: Floats, names: list[str]) -> None:
    """Refuse a model whose likelihood grows without limit along some direction of its parameters.

    Rows of `better` are the contrasts of the answers. A linear programme looks for a direction along which no answer
    becomes less likely, and some more (Albert & Anderson 1984).
    """
    if not len(better):
        return
    programme = linprog(-better.sum(axis=0), A_ub=-better, b_ub=np.zeros(len(better)), bounds=(-1, 1), method="highs")
    if programme.status == 0 and -programme.fun > 1e-7:
        moving = [name for name, value in zip(names, programme.x, strict=True) if abs(value) > 1e-9]
        raise NoEstimate(
            f"the answers fit ever better as {listed(moving, len(moving))} grow without end; "
            "leave such an effect out, or gather answers that contradict it"
        )
