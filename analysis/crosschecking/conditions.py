"""Data for which pingouin or statsmodels are known to be wrong, or to compute something else.

Each condition depends on the data only, before anything is compared, and returns the reason or "". They are listed with
examples in docs/reference/crosscheck.md; a test checks each one on data for which the package still fails.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.analysis.plans.answers import Value
from palpate.analysis.statistics.doubles import Floats

MOST_APART = 1e4
"""The ratio of values to their residual at which sums of squares lose half of a double's digits."""
MOST_APART_PAIRED = 1e7
LARGEST, SMALLEST = 1e100, 1e-100
NEARLY_TIED = 1e-9
MOST_BETWEEN = 1e3
NEAR_ZERO = 1e-3
"""The least size that statistics and coefficients are compared with; p values have none."""
MOST_VALUES = 50_000
MOST_VALUES_SQUARED = 2_000
"""The most values for a package that makes a matrix of all values by all values."""
PINGOUIN, STATSMODELS, SCIPY = "pingouin", "statsmodels", "scipy"


def incomplete(wide: pd.DataFrame) -> str:
    """Return the reason if some cell has no value.

    Pingouin drops or averages silently; AnovaRM counts participants that it should not.
    """
    return "a cell is missing, which the packages drop or average without a word" if wide.isna().any(axis=None) else ""


def out_of_range(values: Floats) -> str:
    """Return the reason if squares of the values overflow or underflow double precision."""
    largest = float(np.abs(values).max(initial=0.0))
    return "squares of the values leave the range of doubles" if largest > LARGEST or 0 < largest < SMALLEST else ""


def drowned(cells: Floats, groups: Sequence[str] | None = None) -> str:
    """Return the reason if some effect's residual is zero, or too small for sums of squares in double precision.

    `cells` has participants along its first axis and a within factor along each other one; `groups` has each
    participant's group.
    """
    largest = float(np.abs(cells).max()) or 1.0
    small, own_groups = cells / largest, np.array(groups) if groups is not None else None
    # What is left of each effect within participants, and of participants within groups.
    axes = range(1, small.ndim)
    residuals = []
    for size in range(1, small.ndim):
        for remaining in combinations(axes, size):
            rest = small.mean(axis=tuple(axis for axis in axes if axis not in remaining), keepdims=True)
            for axis in remaining:
                rest = rest - rest.mean(axis=axis, keepdims=True)
            residuals.append(_within_groups(rest, own_groups))
    if groups is not None or small.ndim == 1:
        residuals.append(_within_groups(small.mean(axis=tuple(axes)) if small.ndim > 1 else small, own_groups))
    least = largest * min(_size(residual) for residual in residuals)
    if largest > MOST_APART * least:
        apart = (
            "there is no residual"
            if least == 0 or largest / least > 1e14
            else (f"the values are {largest / least:.0e} times their residual")
        )
        return f"{apart}: sums of squares are rounding there"
    return ""


def _within_groups(values: Floats, groups: np.ndarray | None) -> Floats:
    rest: Floats = np.array(values, dtype=np.float64)
    whole = np.zeros(len(rest)) if groups is None else groups
    for group in np.unique(whole):
        rest[whole == group] -= rest[whole == group].mean(axis=0)
    return rest


def _size(values: Floats) -> float:
    return math.sqrt(float(np.mean(values**2)))


def another_type(sizes: Sequence[int], sum_of_squares: str) -> str:
    """Return the reason if group sizes are unequal: pingouin's mixed ANOVA is then type II, Palpate's is not."""
    unequal = len(set(sizes)) > 1 and sum_of_squares == "III"
    return "pingouin's mixed ANOVA is of type II, another number for groups of unequal sizes" if unequal else ""


def undefined_pair(wide: pd.DataFrame) -> str:
    """Return the reason if the difference of a pair does not vary.

    Pingouin's t is then infinite, or the pair is left out of its family.
    """
    values = wide.to_numpy(dtype=float) / (float(np.abs(wide.to_numpy()).max()) or 1.0)
    for a, b in combinations(range(values.shape[1]), 2):
        apart = values[:, a] - values[:, b]
        if MOST_APART_PAIRED * _size(apart - apart.mean()) < 1:
            names = f"{wide.columns[a]} and {wide.columns[b]}"
            return f"the difference of {names} does not vary: pingouin gives an infinite t or takes the pair out"
    return ""


def constant_groups(values: Floats, groups: Sequence[str]) -> str:
    """Return the reason if a t test between groups has no variance, or a variance that is only rounding."""
    labels, x = np.array(groups), values / (float(np.abs(values).max()) or 1.0)
    for a, b in combinations(np.unique(labels), 2):
        rest = np.concatenate([x[labels == label] - x[labels == label].mean() for label in (a, b)])
        if MOST_APART * _size(rest) < 1:
            return f"{a} and {b} hardly vary beside their values: variances are rounding there"
    return ""


def nearly_tied(wide: pd.DataFrame) -> str:
    """Return the reason if values of one participant differ only by rounding, as SciPy ranks 0.1 + 0.2 above 0.3."""
    values = np.sort(wide.to_numpy(dtype=float), axis=1)
    gaps = np.diff(values, axis=1)
    near = (gaps > 0) & (gaps <= NEARLY_TIED * np.abs(values).max(axis=1, keepdims=True))
    return "values that differ only by rounding are ties, which pingouin ranks" if near.any() else ""


