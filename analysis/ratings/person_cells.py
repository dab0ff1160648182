"""A long table as participants x cells: each participant's mean in each cell that occurs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.statistics.cells import Counts, cell_means, check_columns, coded, numbers_of
from palpate.analysis.statistics.doubles import ROUNDING_ULPS, Floats
from palpate.analysis.statistics.refusals import BadOption, IncompleteCells, listed

Label: TypeAlias = tuple[str, ...]
Levels: TypeAlias = Mapping[str, Sequence[str]]
NO_LEVELS: Levels = MappingProxyType({})
LISTWISE = "; pass missing='listwise' to leave such participants out"


@dataclass(frozen=True)
class PersonCells:
    """Means by participant and cell: `values[i, j]` is over `counts[i, j]` values of participant i in cell j, or NaN.

    `cells[j]` has the cell's level of each column in `by`. A missing value makes its cell missing.
    """

    values: Floats
    counts: Counts
    participants: tuple[str, ...]
    by: tuple[str, ...]
    cells: tuple[Label, ...]

    def level(self, name: str) -> list[str]:
        """Return the level of one column in every cell."""
        place = self.by.index(name)
        return [cell[place] for cell in self.cells]

    def only(self, cells: Sequence[int], people: Sequence[int] | None = None) -> PersonCells:
        """Return some cells, and some participants (None: all)."""
        rows = range(len(self.participants)) if people is None else people
        grid = np.ix_(list(rows), list(cells))
        return replace(
            self,
            values=self.values[grid],
            counts=self.counts[grid],
            participants=tuple(self.participants[i] for i in rows),
            cells=tuple(self.cells[j] for j in cells),
        )

    def without(self, name: str) -> PersonCells:
        """Return the same cells without the level of one column, which must be the same in all of them."""
        keep = [k for k, column in enumerate(self.by) if column != name]
        cells = tuple(tuple(cell[k] for k in keep) for cell in self.cells)
        return replace(self, by=tuple(self.by[k] for k in keep), cells=cells)

    def floor(self) -> float:
        """Return the variation that rounding the data alone could make."""
        known = self.values[~np.isnan(self.values)]
        return ROUNDING_ULPS * float(np.spacing(np.abs(known).max())) if known.size else 0.0


def person_cells(
    data: pd.DataFrame,
    by: Sequence[str],
    *,
    dv: str = "value",
    subject: str = "participant",
    levels: Levels = NO_LEVELS,
) -> PersonCells:
    """Return the participants' means in every combination of the columns `by` that occurs.

    Cells are in the order of `levels` if it names a column, else in natural order; participants in natural order.
    Raises UnknownColumn, BadValue; BadOption where `by` is empty.
    """
    if not by:
        raise BadOption("`by` names no column; name at least one")
    check_columns(data, [dv, subject, *by])
    y = numbers_of(data[dv], dv)
    people = coded(data[subject], subject)
    axes = []  # codes in the given order of levels, the others after them in natural order, and their labels
    for name in by:
        codes = coded(data[name], name)
        labels = [written(label) for label in codes.labels]
        known = {label: place for place, label in enumerate(levels.get(name, ()))}
        rank = sorted(range(len(labels)), key=lambda i: (known.get(labels[i], len(known)), i))
        to = np.empty(len(labels), dtype=np.intp)
        to[rank] = np.arange(len(labels))
        axes.append((to[codes.codes], [labels[i] for i in rank]))
    shape = [len(labels) for _, labels in axes]
    cell = np.ravel_multi_index([codes for codes, _ in axes], shape)
    occurring, place = np.unique(cell, return_inverse=True)
    size = len(people.labels) * len(occurring)
    flat = people.codes * len(occurring) + place
    counts = np.bincount(flat, minlength=size)
    values = cell_means(y, flat, counts).reshape(len(people.labels), len(occurring))
    places = zip(*np.unravel_index(occurring, shape), strict=True)
    return PersonCells(
        values=values,
        counts=np.where(np.isnan(values), 0, counts.reshape(values.shape)),
        participants=tuple(map(written, people.labels)),
        by=tuple(by),
        cells=tuple(tuple(axes[k][1][int(i)] for k, i in enumerate(place)) for place in places),
    )


def levels_of(levels: Levels, by: Sequence[str]) -> Levels:
    """Return the levels of these columns, out of all columns of a study."""
    return {name: levels[name] for name in by if name in levels}


def written(label: object) -> str:
    """Return a label as text; 1 and 1.0 are one label."""
    return str(int(label)) if isinstance(label, float) and label.is_integer() else str(label)


def texts_of(data: pd.DataFrame, name: str) -> list[str]:
    """Return a column of labels as text; 1, 1.0 and "1" are equal."""
    codes = coded(data[name], name)
    labels = [written(label) for label in codes.labels]
    return [labels[code] for code in codes.codes]


def complete_people(cells: PersonCells, missing: str = "raise") -> list[int]:
    """Return the participants with a value in every cell. With `missing="raise"`, IncompleteCells names the others."""
    whole = np.atleast_1d(~np.isnan(cells.values).any(axis=1))
    if not whole.all() and missing == "raise":
        gaps = np.argwhere(np.isnan(cells.values)).tolist()
        listing = listed((f"participant {cells.participants[i]!r} at {place(cells, j)}" for i, j in gaps), len(gaps))
        raise IncompleteCells(f"no value for {listing}{LISTWISE}")
    return [i for i, value in enumerate(whole.tolist()) if value]


def place(cells: PersonCells, j: int) -> str:
    """Return a description of a cell."""
    return ", ".join(f"{name} {level!r}" for name, level in zip(cells.by, cells.cells[j], strict=True))


def constant_columns(data: pd.DataFrame, names: Sequence[str], subject: str = "participant") -> tuple[str, ...]:
    """Return those of the columns that differ between participants but never within one: between factors."""
    people = coded(data[subject], subject)
    constant = []
    for name in names:
        codes = coded(data[name], name)
        pairs = np.unique(people.codes * len(codes.labels) + codes.codes)
        if len(pairs) == len(people.labels) and len(codes.labels) > 1:
            constant.append(name)
    return tuple(constant)
