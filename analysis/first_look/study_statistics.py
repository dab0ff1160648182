"""The tests of a rating study, their order, and the averages that they use."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import pandas as pd

from palpate.analysis.ratings.dataset import DataRefused, Ratings, natural
from palpate.analysis.ratings.design import CellFaults, cell_faults
from palpate.analysis.statistics.anova import anova, rm_anova
from palpate.analysis.statistics.f_and_t import adjusted
from palpate.analysis.statistics.pairwise import pairs_in_order, pairwise_tests
from palpate.protocols.progress import Progress
from palpate.protocols.undefined import finite_or_none
from palpate.protocols.wording import count, phrase

Kind = Literal["crossed", "pooled", "between", "pairs"]
Row = Mapping[str, Any]

EVERYONE = "all participants"
OPTIONS: Mapping[str, Any] = {"dv": "value", "subject": "participant", "aggregate": "mean"}
"""Options of the tests: averaging is safe, since every participant must first have every cell as often as planned."""


@dataclass(frozen=True)
class Question:
    """One kind of test for every attribute: its factors, its participants, and what is averaged before."""

    kind: Kind
    factors: tuple[str, ...]
    group: tuple[str, str] | None = None
    averaged_over: tuple[str, ...] = ()

    @property
    def scope(self) -> str:
        """The participants that the test is about, in words."""
        return f"{self.group[0]} {self.group[1]}" if self.group else EVERYONE


@dataclass(frozen=True)
class Test:
    """The answer to one question for one attribute: one row per effect or pair, or the reason why there is none.

    A row has the columns of `rm_anova`, `anova` or `pairwise_tests` (there `p_bonferroni` and `p_holm` stand for
    `p_corr`). A number that is undefined is None and the row's `note` says why. `refused` is "" where there are rows.
    `ratings_per_cell` are the fewest and the most ratings that one participant's value is the mean of,
    `ratings_per_level` the same for each level of the first factor.
    """

    question: Question
    attribute: str
    participants: int = 0
    rows: tuple[Row, ...] = ()
    ratings_per_cell: tuple[int, int] = (1, 1)
    refused: str = ""
    ratings_per_level: Mapping[str, tuple[int, int]] = field(default_factory=dict)


@dataclass(frozen=True)
class StudyStatistics:
    """Every test of a study, by question, then by attribute."""

    questions: tuple[Question, ...]
    tests: tuple[Test, ...]

    def of(self, question: Question) -> tuple[Test, ...]:
        """Return the tests of one question, in the order of the attributes."""
        return tuple(test for test in self.tests if test.question == question)


def questions_of(ratings: Ratings) -> tuple[Question, ...]:
    """Return the questions in order: the crossed factors, the pooled factor, the groups, the pairs of levels.

    The crossed factors are tested within each group if the groups had different levels (other cars, in the door study),
    else over everyone. The other tests are over everyone, on each participant's means over the factors in
    `averaged_over`, so that a participant counts once in each level (between groups: once).
    """
    within, pooled = ratings.within, ratings.pooled
    apart = bool(differing_factors(ratings))
    questions: list[Question] = []
    if within:
        groups = ratings.levels(ratings.between[0]) if len(ratings.between) == 1 and apart else ()
        scopes: list[tuple[str, str] | None] = [(ratings.between[0], group) for group in groups]
        questions += [Question("crossed", within, scope, _others(ratings, *within)) for scope in scopes or [None]]
    if pooled and (within != (pooled,) or apart):
        questions.append(Question("pooled", (pooled,), None, _others(ratings, pooled)))
    questions += [Question("between", (factor,), None, ratings.cells) for factor in ratings.between]
    compared = (ratings.families,) if ratings.families else (pooled,) if pooled else within
    questions += [Question("pairs", (factor,), None, _others(ratings, factor)) for factor in compared]
    return tuple(questions)


def study_statistics(ratings: Ratings, progress: Progress = lambda *_: None) -> StudyStatistics:
    """Answer every question for every attribute; a test that cannot be computed keeps its place, with the reason.

    No test ignores a missing cell: it is refused if any participant lacks a cell.
    """
    questions = questions_of(ratings)
    faults = cell_faults(ratings)
    steps = [(question, attribute) for question in questions for attribute in ratings.attributes]
    tests = []
    for done, (question, attribute) in enumerate(steps):
        progress(done, len(steps), f"{attribute}: {' x '.join(question.factors)}, {question.scope}")
        tests.append(_answer(ratings, faults, question, attribute))
    progress(len(steps), len(steps), "")
    return StudyStatistics(questions, tuple(tests))


def levels_by_group(ratings: Ratings, factor: str) -> dict[str, tuple[str, ...]]:
    """Return the levels of a factor that each group had, in the order of the study; {} without groups."""
    if not ratings.between:
        return {}
    groups = ratings.table.groupby(list(ratings.between), sort=True)
    return {
        ", ".join(f"{name} {level}" for name, level in zip(ratings.between, group, strict=True)): tuple(
            level for level in ratings.levels(factor) if level in set(rows[factor])
        )
        for group, rows in groups
    }


def differing_factors(ratings: Ratings) -> tuple[str, ...]:
    """Return the factors whose levels differ between groups of participants."""
    return tuple(name for name in ratings.cells if len(set(levels_by_group(ratings, name).values())) > 1)


def _others(ratings: Ratings, *factors: str) -> tuple[str, ...]:
    return tuple(name for name in ratings.cells if name not in factors)


def _answer(ratings: Ratings, faults: CellFaults, question: Question, attribute: str) -> Test:
    """Return the answer to a question for an attribute, or the reason why there is none."""
    table, people = ratings.table, ratings.participants
    if question.group is not None:
        table = table[table[question.group[0]] == question.group[1]]
        people = natural(table["participant"].tolist())  # also one without any rating of the attribute
    table = table[table["attribute"] == attribute]
    try:
        faults.demand_none(attribute, people)
        # Refuse levels that only some participants were to meet: groups may differ in them without a cell
        # missing.
        for factor in question.factors if question.kind != "between" else ():
            own_levels = table.groupby("participant")[factor].agg(frozenset)
            every = frozenset(table[factor])
            missing = [(str(who), natural(every - own)) for who, own in own_levels.items() if own != every]
            if missing:
                who, levels = missing[0]
                more = f" ({count(len(missing), 'participant')} in all lack a level)" if len(missing) > 1 else ""
                raise DataRefused(
                    f"{who} was not to meet {factor} {phrase(levels)}, others were{more};"
                    f" levels of {factor} are compared only where everyone met them all"
                )
        rows = _test(table, question, ratings)
    except ValueError as refusal:
        return Test(question, attribute, refused=str(refusal))
    factor = question.factors[0]
    unit = ["participant", *(question.factors if question.kind != "between" else ())]
    sizes = table.groupby(unit, as_index=False).agg(level=(factor, "first"), size=("value", "size"))
    by_level = {str(level): own["size"] for level, own in sizes.groupby("level")}
    order = (level for level in ratings.levels(factor) if level in by_level)
    per_level = {level: (int(by_level[level].min()), int(by_level[level].max())) for level in order}
    ends = (min(least for least, _ in per_level.values()), max(most for _, most in per_level.values()))
    return Test(question, attribute, table["participant"].nunique(), rows, ends, ratings_per_level=per_level)


def _test(table: pd.DataFrame, question: Question, ratings: Ratings) -> tuple[Row, ...]:
    """Return the rows of the statistic; pairs are in the order of the study, with Bonferroni's and Holm's p."""
    factor = question.factors[0]
    if question.kind == "between":
        return _rows(anova(table, between=factor, **OPTIONS))
    if question.kind != "pairs":
        return _rows(rm_anova(table, within=list(question.factors), **OPTIONS))
    tests = pairwise_tests(table, within=factor, **OPTIONS).drop(columns=["p_corr", "p_adjust"])
    pairs = pairs_in_order(tests, ratings.levels(factor))
    p = [pair["p_unc"] for pair in pairs]
    both = zip(pairs, adjusted(p, "bonf"), adjusted(p, "holm"), strict=True)
    return _rows(
        pd.DataFrame([{**pair, "p_bonferroni": bonferroni, "p_holm": holm} for pair, bonferroni, holm in both])
    )


def _rows(table: pd.DataFrame) -> tuple[Row, ...]:
    """Return a table's rows as plain values, with None for undefined numbers (the row's note says why)."""
    return tuple(
        {
            str(name): value if value is None or isinstance(value, bool | str | int) else finite_or_none(float(value))
            for name, value in row.items()
        }
        for row in table.to_dict("records")
    )
