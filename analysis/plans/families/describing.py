"""Descriptions of ratings: means with intervals, trends within families, physical against emotional, target errors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from operator import attrgetter
from typing import Annotated, Literal

from pydantic import Field

from palpate.analysis.plans.answers import Confidence, Kind, StatisticSettings
from palpate.analysis.plans.idle import Idle
from palpate.protocols.registry import lazy_function
from palpate.protocols.study import Level, Number, Text, Whole

_ANSWERS = "palpate.analysis.plans.families.describing_answers"
_OF_STUDY = "palpate.analysis.plans.families.problems_of_study"

Correction = Literal["holm", "bonferroni", "none"]


class Means(StatisticSettings):
    """The settings of means: one for each combination of `by`; columns that are constant within participants are
    groups.

    `interval` names the method of `ci_low` and `ci_high`.
    """

    test: Literal["means"]
    by: Annotated[tuple[Text, ...], Field(min_length=1)]
    interval: Literal["cousineau_morey", "loftus_masson", "between", "none"] = "cousineau_morey"
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if self.interval == "none":
            yield Idle("confidence", "with `interval: none`")


class Trends(StatisticSettings):
    """The settings of trends: `pooled` is the column of the levels, `families` the column of their families.

    `category: mean` adds the mean over each category's attributes. `numeric` is a column with one number per level (by
    default levels are one step apart), `reference` a level without a trend, `family` the size of the family of slopes
    fixed beforehand, `reversed` the attributes whose scale is reversed before averaging.
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
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if self.correction == "none":
            yield Idle("family", "with `correction: none`")


class Categories(StatisticSettings):
    """The settings of a comparison of the two categories: `by` are the columns of the levels.

    `over`: the columns within which participants are compared with each other. `reversed`: attributes whose scale is
    reversed before averaging.
    """

    test: Literal["categories"]
    by: Annotated[tuple[Text, ...], Field(min_length=1)]
    over: Annotated[tuple[Text, ...], Field(min_length=1)] = ("stimulus",)
    correction: Correction = "holm"
    reversed: tuple[Text, ...] = ()
    confidence: Confidence = 0.95


class TargetErrors(StatisticSettings):
    """The settings of target errors: `target` is the column of the wished value, `attribute_column` of its attribute.

    `target_scale`: the ends of the scale that targets are on, if it is not the ratings' own.
    """

    test: Literal["target_error"]
    target: Text = "target"
    attribute_column: Text = "stimulus.attribute"
    target_scale: tuple[Number, Number] | None = None
    confidence: Confidence = 0.95


KINDS: Mapping[str, Kind] = {
    "means": Kind(
        "mean ratings",
        Means,
        lazy_function(f"{_ANSWERS}:means"),
        each="outcome",
        complete=attrgetter("by"),
        with_gaps=lazy_function(f"{_ANSWERS}:means_with_gaps"),
    ),
    "trends": Kind(
        "trends within families",
        Trends,
        lazy_function(f"{_ANSWERS}:trends"),
        each="all",
        problems=lazy_function(f"{_OF_STUDY}:trend_problems"),
    ),
    "categories": Kind(
        "kinds of attribute",
        Categories,
        lazy_function(f"{_ANSWERS}:categories"),
        each="all",
        problems=lazy_function(f"{_OF_STUDY}:category_problems"),
    ),
    "target_error": Kind(
        "error from targets",
        TargetErrors,
        lazy_function(f"{_ANSWERS}:target_error"),
        each="all",
        problems=lazy_function(f"{_OF_STUDY}:target_problems"),
    ),
}
