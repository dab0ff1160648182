"""Results of the reliability and adjective statistics as rows and words of a report."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.statistics.apa import number
from palpate.protocols.undefined import finite_or_none

Plain: TypeAlias = float | int | str | bool | None


def demand_once(table: pd.DataFrame, names: Sequence[str], level: str) -> None:
    """Refuse several values of one rater in one unit where values have no mean."""
    if bool(table.duplicated(list(names)).any()):
        *units, rater = names
        raise DataRefused(
            f"several values of one {rater} for one {' and '.join(units)}: values of level {level!r} have no mean; "
            "name more columns in `units`, or keep one with `where`"
        )


def plain_rows(table: pd.DataFrame) -> tuple[Mapping[str, Plain], ...]:
    """A result's rows as plain values: an undefined number is None, a label of several parts is joined with ", "."""
    columns = {str(name): [plain(value) for value in table[name].tolist()] for name in table.columns}
    return tuple(dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True))


def plain(value: Any) -> Plain:
    """One value as a result table holds it."""
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return finite_or_none(value)
    return value if isinstance(value, int) else ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def coefficient(value: float) -> str:
    """A coefficient that is at most 1, as APA writes it: .29, −.05, 1.00."""
    return re.sub(r"^(−?)0\.", r"\1.", number(value)) if np.isfinite(value) else "undefined"


def with_interval(name: str, value: Any, low: Any, high: Any, confidence: float) -> str:
    """A coefficient and its interval: ICC(A,1) = .29, 95% CI [.02, .76]; one that lacks a limit is left out."""
    value, low, high = (plain(each) for each in (value, low, high))
    if not isinstance(value, float):
        return f"{name} is undefined"
    told = f"{name} = {coefficient(value)}"
    if not (isinstance(low, float) and isinstance(high, float)):
        return told
    return f"{told}, {confidence:.0%} CI [{coefficient(low)}, {coefficient(high)}]"


def averaged(values_per_cell: tuple[int, int]) -> tuple[str, ...]:
    """What to say where cells are means of several values."""
    least, most = values_per_cell
    if most <= 1:
        return ()
    number_of = str(most) if least == most else f"{least} to {most}"
    return (f"Each cell is the mean of {number_of} values.",)