def nearly_equal_differences(levels: Mapping[str, Floats]) -> str:
    """Return the reason if differences of two levels are equal or zero except for rounding, since SciPy ranks them."""
    for a, b in combinations(levels, 2):
        sizes = np.sort(np.append(np.abs(levels[a] - levels[b]), 0.0))
        gaps, largest = np.diff(sizes), float(np.abs([levels[a], levels[b]]).max())
        if ((gaps > 0) & (gaps <= NEARLY_TIED * largest)).any():
            return f"differences of {a} and {b} that differ only by rounding are ties, which SciPy ranks"
    return ""


def far_from_zero(values: Floats) -> str:
    """Return the reason if values are so large that means computed in another way have other ties."""
    largest, apart = float(np.abs(values).max()), float(np.ptp(values))
    if largest > MOST_APART * apart > 0:
        return f"values are {largest / apart:.0e} times as large as they differ: ties of aligned ones are rounding"
    return ""


def all_tied(wide: pd.DataFrame) -> str:
    """Return the reason if nobody's values differ, so that there are no ranks."""
    same = (wide.nunique(axis=1) == 1).all()
    return "nobody's values differ: there are no ranks" if same else ""


def undefined_icc(values: Floats) -> str:
    """Return the reason if an ICC's denominator is not positive, where pingouin returns a reliability above 1."""
    n, k = values.shape
    b = k * values.mean(axis=1).var(ddof=1)
    j = n * values.mean(axis=0).var(ddof=1)
    rest = values - values.mean(axis=1, keepdims=True) - values.mean(axis=0) + values.mean()
    e = float((rest**2).sum()) / ((n - 1) * (k - 1))
    tiny = 1e-12 * float((values**2).mean() or 1.0)
    if min(b, b + (j - e) / n, b + (k - 1) * e + k * (j - e) / n) <= tiny:
        return "an estimated variance is not above 0, and pingouin divides by it"
    return ""


def extreme_ratio(values: Floats, fixed: Floats, groups: Sequence[Sequence[str]]) -> str:
    """Return the reason if groups are so far apart that MixedLM stops early or not at all, or a variance is zero.

    `fixed` are the columns of the fixed effects. The criterion, by least squares, is the mean square of each grouping
    factor, adjusted for the fixed effects and the other factors, over that of the residual.
    """
    dummies = [pd.get_dummies(pd.Series(list(labels)), dtype=float).to_numpy() for labels in groups]
    whole = np.column_stack([fixed, *dummies])
    rest, rank = _left_over(values, whole)
    freedom = len(values) - rank
    if freedom < 1 or rest <= (np.finfo(float).eps * float(np.abs(values).max())) ** 2 * len(values):
        return "there is no residual"
    for place in range(len(groups)):
        others = np.column_stack([fixed, *(dummy for i, dummy in enumerate(dummies) if i != place)])
        more, fewer = _left_over(values, others)
        if rank == fewer:  # the other factors lie within this one
            continue
        ratio = (more - rest) / (rank - fewer) / (rest / freedom)
        if ratio > MOST_BETWEEN**2:
            return f"groups are {math.sqrt(ratio):.0e} residuals apart, where MixedLM says converged and is not"
        if ratio <= 1:
            return "a variance is estimated as zero, where MixedLM's search does not end"
    return ""


def _left_over(values: Floats, columns: Floats) -> tuple[float, int]:
    """Return the residual sum of squares of a least-squares fit, and the rank of the columns."""
    solved, _, rank, _ = np.linalg.lstsq(columns, values - values.mean(), rcond=1e-10)
    return float(((values - values.mean() - columns @ solved) ** 2).sum()), int(rank)


class NotChecked(ValueError):
    """The answer is not compared; the message is the reason."""


class Pair(NamedTuple):
    """Palpate's value and the package's, rounded to `decimals`; `floor` is the least size to compare with."""

    where: str
    ours: Value
    theirs: float
    floor: float = 0.0
    decimals: int | None = None


def refuse(*reasons: str) -> None:
    """Raise NotChecked with the first reason that is not empty."""
    for reason in reasons:
        if reason:
            raise NotChecked(reason)


def demand_size(values: int, most: int | None = None) -> None:
    most = MOST_VALUES if most is None else most
    if values > most:
        raise NotChecked(f"size ({values:,} values; at most {most:,})")


def cells_of(rows: pd.DataFrame, factors: Sequence[str], value: str = "value") -> pd.DataFrame:
    """Return the mean of each cell under plain column names: f0, f1, ... (labels as text) and y."""
    named = rows.loc[rows[value].notna(), [*factors, value]]
    named.columns = pd.Index([*(f"f{i}" for i in range(len(factors))), "y"])
    keys = list(named.columns[:-1])
    return named.astype(dict.fromkeys(keys, str)).groupby(keys, sort=False, observed=True)["y"].mean().reset_index()


def wide_table(cells: pd.DataFrame, index: str, columns: Sequence[str]) -> pd.DataFrame:
    return cells.pivot(index=index, columns=list(columns), values="y")


Checked = tuple[str, Iterable[Pair]]
