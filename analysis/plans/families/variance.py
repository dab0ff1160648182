"""Analysis of variance, pairs of levels and their equivalence in plans."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from operator import attrgetter
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from palpate.analysis.plans.answers import Confidence, Kind, StatisticSettings
from palpate.analysis.plans.idle import Idle
from palpate.protocols.registry import lazy_function
from palpate.protocols.study import Number, Text, Whole

_ANSWERS = "palpate.analysis.plans.families.variance_answers"


class Anova(StatisticSettings):
    """The settings of an analysis of variance: within and between factors, at least one; it averages over all others.

    `correction` is for effects with more than one contrast within participants, whatever the result of a test of
    sphericity. `interval` is the confidence of the intervals of eta squared, `eta` the kind in the sentence.
    """

    test: Literal["anova"]
    within: tuple[Text, ...] = ()
    between: tuple[Text, ...] = ()
    sum_of_squares: Literal["II", "III"] = "III"
    correction: Literal["GG", "HF", "none"] = "GG"
    interval: Confidence = 0.90
    eta: Literal["partial", "generalized"] = "generalized"

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if len(self.between) < 2 and not (self.between and self.within):
            yield Idle("sum_of_squares", "with factors within participants alone, or one factor between them")
        if not self.within:
            yield Idle("correction", "without a factor within participants")
            if len(self.between) == 1:
                yield Idle("eta", "with one factor between participants, where every eta squared is one number")

    @model_validator(mode="after")
    def _factors(self) -> Self:
        named = self.within + self.between
        if not named:
            raise ValueError("name a factor in `within` or `between`")
        if len(set(named)) < len(named):
            raise ValueError(f"a factor is named twice in `within` and `between`: {', '.join(named)}")
        return self


class Pairs(StatisticSettings):
    """The settings of pairs: `factor` varies within participants (paired t) or between them (t between groups).

    `family`: the size of the family fixed beforehand, at least the number of pairs. `interval` is the confidence of
    the interval of the effect size.
    """

    test: Literal["pairs"]
    factor: Text
    correction: Literal["bonferroni", "holm", "none"] = "holm"
    family: Annotated[Whole, Field(ge=1)] | None = None
    interval: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if self.correction == "none":
            yield Idle("family", "with `correction: none`")


class Equivalence(StatisticSettings):
    """The settings of equivalence: `factor` as for pairs; `bounds` in the outcome's unit (earlier minus later), or in
    dz.
    """

    test: Literal["equivalence"]
    factor: Text
    bounds: tuple[Number, Number] | None = None
    bounds_dz: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if (self.bounds is None) == (self.bounds_dz is None):
            raise ValueError("give either `bounds: [low, high]` or `bounds_dz: number`")
        if self.bounds is not None and not self.bounds[0] < self.bounds[1]:
            raise ValueError(f"`bounds` {list(self.bounds)} are none: the first must be below the second")
        return self


KINDS: Mapping[str, Kind] = {
    "anova": Kind(
        "analysis of variance",
        Anova,
        lazy_function(f"{_ANSWERS}:anova_answer"),
        complete=attrgetter("within"),
        with_gaps=lazy_function(f"{_ANSWERS}:anova_with_gaps"),
    ),
    "pairs": Kind(
        "pairwise comparisons",
        Pairs,
        lazy_function(f"{_ANSWERS}:pairs_answer"),
        complete=lambda settings: (settings.factor,),
    ),
    "equivalence": Kind(
        "equivalence (TOST)",
        Equivalence,
        lazy_function(f"{_ANSWERS}:equivalence_answer"),
        complete=lambda settings: (settings.factor,),
    ),
}
