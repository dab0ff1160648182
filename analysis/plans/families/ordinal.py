"""Ranks and ordered answers: Friedman, Cochran, Nemenyi, Wilcoxon, aligned ranks, ordinal models, Likert summaries."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from operator import attrgetter
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from palpate.analysis.plans.answers import Answer, Confidence, Kind, Selected, StatisticSettings, missing_without_effect
from palpate.analysis.plans.idle import ON_RANKS, Idle
from palpate.protocols.registry import lazy_function
from palpate.protocols.study import Level, Number, Text, Whole

_ANSWERS = "palpate.analysis.plans.families.ordinal_answers"
_OF_STUDY = "palpate.analysis.plans.families.problems_of_study"

Correction = Literal["bonferroni", "holm", "none"]


class Friedman(StatisticSettings):
    """The settings of Friedman's test: `factor` is a within column, `exact` adds the exact p if it is affordable."""

    test: Literal["friedman"]
    factor: Text
    exact: bool = True
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        yield Idle("normalise", ON_RANKS)


class Cochran(StatisticSettings):
    """The settings of Cochran's test: `factor` is a within column; values are 0 or 1, or at least `yes` counts as 1."""

    test: Literal["cochran"]
    factor: Text
    yes: Number | None = None
    exact: bool = True

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if self.yes is None:
            yield Idle("normalise", "without `yes`, where values are 0 or 1")


def cochran_answer(selected: Selected, settings: Cochran) -> Answer:
    """Return one row with Cochran's Q, and how often each level was answered with yes in `more`."""
    from palpate.analysis.ordinal.friedman import cochran_q
    from palpate.analysis.plans.answers import answer_of, plain_rows, require_columns, table_notes
    from palpate.analysis.plans.families.rows import left_out
    from palpate.analysis.statistics.apa import apa_p, number

    require_columns(selected.table, ("participant", settings.factor, "value"))
    table = cochran_q(
        selected.table, "value", settings.factor, "participant",
        yes=settings.yes, exact=settings.exact, missing=left_out(settings),
        aggregate=None if settings.yes is None else "mean",
    )  # fmt: skip
    (row,) = plain_rows(table)
    kinds = {
        **{"n": "participants", "k": "conditions", "decides": "participants whose answers differ"},
        **{"Q": "Cochran's Q", "ddof1": "degrees of freedom", "p_unc": "p, chi-squared approximation"},
        "p_exact": "exact p over all orders of each participant's answers",
    }
    method = "Cochran's Q of answers of yes or no within participants (Cochran 1950)"
    if settings.yes is not None:
        method += f"; means of at least {settings.yes:g} are yes"
    counts = table.attrs["yes"].items()
    shares = tuple(
        {"level": str(level), "yes": yes, "n": row["n"], "share": yes / table["n"][0]} for level, yes in counts
    )
    q, p = row["Q"], row["p_unc"]
    headline = (
        f"{settings.factor}: Q({row['ddof1']}) = {number(q)}, {apa_p(p)}"
        if isinstance(q, float) and isinstance(p, float) else
        f"Cochran's Q of {settings.factor} is undefined: {row['note']}"
    )  # fmt: skip
    return answer_of(
        selected, [row], method, kinds, headline=headline, notes=table_notes(table), more={"shares": shares}
    )


class Nemenyi(StatisticSettings):
    """The settings of Nemenyi's test: `factor` is a within column; `ties` uses the variance of the observed ranks."""

    test: Literal["nemenyi"]
    factor: Text
    ties: bool = False

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        yield Idle("normalise", ON_RANKS)


class Wilcoxon(StatisticSettings):
    """The settings of Wilcoxon's tests: `factor` varies within participants (signed ranks) or between (rank sums).

    `family`: the size of the family fixed beforehand, at least the number of pairs.
    """

    test: Literal["wilcoxon"]
    factor: Text
    correction: Correction = "holm"
    family: Annotated[Whole, Field(ge=1)] | None = None
    zeros: Literal["wilcoxon", "pratt"] = "wilcoxon"
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if self.correction == "none":
            yield Idle("family", "with `correction: none`")


class AlignedRanks(StatisticSettings):
    """The settings of aligned ranks: the within and between factors, at least one in all."""

    test: Literal["aligned_ranks"]
    within: tuple[Text, ...] = ()
    between: tuple[Text, ...] = ()
    sum_of_squares: Literal["II", "III"] = "III"

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if len(self.between) < 2 and not (self.between and self.within):
            yield Idle("sum_of_squares", "with factors within participants alone, or one factor between them")

    @model_validator(mode="after")
    def _some(self) -> Self:
        if not self.within + self.between:
            raise ValueError("name a factor in `within` or `between`")
        return self


class Ordinal(StatisticSettings):
    """The settings of an ordinal model: `fixed` columns are factors, `numeric` are numbers, `interactions` are "a:b".

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
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if not self.fixed:
            yield Idle("coding", "without a factor in `fixed`")

    @model_validator(mode="after")
    def _some(self) -> Self:
        if not self.fixed + self.numeric:
            raise ValueError("name a predictor in `fixed` or `numeric`")
        if both := [name for name in self.fixed if name in self.numeric]:
            raise ValueError(f"{both[0]!r} is named in `fixed` and in `numeric`")
        return self


class Likert(StatisticSettings):
    """The settings of Likert summaries: `by` is a column with separate summaries, `points` those of the scale.

    `points` defaults to every integer of the scale. `form` selects the items of one form.
    """

    test: Literal["likert"]
    by: Text | None = None
    points: Annotated[tuple[Number, ...], Field(min_length=2)] | None = None
    form: Level | None = None

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        yield from missing_without_effect(self, "on Likert summaries, which count who answered")


_ordinal_model = lazy_function(f"{_ANSWERS}:model_answer")


def _factor(settings: Friedman | Cochran | Nemenyi | Wilcoxon) -> tuple[str, ...]:
    return (settings.factor,)


KINDS: Mapping[str, Kind] = {
    "friedman": Kind("Friedman's test", Friedman, lazy_function(f"{_ANSWERS}:friedman_answer"), complete=_factor),
    "cochran": Kind("Cochran's Q", Cochran, cochran_answer, complete=_factor),
    "nemenyi": Kind("Nemenyi's test", Nemenyi, lazy_function(f"{_ANSWERS}:nemenyi_answer"), complete=_factor),
    "wilcoxon": Kind(
        "Wilcoxon's signed ranks", Wilcoxon, lazy_function(f"{_ANSWERS}:wilcoxon_answer"), complete=_factor
    ),
    "aligned_ranks": Kind(
        "aligned rank transform",
        AlignedRanks,
        lazy_function(f"{_ANSWERS}:aligned_answer"),
        complete=attrgetter("within"),
    ),
    "ordinal_model": Kind(
        "ordinal model", Ordinal, _ordinal_model, complete=attrgetter("fixed"), with_gaps=_ordinal_model
    ),
    "likert": Kind(
        "Likert items",
        Likert,
        lazy_function(f"{_ANSWERS}:likert_answer"),
        takes="forms",
        each="all",
        problems=lazy_function(f"{_OF_STUDY}:likert_problems"),
    ),
}
