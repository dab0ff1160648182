"""A scale of items: values, their covariance, differences and fit, whatever model they come from."""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd
from scipy.special import gammaincc, ndtr, ndtri, xlogy

from palpate.analysis.choices.counted import Counted
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.pvalues import SMALLEST, adjusted
from palpate.analysis.statistics.refusals import BadOption, UnknownColumn

SUM_ZERO = "sum_zero"
FEW_EXPECTED = 5.0


@dataclass(frozen=True)
class Scale:
    """A fitted scale of items.

    `values`: item, value, se, ci_low, ci_high, wins, losses, ties, comparisons (and `worth`, the share of the summed
    odds, for Bradley-Terry). `constraint` is "sum_zero" or the item whose value is 0. `covariance` is of the values.
    `effects`: other parameters (effect, estimate, se, z, p, ci_low, ci_high). `pairs`: one, two, their counts, and how
    often the model expects `one` to be chosen. `deviance` (`df`, `p`) is against a model with every pair free.
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


def value_table(counted: Counted, values: Floats, covariance: Floats, confidence: float) -> pd.DataFrame:
    """The values with their normal intervals and the items' counts."""
    wins, ties = counted.wins(), counted.tied()
    se = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    half = float(ndtri((1 + confidence) / 2)) * se
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


def constrained(items: tuple[Hashable, ...], constraint: Hashable) -> Floats:
    """The matrix that turns values with an arbitrary zero into values under the constraint.

    Raises UnknownColumn for a reference that is not an item.
    """
    size = len(items)
    if constraint == SUM_ZERO:
        return np.eye(size) - 1 / size
    if constraint not in items:
        raise UnknownColumn(f"reference {constraint!r} is none of the items {', '.join(map(repr, items[:12]))}")
    turned = np.eye(size)
    turned[:, items.index(constraint)] -= 1
    return turned


def differences(scale: Scale, correction: str = "holm") -> pd.DataFrame:
    """Every pair of items: A, B, difference (A minus B), se, z, p, p_corrected; Wald tests.

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
        se = math.sqrt(max(spread[i, i] + spread[j, j] - 2 * spread[i, j], 0.0))
        rows.append({"A": items[i], "B": items[j], "difference": gap, "se": se, "z": gap / se, "p": p_of_z(gap / se)})
    table = pd.DataFrame(rows)
    return table.assign(p_corrected=adjusted(table["p"].tolist(), names[correction]))


def effect_table(names: list[str], estimates: Floats, variances: Floats, confidence: float) -> pd.DataFrame:
    """Parameters beside the items' values, each with its Wald test."""
    half = float(ndtri((1 + confidence) / 2))
    rows = [
        {"effect": name, "estimate": b, "se": se, "z": b / se, "p": p_of_z(b / se)}
        | {"ci_low": b - half * se, "ci_high": b + half * se}
        for name, b, se in zip(names, estimates.tolist(), np.sqrt(variances).tolist(), strict=True)
    ]
    return pd.DataFrame(rows, columns=["effect", "estimate", "se", "z", "p", "ci_low", "ci_high"])


def p_of_z(z: float) -> float:
    """P(|Z| > |z|), never 0."""
    return max(float(2 * ndtr(-abs(z))), SMALLEST)


def fit_against_free(counts: Floats, fitted: Floats, parameters: int) -> tuple[float, int, float, tuple[str, ...]]:
    """Deviance against free probabilities for every pair, df, p, and what to know of it."""
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
