"""Ranks and ordered answers: Friedman, Nemenyi, Wilcoxon, aligned ranks, ordinal models, Likert summaries."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from analysis.plans.answers import Answer, Asked, Kind, Selected, missing_without_effect
from analysis.plans.idle import ON_RANKS, Idle
from protocols.study import Level, Number, Text, Whole

Confidence = Annotated[float, Field(gt=0, lt=1)]
Correction = Literal["bonferroni", "holm", "none"]


class Friedman(Asked):
    """`factor`: a column within participants. `exact` also asks for the exact p, where it can be afforded."""

    test: Literal["friedman"]
    factor: Text
    exact: bool = True
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that change nothing beside the others."""
        yield from super().idle()
        yield Idle("normalise", ON_RANKS)


class Nemenyi(Asked):
    """`factor`: a column within participants. `ties` takes the spread of the ranks found, ties and all."""

    test: Literal["nemenyi"]
    factor: Text
    ties: bool = False

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that change nothing beside the others."""
        yield from super().idle()
        yield Idle("normalise", ON_RANKS)


class Wilcoxon(Asked):
    """`factor`: a column within participants (signed ranks), or constant in each of them (rank sums).

    `family`: the size of the family fixed beforehand, at least the number of pairs.
    """

    test: Literal["wilcoxon"]
    factor: Text
    correction: Correction = "holm"
    family: Annotated[Whole, Field(ge=1)] | None = None
    zeros: Literal["wilcoxon", "pratt"] = "wilcoxon"
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that change nothing beside the others."""
        yield from super().idle()
        if self.correction == "none":
            yield Idle("family", "with `correction: none`")


class AlignedRanks(Asked):
    """The factors within participants and between them, at least one in all."""

    test: Literal["aligned_ranks"]
    within: tuple[Text, ...] = ()
    between: tuple[Text, ...] = ()
    sum_of_squares: Literal["II", "III"] = "III"

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that change nothing beside the others."""
        yield from super().idle()
        if len(self.between) < 2 and not (self.between and self.within):
            yield Idle("sum_of_squares", "with factors within participants alone, or one factor between them")

    @model_validator(mode="after")
    def _some(self) -> Self:
        if not self.within + self.between:
            raise ValueError("name a factor in `within` or `between`")
        return self


class Ordinal(Asked):
    """`fixed`: columns as factors, `numeric`: columns as numbers, `interactions`: "a:b".

    `random: participant` gives each participant an intercept; without it every answer counts as independent.
    `coding`: against the study's first level, or against the mean of all.
    """

    test: Literal["ordinal_model"]
    fixed: tuple[Text, ...] = ()
    numeric: tuple[Text, ...] = ()
    interactions: tuple[Text, ...] = ()
    random: Literal["participant"] | None = None
    link: Literal["logit", "probit"] = "logit"
    coding: Literal["treatment", "sum"] = "treatment"
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that change nothing beside the others."""
        yield from super().idle()
        if not self.fixed:
            yield Idle("coding", "without a factor in `fixed`")

    @model_validator(mode="after")
    def _some(self) -> Self:
        if not self.fixed + self.numeric:
            raise ValueError("name a predictor in `fixed` or `numeric`")
        return self


class Likert(Asked):
    """`by`: a column whose levels are summarised apart. `points`: the scale's, if not every whole number of the scale.

    `form`: the only form whose items count, where there are several.
    """

    test: Literal["likert"]
    by: Text | None = None
    points: Annotated[tuple[Number, ...], Field(min_length=2)] | None = None
    form: Level | None = None

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that change nothing beside the others."""
        yield from super().idle()
        yield from missing_without_effect(self, "on Likert summaries, which count who answered")


def _friedman(selected: Selected, asked: Friedman) -> Answer:
    from analysis.plans.asking.ordinal_ranks import friedman_answer

    return friedman_answer(selected, asked)


def _nemenyi(selected: Selected, asked: Nemenyi) -> Answer:
    from analysis.plans.asking.ordinal_ranks import nemenyi_answer

    return nemenyi_answer(selected, asked)


def _wilcoxon(selected: Selected, asked: Wilcoxon) -> Answer:
    from analysis.plans.asking.ordinal_ranks import wilcoxon_answer

    return wilcoxon_answer(selected, asked)


def _aligned_ranks(selected: Selected, asked: AlignedRanks) -> Answer:
    from analysis.plans.asking.ordinal_ranks import aligned_answer

    return aligned_answer(selected, asked)


def _ordinal_model(selected: Selected, asked: Ordinal) -> Answer:
    from analysis.plans.asking.ordinal_answers import model_answer

    return model_answer(selected, asked)


def _likert(selected: Selected, asked: Likert) -> Answer:
    from analysis.plans.asking.ordinal_answers import likert_answer

    return likert_answer(selected, asked)


def _factor(asked: Friedman | Nemenyi | Wilcoxon) -> tuple[str, ...]:
    return (asked.factor,)


def _within(asked: AlignedRanks) -> tuple[str, ...]:
    return asked.within


def _predictors(asked: Ordinal) -> tuple[str, ...]:
    return asked.fixed


FRIEDMAN = Kind(Friedman, _friedman, complete=_factor)
NEMENYI = Kind(Nemenyi, _nemenyi, complete=_factor)
WILCOXON = Kind(Wilcoxon, _wilcoxon, complete=_factor)
ALIGNED_RANKS = Kind(AlignedRanks, _aligned_ranks, complete=_within)
ORDINAL_MODEL = Kind(Ordinal, _ordinal_model, complete=_predictors, with_gaps=_ordinal_model)
LIKERT = Kind(Likert, _likert, takes="forms", each="all")
