"""Linear mixed models, and the answer to questions on variance where participants have gaps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from palpate.analysis.plans.answers import Kind, StatisticSettings
from palpate.analysis.plans.idle import Idle
from palpate.protocols.registry import lazy_function
from palpate.protocols.study import Text

_ANSWERS = "palpate.analysis.plans.families.mixed_model_answers"


class MixedModel(StatisticSettings):
    """The settings of a mixed model: fixed effects, and grouping factors with random effects.

    `fixed`: columns as factors; `numeric`: columns as numbers, fixed effects too; `interactions`: "a:b" of them.
    `random`: each grouping factor (a column, or "a:b" for the levels of b within a) with the columns whose slopes vary
    between its levels; its intercept always varies. `uncorrelated`: grouping factors whose effects are independent.
    `levels` adds the random effects of every level, `profile` the profile-likelihood intervals of the SDs (slow).
    """

    test: Literal["mixed_model"]
    fixed: tuple[Text, ...] = ()
    numeric: tuple[Text, ...] = ()
    interactions: tuple[Text, ...] = ()
    random: Mapping[Text, tuple[Text, ...]] = {"participant": ()}
    uncorrelated: tuple[Text, ...] = ()
    reml: bool = True
    coding: Literal["treatment", "sum"] = "treatment"
    confidence: Annotated[float, Field(gt=0, lt=1)] = 0.95
    levels: bool = False
    profile: bool = False

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        sloped = tuple(name for name in self.uncorrelated if self.random.get(name, (name,)))
        if sloped != self.uncorrelated:
            yield Idle("uncorrelated", "on a grouping factor that has an intercept only", sloped)
        used = {*self.fixed, *(part for slopes in self.random.values() for name in slopes for part in name.split(":"))}
        if used <= set(self.numeric):
            yield Idle("coding", "without a factor")

    @model_validator(mode="after")
    def _grouped(self) -> Self:
        if not self.random:
            raise ValueError("name a grouping factor in `random`, as random: {participant: []}")
        return self


_mixed_model = lazy_function(f"{_ANSWERS}:model_answer")


KINDS: Mapping[str, Kind] = {
    "mixed_model": Kind(
        "linear mixed model",
        MixedModel,
        _mixed_model,
        complete=lambda settings: (*settings.fixed, *settings.numeric),
        with_gaps=_mixed_model,
    ),
}
