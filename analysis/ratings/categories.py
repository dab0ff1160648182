"""Physical against emotional attributes: their means by level, and differences between participants."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.one_sample import NAN, OneSample, one_sample
from palpate.analysis.ratings.person_cells import NO_LEVELS, Label, Levels, PersonCells, person_cells
from palpate.analysis.statistics.cells import numbers_of
from palpate.analysis.statistics.refusals import listed
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count, some


def turned(data: pd.DataFrame, attributes: Sequence[str], scale: tuple[float, float] | None) -> pd.DataFrame:
    """Return a copy with these attributes' values mirrored about the middle of the scale, or about 0 without a scale.

    Raises DataRefused for an unknown attribute.
    """
    known = list(dict.fromkeys(data["attribute"].tolist()))
    for name in attributes:
        if name not in known:
            raise DataRefused(f"no attribute {name!r} to turn round; {nearest(name, known)}")
    if not attributes:
        return data
    values = numbers_of(data["value"], "value")
    low, high = scale if scale is not None else (0.0, 0.0)
    return data.assign(value=np.where(data["attribute"].isin(list(attributes)), (low - values) + high, values))


def category_cells(
    data: pd.DataFrame,
    categories: Mapping[str, str],
    by: Sequence[str],
    *,
    subject: str = "participant",
    levels: Levels = NO_LEVELS,
) -> PersonCells:
    """Return each participant's mean over the attributes of each category, in every combination of `by`.

    The attributes of a category count equally; if one of them is missing, so is the mean. The cells' columns are
    `category` and `by`. Raises DataRefused where an attribute has no category.
    """
    cells = person_cells(data, ("attribute", *by), subject=subject, levels=levels)
    # The cells of each category and combination of the other columns.
    attributes = list(dict.fromkeys(cell[0] for cell in cells.cells))
    if without := [name for name in attributes if name not in categories]:
        raise DataRefused(
            f"no category is declared for {listed(without, len(without))}; say `category` in the study's attributes"
        )
    cells_of: dict[str, dict[Label, list[int]]] = {categories[name]: {} for name in attributes}
    for j, (name, *rest) in enumerate(cells.cells):
        cells_of[categories[name]].setdefault(tuple(rest), []).append(j)
    order = {rest: j for j, rest in enumerate(dict.fromkeys(cell[1:] for cell in cells.cells))}
    members = {name: dict(sorted(places.items(), key=lambda item: order[item[0]])) for name, places in cells_of.items()}
    expected = {
        category: {cells.cells[j][0] for at in places.values() for j in at} for category, places in members.items()
    }
    labels = [(category, *rest) for category, places in members.items() for rest in places]
    columns, counts = [], []
    for category, places in members.items():
        for at in places.values():
            incomplete = len(at) < len(expected[category])
            mean = np.array(
                [math.fsum(row) / len(row) if not math.isnan(sum(row)) else NAN for row in cells.values[:, at].tolist()]
            )
            columns.append(np.full_like(mean, NAN) if incomplete else mean)
            counts.append(cells.counts[:, at].sum(axis=1))
    values = np.column_stack(columns)
    return PersonCells(
        values,
        np.where(np.isnan(values), 0, np.column_stack(counts)),
        cells.participants,
        ("category", *by),
        tuple(labels),
    )


def two_categories(categories: Mapping[str, str], attributes: Sequence[str]) -> tuple[str, str]:
    """Return the two categories of these attributes in the study's order. Raises DataRefused for any other number."""
    names = list(dict.fromkeys(categories[name] for name in attributes if name in categories))
    if len(names) != 2:
        raise DataRefused(
            f"{count(len(names), 'category', 'categories')} among the attributes ({some(names) or 'none'});"
            " a comparison needs two: say `category: physical` or `category: emotional` in the study's attributes, and"
            " leave none out"
        )
    return names[0], names[1]


def category_differences(
    cells: PersonCells, pair: tuple[str, str], confidence: float = 0.95
) -> list[tuple[Label, OneSample]]:
    """Return the second category minus the first over participants, at each combination of the other columns."""
    places = {cell: j for j, cell in enumerate(cells.cells)}
    rows = []
    for rest in dict.fromkeys(cell[1:] for cell in cells.cells):
        both = [places.get((category, *rest)) for category in pair]
        if None not in both:
            first, second = (cells.values[:, j] for j in both if j is not None)
            rows.append(
                (rest, one_sample(second - first, floor=cells.floor(), confidence=confidence, what="differences"))
            )
    return rows


def overall(cells: PersonCells) -> PersonCells:
    """Return each participant's mean over all of their cells of a category, with equal weights."""
    names = list(dict.fromkeys(cell[0] for cell in cells.cells))
    at = [[j for j, cell in enumerate(cells.cells) if cell[0] == name] for name in names]
    known = [
        [[value for value in row if not math.isnan(value)] for row in cells.values[:, places].tolist()] for places in at
    ]
    values = [[math.fsum(row) / len(row) if row else NAN for row in rows] for rows in known]
    counts = np.column_stack([cells.counts[:, places].sum(axis=1) for places in at])
    means = np.array(values).T
    return replace(cells, values=means, counts=counts, by=("category",), cells=tuple((name,) for name in names))
