"""Which tests are run for a rating study, in which order, and on which averages."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import pandas as pd

from analysis.ratings.dataset import Ratings
from analysis.statistics.between import anova
from analysis.statistics.pairwise import pairwise_tests
from analysis.statistics.within import rm_anova

Kind = Literal["crossed", "pooled", "between", "pairs"]
Progress = Callable[[int, int, str], None]
Row = Mapping[str, Any]

EVERYONE = "all participants"


@dataclass(frozen=True)
class Question:
    """One kind of test, asked for every attribute: on which factors, of whom, and what is averaged before."""

    kind: Kind
    factors: tuple[str, ...]
    group: tuple[str, str] | None = None
    averaged_over: tuple[str, ...] = ()

    @property
    def scope(self) -> str:
        """Who is asked about, in words."""
        return f"{self.group[0]} {self.group[1]}" if self.group else EVERYONE


@dataclass(frozen=True)
class Test:
    """The answer to one question for one attribute: one row per effect or pair, or the reason why there is none.

    A number that is undefined is None and its row's `note` says why. Where `dropped` is not empty those
    participants were left out of this test; `ratings_per_cell` says how many ratings a value is the mean of.
    """

    question: Question
    attribute: str
    participants: int = 0
    rows: tuple[Row, ...] = ()
    ratings_per_cell: tuple[int, int] = (1, 1)
    refused: str = ""


@dataclass(frozen=True)
class StudyStatistics:
    """Every test of a study, by question and within it by attribute."""

    questions: tuple[Question, ...]
    tests: tuple[Test, ...]

    def of(self, question: Question) -> tuple[Test, ...]:
        """The tests that answer one question, in the order of the attributes."""
        return tuple(test for test in self.tests if test.question == question)


def questions_of(ratings: Ratings) -> tuple[Question, ...]:
    """What is tested: the crossed factors, the factor that all participants share, the groups, and the pairs.

    The crossed factors are tested within each group where the groups felt different stimuli (the door study:
    other cars), over everyone where all felt the same. The last question on means of what is left out is asked
    of participants' means, so that no participant counts twice.
    """
    return (*_crossed(ratings), *_pooled(ratings), *_between(ratings), *_pairs(ratings))


def study_statistics(ratings: Ratings, progress: Progress = lambda *_: None) -> StudyStatistics:
    """Ask every question for every attribute; a test that cannot be made keeps its place, with the reason."""
    questions = questions_of(ratings)
    steps = [(question, attribute) for question in questions for attribute in ratings.attributes]
    tests = []
    for done, (question, attribute) in enumerate(steps):
        progress(done, len(steps), f"{attribute}: {' x '.join(question.factors)}, {question.scope}")
        tests.append(_answer(ratings, question, attribute))
    progress(len(steps), len(steps), "")
    return StudyStatistics(questions, tuple(tests))


def _crossed(ratings: Ratings) -> Iterator[Question]:
    if not ratings.within:
        return
    if len(ratings.between) == 1 and not _same_for_all(ratings):
        for group in ratings.levels(ratings.between[0]):
            yield Question("crossed", ratings.within, (ratings.between[0], group))
    else:
        yield Question("crossed", ratings.within)


def _pooled(ratings: Ratings) -> Iterator[Question]:
    only = ratings.within == (ratings.pooled,) and _same_for_all(ratings)
    if ratings.pooled and not only:
        yield Question("pooled", (ratings.pooled,), None, _others(ratings, ratings.pooled))


def _between(ratings: Ratings) -> Iterator[Question]:
    for factor in ratings.between:
        yield Question("between", (factor,), None, ratings.within)


def _pairs(ratings: Ratings) -> Iterator[Question]:
    if ratings.families:
        compared: tuple[str, ...] = (ratings.families,)
    else:
        compared = (ratings.pooled,) if ratings.pooled else ratings.within
    for factor in compared:
        yield Question("pairs", (factor,), None, _others(ratings, factor))


def _others(ratings: Ratings, factor: str) -> tuple[str, ...]:
    return tuple(name for name in ratings.within if name != factor)


def _same_for_all(ratings: Ratings) -> bool:
    """Whether every group of participants met the same levels of every within factor."""
    if not ratings.between:
        return True
    groups = ratings.table.groupby(list(ratings.between), sort=True)
    met = [tuple(frozenset(rows[factor]) for factor in ratings.within) for _, rows in groups]
    return len(set(met)) <= 1


def _answer(ratings: Ratings, question: Question, attribute: str) -> Test:
    table = ratings.table[ratings.table["attribute"] == attribute]
    if question.group is not None:
        table = table[table[question.group[0]] == question.group[1]]
    try:
        found = _tested(table, question, ratings)
    except ValueError as refusal:
        return Test(question, attribute, refused=str(refusal))
    people = int(found.attrs.get("participants", table["participant"].nunique()))
    per_cell = found.attrs.get("ratings_per_cell", (1, 1))
    rows = tuple(_row(record) for record in found.to_dict("records"))
    return Test(question, attribute, people, rows, (int(per_cell[0]), int(per_cell[1])))


def _tested(table: pd.DataFrame, question: Question, ratings: Ratings) -> pd.DataFrame:
    asked: dict[str, Any] = {"dv": "value", "subject": "participant"}
    if question.kind == "crossed":
        once = ratings.repeats == 1
        return rm_anova(table, within=list(question.factors), aggregate=None if once else "mean", **asked)
    if question.kind == "pooled":
        return rm_anova(table, within=list(question.factors), aggregate="mean", **asked)
    if question.kind == "between":
        return anova(table, between=question.factors[0], aggregate="mean", **asked)
    return _both_adjusted(table, question.factors[0], asked)


def _both_adjusted(table: pd.DataFrame, factor: str, asked: Mapping[str, Any]) -> pd.DataFrame:
    """The pairs with the p value unadjusted, by Bonferroni and by Holm, side by side."""
    found = pairwise_tests(table, within=factor, padjust="bonferroni", aggregate="mean", **asked)
    holm = pairwise_tests(table, within=factor, padjust="holm", aggregate="mean", **asked)
    both = found.rename(columns={"p_corr": "p_bonferroni"}).drop(columns="p_adjust")
    return both.assign(p_holm=holm["p_corr"])


def _row(record: Mapping[Any, Any]) -> Row:
    return {str(name): _plain(value) for name, value in record.items()}


def _plain(value: Any) -> Any:
    """A plain Python value: a number that is none becomes None (the row's note says why)."""
    if isinstance(value, bool | str) or value is None:
        return value
    if isinstance(value, int):
        return int(value)
    number = float(value)
    return number if math.isfinite(number) else None
