"""The schema of analysis.yaml: what is left out, what is tested, what is drawn, said before the data exist."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from palpate.analysis.plans.answers import Missing, Normalise
from palpate.analysis.plans.where import Condition
from palpate.protocols.study import Name, Share, Strict, Text, Whole

Above = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class Outlying(Strict):
    """Ratings further than `sd` standard deviations from the mean of their cell, a cell being equal in `within`."""

    sd: Above
    within: tuple[Text, ...] = ("attribute", "stimulus")


class Rule(Strict):
    """One reason to leave something out; exactly one of the keys beside `because` says what.

    `participants` by pseudonym; `faster_than_s`, `slower_than_s`: trials answered in less or more seconds; `where`:
    trials whose columns have these levels, or numbers in a range; `outlying`: single ratings; `flagged`: participants
    on whom this many of the rater diagnostics raise a flag; `fewer_than`: participants who answered less than this
    share of their trials.
    """

    because: Text
    participants: tuple[Text, ...] | None = None
    faster_than_s: Above | None = None
    slower_than_s: Above | None = None
    where: dict[Text, Condition] | None = None
    outlying: Outlying | None = None
    flagged: Annotated[Whole, Field(ge=1)] | None = None
    fewer_than: Share | None = None

    @model_validator(mode="after")
    def _one_reason(self) -> Self:
        if len(self.model_dump(exclude={"because"}, exclude_none=True)) != 1:
            raise ValueError(
                "exactly one of participants, faster_than_s, slower_than_s, where, outlying, flagged, fewer_than is"
                " expected beside because"
            )
        return self


class AnalysisPlan(Strict):
    """A study's analysis. `tests` and `figures` are read by the schema of their kind.

    `sessions` says whether interrupted sessions count. `seed` and `draws` are those of everything that is resampled.
    `least_people`: a group by answers about oneself (gender, say) of fewer participants is refused.
    `tables` are CSV files beside the plan, by the name that tests and figures use.
    """

    study: Name
    title: Text | None = None
    alpha: Annotated[float, Field(gt=0, lt=0.5)] = 0.05
    seed: Whole = 0
    draws: Annotated[Whole, Field(ge=100, le=1_000_000)] = 2000
    sessions: Literal["complete", "also_interrupted"] = "complete"
    missing: Missing = "refuse"
    normalise: Normalise = "none"
    least_people: Annotated[Whole, Field(ge=1)] = 3
    exclusions: tuple[Rule, ...] = ()
    tables: Mapping[Name, Text] = {}
    tests: tuple[dict[Text, Any], ...] = ()
    figures: tuple[dict[Text, Any], ...] = ()
