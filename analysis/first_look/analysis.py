"""The content of a report on one data set, computed once: design check, means and tests."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from palpate.analysis.first_look.figures import level_means
from palpate.analysis.first_look.study_statistics import Row, StudyStatistics, Test, study_statistics
from palpate.analysis.ratings.dataset import Ratings
from palpate.analysis.ratings.describe import describe
from palpate.analysis.ratings.design import check_ratings
from palpate.analysis.ratings.design_report import DesignReport
from palpate.analysis.statistics.apa import P_COLUMNS, is_corrected
from palpate.protocols.extras import installed_version
from palpate.protocols.progress import Progress

GREENHOUSE_GEISSER = "Greenhouse-Geisser"


@dataclass(frozen=True)
class Analysis:
    """A data set with everything that was computed from it.

    `levels` holds the means that the figures show, `stimuli` those of every stimulus (every cell of the design),
    both over participants.
    """

    title: str
    ratings: Ratings
    design: DesignReport
    levels: pd.DataFrame
    stimuli: pd.DataFrame
    statistics: StudyStatistics

    def headline(self, attribute: str) -> Test | None:
        """Return the first test of an attribute: of the pooled factor, else of the crossed factors, else of groups."""
        for kind in ("pooled", "crossed", "between"):
            for test in self.statistics.tests:
                if test.attribute == attribute and test.question.kind == kind:
                    return test
        return None


def analyse_ratings(ratings: Ratings, title: str = "", progress: Progress = lambda *_: None) -> Analysis:
    """Check the design, describe and test. Raises DataRefused where the ratings cannot be described."""
    return Analysis(
        title=title or ratings.name,
        ratings=ratings,
        design=check_ratings(ratings),
        levels=level_means(ratings),
        stimuli=stimulus_means(ratings),
        statistics=study_statistics(ratings, progress),
    )


def stimulus_means(ratings: Ratings) -> pd.DataFrame:
    """Return mean and SD across participants of every attribute for every stimulus."""
    named = ("stimulus",) if "stimulus" in ratings.table.columns and "stimulus" not in ratings.within else ()
    return describe(ratings, ("attribute", *ratings.within, *named), kind="over participants")


def correction(row: Row) -> str:
    """Return the name of the correction of an effect's p, "" for none."""
    return GREENHOUSE_GEISSER if is_corrected(with_nan(row)) else ""


def reported_p(row: Row) -> float | None:
    """Return the p value of a sentence, corrected if the effect has a correction."""
    p: float | None = row[P_COLUMNS["GG" if correction(row) else "none"]]
    return p


def with_nan(row: Row) -> dict[str, Any]:
    """Return the row with undefined numbers as NaN, as the statistics returned it."""
    return {name: math.nan if value is None else value for name, value in row.items()}


def software() -> Mapping[str, str]:
    """Return the versions that the numbers were computed with."""
    import platform

    packages = ("palpate", "numpy", "scipy", "pandas", "matplotlib")
    versions = {package: installed_version(package) or "not installed" for package in packages}
    return {"python": platform.python_version(), **versions}
