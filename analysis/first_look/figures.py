"""The figures of a report: the means of every level, and trends if levels are ordered in families."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import groupby

import pandas as pd

from palpate.analysis.figures.figure_kind import DrawnFigure, FigureData, FigureInput
from palpate.analysis.plans.selecting import all_ratings
from palpate.analysis.ratings.dataset import Ratings
from palpate.analysis.ratings.describe import describe


@dataclass(frozen=True)
class Picture:
    """A figure of the report: its file name, its title, and a function that draws it."""

    name: str
    data: FigureData
    draw: Callable[[FigureData], DrawnFigure]


def shown_factors(ratings: Ratings) -> tuple[str, ...]:
    """Return the factors on the axis: the pooled one, else every within factor; () for no figure."""
    return (ratings.pooled,) if ratings.pooled else ratings.within


def level_means(ratings: Ratings) -> pd.DataFrame:
    """Return mean and SD across participants of every attribute at every shown level, in the order of the study.

    The columns are those of `describe(..., kind="over participants")`.
    """
    return describe(ratings, ("attribute", *shown_factors(ratings)), kind="over participants")


def pictures(ratings: Ratings) -> Iterator[Picture]:
    """Yield the figures of this data set; none if no factor varies within participants.

    Trends have no whiskers, since the figure before has those of the means. Raises DataRefused where a level belongs to
    two families.
    """
    from palpate.analysis.figures.means import MEANS, MeansSettings
    from palpate.analysis.figures.trends import TRENDS, TrendsSettings

    factors = shown_factors(ratings)
    if not factors:
        return
    # The column that groups the levels of the one factor; several factors group themselves by the first.
    families = ratings.families if ratings.families not in ("", *factors) and len(factors) == 1 else None
    given, settings = FigureInput(all_ratings(ratings)), {"by": factors, "families": families}
    means = MEANS.data(given, MeansSettings(name="means", figure="means", **settings))
    yield Picture("means", means, MEANS.draw)
    sizes = [len(list(own)) for _, own in groupby(means.words["levels"], key=lambda level: level["family"])]
    if len(sizes) > 1 and max(sizes) > 1:
        trends = TrendsSettings(name="trends", figure="trends", whiskers="none", **settings)
        yield Picture("trends", TRENDS.data(given, trends), TRENDS.draw)
