"""The psychometric model of QUEST+ over the grid of its parameters: shares of hits, the posterior, and its estimate.

The procedure chooses levels by these functions, and analyses compute thresholds by them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from palpate.protocols.procedures import Model, values_of
from palpate.studies.procedures.adviser import SURE, Estimate

Floats: TypeAlias = np.ndarray[Any, np.dtype[np.float64]]
PARAMETERS = ("threshold", "slope", "guess", "lapse", "gradient")
IMPOSSIBLE = 1e-12
"""The share of an answer that the model excludes."""


@dataclass(frozen=True)
class Table:
    """The model over its grid: `share[level, combination]` of hits, and the values of each parameter.

    `share_and_entropy` has a second half of rows: the entropy of an answer, in nats, where the combination is known.
    `shape` has the number of values of each parameter, in the order of PARAMETERS.
    """

    share: Floats
    share_and_entropy: Floats
    axes: dict[str, Floats]
    shape: tuple[int, ...]


def tabulate(model: Model, levels: tuple[Any, ...], falling: bool = False) -> Table:
    """Return the table of a model at these levels; `falling`: hits become fewer as the level rises."""
    axes = {name: np.array(values_of(getattr(model, name) if getattr(model, name) is not None else 0.0))
            for name in PARAMETERS}  # fmt: skip
    shape = tuple(len(axes[name]) for name in PARAMETERS)
    grids = np.meshgrid(*(axes[name] for name in PARAMETERS), indexing="ij")
    values = {name: grid.ravel() for name, grid in zip(PARAMETERS, grids, strict=True)}
    pairs = np.array([level if isinstance(level, tuple) else (level, 0.0) for level in levels], dtype=np.float64)
    threshold = values["threshold"] + values["gradient"] * pairs[:, 1:]
    felt = rise(model.shape, model.scale, pairs[:, :1], threshold, values["slope"], falling)
    share = values["guess"] + (1 - values["guess"] - values["lapse"]) * felt
    return Table(share, np.vstack([share, entropy(share)]), axes, shape)


def rise(shape: str, scale: str, level: Floats, threshold: Floats, slope: Floats, falling: bool = False) -> Floats:
    """Return F at the levels, from 0 to 1 (`Model` in palpate.protocols.procedures has the equations)."""
    if shape == "weibull":
        with np.errstate(over="ignore", under="ignore"):
            if scale == "linear":
                return -np.expm1(-((level / threshold) ** slope))
            return -np.expm1(-(10.0 ** (slope * (level - threshold) / (20.0 if scale == "db" else 1.0))))
    from scipy.special import expit, ndtr

    z = slope * (threshold - level if falling else level - threshold)
    result: Floats = expit(z) if shape == "logistic" else ndtr(z)
    return result


def level_at(shape: str, scale: str, share: float, threshold: Floats, slope: Floats, falling: bool = False) -> Floats:
    """Return the levels at which F is `share` (between 0 and 1): the inverse of `rise`."""
    if shape == "weibull":
        height = -math.log1p(-share)
        if scale == "linear":
            return np.asarray(threshold * height ** (1.0 / slope), dtype=np.float64)
        return np.asarray(threshold + (20.0 if scale == "db" else 1.0) * math.log10(height) / slope, dtype=np.float64)
    from scipy.special import logit, ndtri

    z = float(logit(share) if shape == "logistic" else ndtri(share)) / slope
    return np.asarray(threshold - z if falling else threshold + z, dtype=np.float64)


def own_share(shape: str) -> float:
    """Return F at the threshold of the model: 1 - 1/e for a Weibull function, else 0.5."""
    return 1 - math.exp(-1) if shape == "weibull" else 0.5


def uniform(table: Table) -> Floats:
    """Return the prior: the same probability for each combination of parameters."""
    count = table.share.shape[1]
    return np.full(count, 1.0 / count)


def updated(table: Table, weights: Floats, answers: Iterable[tuple[int, bool]]) -> Floats:
    """Return the probability of each combination after further answers, as (row of the table, hit)."""
    for row, hit in answers:
        share = table.share[row] if hit else 1.0 - table.share[row]
        following = weights * share
        if not following.sum() > 0:  # no combination allows this answer: it is as unlikely as can be
            following = weights * np.maximum(share, IMPOSSIBLE)
        weights = following / following.sum()
    return weights


def marginal_of(table: Table, weights: Floats, parameter: str = "threshold") -> tuple[Floats, Floats]:
    """Return the values of a parameter and their probabilities."""
    place = PARAMETERS.index(parameter)
    others = tuple(n for n in range(len(PARAMETERS)) if n != place)
    return table.axes[parameter], weights.reshape(table.shape).sum(axis=others)


def estimate_of(values: Floats, weights: Floats, levels: tuple[Any, ...], sure: float = SURE) -> Estimate:
    """Return mean, SD and central interval of a threshold, or a bound where it may lie beyond the levels.

    `sure` is the probability of the interval.
    """
    low, high = quantiles(values, weights, ((1 - SURE) / 2, (1 + SURE) / 2))
    firsts = [level[0] if isinstance(level, tuple) else level for level in levels]
    lowest, highest = max(min(firsts), float(values[0])), min(max(firsts), float(values[-1]))
    below, above = low < lowest + _half(values, lowest), high > highest - _half(values, highest)
    if below and above:
        return Estimate(outside="unknown")
    if below or above:
        bound = quantiles(values, weights, (SURE if below else 1 - SURE,))[0]
        return Estimate(outside="below" if below else "above", bound=bound)
    mean = float(weights @ values)
    sd = math.sqrt(max(0.0, float(weights @ (values - mean) ** 2)))
    ends = (low, high) if sure == SURE else quantiles(values, weights, ((1 - sure) / 2, (1 + sure) / 2))
    return Estimate(mean, sd, (ends[0], ends[1]))


def quantiles(values: Floats, weights: Floats, shares: tuple[float, ...]) -> tuple[float, ...]:
    """Return quantiles of a distribution over a grid, each point spread evenly over its cell."""
    edges = cell_edges(values)
    cumulated = np.concatenate([[0.0], np.cumsum(weights)])
    return tuple(float(np.interp(share, cumulated / cumulated[-1], edges)) for share in shares)


def cell_edges(values: Floats) -> Floats:
    """Return the edges of the cells around the points of a grid: one more than the points."""
    middles = (values[1:] + values[:-1]) / 2
    first, last = values[0] - (middles[0] - values[0]), values[-1] + (values[-1] - middles[-1])
    result: Floats = np.concatenate([[first], middles, [last]])
    return result


def _half(values: Floats, at: float) -> float:
    """Return half the width of the grid's cell at a value."""
    place = min(max(int(np.searchsorted(values, at)), 1), len(values) - 1)
    return float(values[place] - values[place - 1]) / 2


def entropy(share: Floats) -> Floats:
    """Return the entropy of a yes/no answer with this probability, in nats."""
    rest = 1.0 - share
    with np.errstate(divide="ignore", invalid="ignore"):
        total = share * np.log(share) + rest * np.log(rest)
    result: Floats = -np.nan_to_num(total, nan=0.0)
    return result
