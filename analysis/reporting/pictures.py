"""From ratings to what a figure shows: the levels on the axis, their families, and the described means."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pandas as pd

from analysis.ratings.dataset import DataRefused, Ratings
from analysis.ratings.describe import describe
from analysis.reporting.figure_data import Dot, Picture, RatedAttribute

JOINT = "\x1f"
"""Between the levels of one cell: a character that no name holds, so that two cells never share a name."""


def shown_factors(ratings: Ratings) -> tuple[str, ...]:
    """The factors whose levels stand on the axis: the pooled one, else every within factor; () leaves no figure."""
    return (ratings.pooled,) if ratings.pooled else ratings.within


def level_means(ratings: Ratings) -> pd.DataFrame:
    """Mean and SD across participants of every attribute at every shown level, in the order of the study.

    The columns are those of `describe(..., kind="over participants")`.
    """
    return describe(ratings, ("attribute", *shown_factors(ratings)), kind="over participants")


def picture(ratings: Ratings, means: pd.DataFrame) -> Picture:
    """What Figures 5.9 and 5.10 show of `ratings`; `means` is the table that `level_means` gave.

    Levels are gathered by family: the study's `families` column, or the first of several within factors.
    Raises DataRefused where a level belongs to two families.
    """
    factors = shown_factors(ratings)
    rows = means[list(factors)].itertuples(index=False, name=None)
    cells = list(dict.fromkeys(tuple(map(str, row)) for row in rows))
    family = _families(ratings, cells)
    order = list(dict.fromkeys(family.values()))
    levels = sorted((JOINT.join(cell) for cell in cells), key=lambda level: order.index(family[level]))
    several = len(factors) > 1
    return Picture(
        attributes=tuple(_attribute(ratings, name) for name in ratings.attributes),
        levels=tuple(levels),
        family_of=family,
        dots=_dots(means, factors),
        scale=_scale(ratings),
        short={JOINT.join(cell): " × ".join(cell[1:]) for cell in cells} if several else None,
    )


def _attribute(ratings: Ratings, name: str) -> RatedAttribute:
    return RatedAttribute(name, name, ratings.antonyms.get(name, ""), ratings.categories.get(name, ""))


def _families(ratings: Ratings, cells: list[tuple[str, ...]]) -> dict[str, str]:
    if len(cells[0]) > 1:
        return {JOINT.join(cell): cell[0] for cell in cells}
    factor = shown_factors(ratings)[0]
    if not ratings.families or ratings.families == factor:
        return {cell[0]: factor for cell in cells}
    pairs = ratings.table[[factor, ratings.families]].drop_duplicates().itertuples(index=False, name=None)
    found: dict[str, str] = {}
    for level, family in pairs:
        if found.setdefault(str(level), str(family)) != str(family):
            raise DataRefused(
                f"data set {ratings.name!r}: {factor} {level!r} belongs to {ratings.families} {found[str(level)]!r}"
                f" and {family!r}; a figure needs one family for each level: correct the stimulus table"
            )
    return {cell[0]: found[cell[0]] for cell in cells}


def _dots(means: pd.DataFrame, factors: Sequence[str]) -> dict[tuple[str, str], Dot]:
    return {
        (str(row["attribute"]), JOINT.join(str(row[factor]) for factor in factors)): Dot(
            float(row["mean"]), None if row["sd"] is None else float(row["sd"]), int(row["n"])
        )
        for row in means.to_dict("records")
    }


def _scale(ratings: Ratings) -> tuple[float, float]:
    """The declared scale, or else the range of the data between round numbers."""
    if ratings.scale is not None:
        return ratings.scale.low, ratings.scale.high
    low, high = float(ratings.table["value"].min()), float(ratings.table["value"].max())
    if not low < high:
        return low - 1.0, high + 1.0
    step = 10.0 ** math.floor(math.log10(high - low))
    return math.floor(low / step) * step, math.ceil(high / step) * step
