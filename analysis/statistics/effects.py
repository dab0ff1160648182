"""The effects of a repeated-measures ANOVA as a table: one row per effect."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from pandas.api.internals import create_dataframe_from_blocks  # type: ignore[import-not-found]


class Effect(NamedTuple):
    """One row of the table; sums of squares in the data's unit squared, NaN where a statistic is undefined."""

    source: str
    ss: float
    df1: int
    df2: int
    ms: float
    f: float
    p: float
    p_gg: float
    p_hf: float
    eps: float
    np2: float
    ng2: float
    eps_hf: float
    ss_error: float
    note: str


COLUMNS = pd.Index(
    [
        *("Source", "SS", "ddof1", "ddof2", "MS", "F", "p_unc", "p_GG_corr", "p_HF_corr"),
        *("eps", "np2", "ng2", "eps_HF", "SS_error", "note"),
    ],
    dtype="str",
)
SOURCE, INTEGERS, REALS, NOTE = (np.array(places) for places in ([0], [2, 3], [1, *range(4, 14)], [14]))


def effects_table(rows: Sequence[Effect]) -> pd.DataFrame:
    """The table of `rm_anova`, put together block by block: the usual constructor takes longer than the whole test.

    A block is a 2-D array with a row per column of the table, or a column of text of its own.
    """
    source, ss, df1, df2, *reals, note = zip(*rows, strict=True)
    blocks = [
        (_text(source), SOURCE),
        (np.array((df1, df2), dtype=np.int64), INTEGERS),
        (np.array((ss, *reals), dtype=np.float64), REALS),
        (_text(note), NOTE),
    ]
    table: pd.DataFrame = create_dataframe_from_blocks(blocks, pd.RangeIndex(len(rows)), COLUMNS.view())
    return table


def _text(values: tuple[str, ...]) -> Any:
    return _kept_text(values).copy()  # a table may be changed by whoever asked for it


@lru_cache(maxsize=256)
def _kept_text(values: tuple[str, ...]) -> Any:
    """A column of text; making one takes long, and a report asks for the same ones again and again."""
    return pd.array(list(values), dtype="str")
