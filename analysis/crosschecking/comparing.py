"""What every check is made of: numbers of ours and theirs, tables of cells, and reasons not to compare."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import pandas as pd

from palpate.analysis.plans.answers import Value

NEAR_ZERO = 1e-3
"""Statistics and coefficients are compared to LIMIT of this where they are smaller; p values never are."""
MOST_VALUES = 50_000
MOST_VALUES_SQUARED = 2_000
"""The same where a package makes a matrix of all values by all values."""
PINGOUIN, STATSMODELS, SCIPY = "pingouin", "statsmodels", "scipy"


class NotChecked(ValueError):
    """Why an answer is not compared."""


class Pair(NamedTuple):
    """One number of ours and theirs. `decimals`: theirs is rounded to so many; `floor`: the least size to relate to."""

    where: str
    ours: Value
    theirs: float
    floor: float = 0.0
    decimals: int | None = None


def refuse(*reasons: str) -> None:
    """Raise NotChecked with the first reason that is one."""
    for reason in reasons:
        if reason:
            raise NotChecked(reason)


def demand_size(values: int, most: int | None = None) -> None:
    most = MOST_VALUES if most is None else most
    if values > most:
        raise NotChecked(f"size ({values:,} values; at most {most:,})")


def cells_of(rows: pd.DataFrame, factors: Sequence[str], value: str = "value") -> pd.DataFrame:
    """The mean of each cell under plain names: f0, f1, ... (labels as text) and y."""
    named = rows.loc[rows[value].notna(), [*factors, value]]
    named.columns = pd.Index([*(f"f{i}" for i in range(len(factors))), "y"])
    keys = list(named.columns[:-1])
    return named.astype(dict.fromkeys(keys, str)).groupby(keys, sort=False, observed=True)["y"].mean().reset_index()


def wide_table(cells: pd.DataFrame, index: str, columns: Sequence[str]) -> pd.DataFrame:
    return cells.pivot(index=index, columns=list(columns), values="y")


Checked = tuple[str, Iterable[Pair]]
