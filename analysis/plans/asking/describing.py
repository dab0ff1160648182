"""Describing ratings: means with intervals, trends within families, physical against emotional, errors of targets."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Annotated, Literal

from pydantic import Field

from palpate.analysis.plans.answers import Answer, Asked, Kind, Selected
from palpate.analysis.plans.idle import Idle
from palpate.protocols.lazy import lazy_function
from palpate.protocols.study import Level, Number, Text, Whole

Confidence = Annotated[float, Field(gt=0, lt=1)]
Correction = Literal["holm", "bonferroni", "none"]


class Means(Asked):
    """`by`: the columns whose combinations have a mean each; those that never change within a participant are groups.

    `interval` names how `ci_low` and `ci_high` are made.
    """

    test: Literal["means"]
    by: Annotated[tuple[Text, ...], Field(min_length=1)]
    interval: Literal["cousineau_morey", "loftus_masson", "between", "none"] = "cousineau_morey"
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that change nothing beside the others."""
        yield from super().idle()
        if self.interval == "none":
            yield Idle("confidence", "with `interval: none`")


class Trends(Asked):
    """`pooled`: the column of the levels; `families`: the column that says which family a level belongs to.

    `category: mean` also follows the mean over each category's attributes. `numeric` is a column with one number for
    each level (else levels stand one step apart), `reference` a level that belongs to no trend, `family` a size of the
    family of slopes fixed beforehand, `reversed` the attributes whose scale is turned round before averaging.
    """

    test: Literal["trends"]
    families: Text
    pooled: Text
    category: Literal["mean", "none"] = "mean"
    numeric: Text | None = None
    reference: Level | None = None
    correction: Correction = "holm"
    family: Annotated[Whole, Field(ge=1)] | None = None
    reversed: tuple[Text, ...] = ()
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that change nothing beside the others."""
        yield from super().idle()
        if self.correction == "none":
            yield Idle("family", "with `correction: none`")


class Categories(Asked):
    """`by`: the columns of the levels at which the two categories are compared.

    `over`: the columns within which participants are compared with each other. `reversed`: attributes whose scale is
    turned round before averaging.
    """

    test: Literal["categories"]
    by: Annotated[tuple[Text, ...], Field(min_length=1)]
    over: Annotated[tuple[Text, ...], Field(min_length=1)] = ("stimulus",)
    correction: Correction = "holm"
    reversed: tuple[Text, ...] = ()
    confidence: Confidence = 0.95


class TargetErrors(Asked):
    """`target`: the column of the wished-for value; `attribute_column`: that of the attribute it was wished for.

    `target_scale`: the ends of the scale that targets are on, where it is not the ratings' own.
    """

    test: Literal["target_error"]
    target: Text = "target"
    attribute_column: Text = "stimulus.attribute"
    target_scale: tuple[Number, Number] | None = None
    confidence: Confidence = 0.95


_means: Callable[[Selected, Means], Answer] = lazy_function("palpate.analysis.plans.asking.describing_answers:means")


def _means_of_what_is_there(selected: Selected, asked: Means) -> Answer:
    """With gaps: each mean over participants is one of the same stimuli, or there is none."""
    from palpate.analysis.plans.asking.mixed_model_answers import refuse_averaging

    refuse_averaging(selected, asked.by)
    return _means(selected, asked)


def _cells(asked: Means) -> tuple[str, ...]:
    return asked.by


MEANS = Kind(Means, _means, each="outcome", complete=_cells, with_gaps=_means_of_what_is_there)
TRENDS = Kind(Trends, lazy_function("palpate.analysis.plans.asking.describing_answers:trends"), each="all")
CATEGORIES = Kind(
    Categories, lazy_function("palpate.analysis.plans.asking.describing_categories:categories"), each="all"
)
TARGET_ERROR = Kind(
    TargetErrors, lazy_function("palpate.analysis.plans.asking.describing_answers:target_error"), each="all"
)
