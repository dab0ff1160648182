"""One explaining variable as well-scaled columns, and the way back to the columns that a reader expects.

The model is fitted in columns that are centred and of size one (or in sum coding), so that neither an offset of 1e9
nor a unit of measurement costs a digit. `back` maps it to the reported columns: with c the internal and x the
reported columns of a variable, [1, c] = [1, x] back, and so the coefficients of x are back times those of c.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.statistics.column_values import numbers_of
from palpate.analysis.statistics.doubles import Floats, difference
from palpate.analysis.statistics.labels import Codes, coded
from palpate.analysis.statistics.refusals import BadOption, BadValue, TooFew, listed

Coding: TypeAlias = Literal["treatment", "sum"]
Rows: TypeAlias = slice | Codes


@dataclass(frozen=True)
class Variable:
    """A factor (`codes` and the `table` of its levels' columns) or a number (`values`), row by row."""

    name: str
    labels: tuple[str, ...]
    back: Floats
    codes: Codes | None = None
    table: Floats | None = None
    values: Floats | None = None

    @property
    def width(self) -> int:
        """How many columns the variable takes."""
        return len(self.back) - 1

    def columns(self, rows: Rows) -> Floats:
        """The internal columns of these rows, (rows, width)."""
        if self.codes is not None and self.table is not None:
            picked: Floats = self.table[self.codes[rows]]
            return picked
        return np.asarray(self.values)[rows, None]


@dataclass(frozen=True)
class Factor:
    """The levels of a column and each row's level."""

    name: str
    codes: Codes
    levels: tuple[str, ...]


def factor_of(column: pd.Series[Any], name: Hashable, order: Sequence[Any] | None = None) -> Factor:
    """A column of labels as a factor, levels in the given order or else in their natural one.

    Raises BadValue (no label, labels that read the same), BadOption (a level that the order lacks), TooFew (one level).
    """
    found = coded(column, name)
    texts = [str(label) for label in found.labels]
    if len(texts) < 2:
        raise TooFew(f"factor {name!r} has one level, {texts[0]!r}; a comparison needs two or more")
    if order is None:
        return Factor(str(name), found.codes, tuple(texts))
    place = {str(level): i for i, level in enumerate(order)}
    unknown = [text for text in texts if text not in place]
    if unknown:
        raise BadOption(f"levels of {name!r} lack {listed(map(repr, unknown), len(unknown))}; name every level")
    kept = sorted(texts, key=place.__getitem__)
    rank = np.array([kept.index(text) for text in texts], dtype=np.intp)
    return Factor(str(name), rank[found.codes], tuple(kept))


def sum_table(levels: int) -> Floats:
    """Sum coding, (levels, levels - 1): each column one level against the last, so that effects add up to zero."""
    return np.vstack([np.eye(levels - 1), -np.ones(levels - 1)])


def factor_variable(factor: Factor, coding: Coding, internal: Coding = "sum") -> Variable:
    """A factor in `internal` columns that is reported in `coding`."""
    k = len(factor.levels)
    tables = {"sum": sum_table(k), "treatment": np.eye(k)[:, 1:]}
    inner, outer = (np.column_stack([np.ones(k), tables[each]]) for each in (internal, coding))
    shown = factor.levels[1:] if coding == "treatment" else factor.levels[:-1]
    back = np.eye(k) if internal == coding else np.linalg.solve(outer, inner)
    labels = tuple(f"{factor.name}[{level}]" for level in shown)
    return Variable(factor.name, labels, back, codes=factor.codes, table=tables[internal])


def number_variable(column: pd.Series[Any], name: Hashable, centre: bool = True) -> Variable:
    """A numeric column, centred (unless told otherwise) and divided by a power of two near its size.

    Raises BadValue (text, NaN, infinity) or TooFew (one value).
    """
    x = numbers_of(column, name)
    empty = np.flatnonzero(np.isnan(x)).tolist()
    if empty:
        where = listed((f"row {row + 1}" for row in empty), len(empty))
        raise BadValue(f"column {name!r} has no number in {where}; name every row's number or take these rows out")
    high, low = difference(x, np.full_like(x, x.min()))
    if not high.any():
        raise TooFew(f"column {name!r} has one value, {x[0]:g}; an effect of it needs two or more")
    mean = math.fsum(high.tolist()) / len(high) if centre else 0.0
    moved = (high - mean) + low if centre else x
    _, exponent = math.frexp(math.sqrt(_mean_square(moved)))
    middle, size = (float(x.min()) + mean if centre else 0.0), math.ldexp(1.0, exponent)
    back = np.array([[1.0, -middle / size], [0.0, 1 / size]])
    return Variable(str(name), (str(name),), back, values=np.ldexp(moved, -exponent))


def _mean_square(values: Floats) -> float:
    largest = float(np.abs(values).max())
    return float(np.mean((values / largest) ** 2)) * largest * largest
