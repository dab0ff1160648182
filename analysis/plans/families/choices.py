"""Choices: scales from comparisons of pairs, and psychometric functions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from palpate.analysis.plans.answers import Confidence, Kind, StatisticSettings
from palpate.analysis.plans.idle import Idle
from palpate.protocols.registry import lazy_function
from palpate.protocols.study import Level, Text, Whole

if TYPE_CHECKING:
    from palpate.analysis.choices.specification import FunctionSpec as Model

_ANSWERS = "palpate.analysis.plans.families.choices_answers"
_OF_STUDY = "palpate.analysis.plans.families.choices_of_study"

Rate = Annotated[float, Field(ge=0, lt=1)]
Draws = Annotated[Whole, Field(ge=19)]
Correction = Literal["holm", "bonferroni", "none"]
Independent = Literal["participants", "choices"]


class ChoiceSettings(StatisticSettings):
    """The settings of tests of choices: those of a study (`source: choices`), or of a table of the plan's own."""

    @model_validator(mode="after")
    def _of_choices(self) -> Self:
        if self.source not in (None, "choices"):
            raise ValueError("source: choices is expected, or a table of the plan's own (`table`)")
        return self

    @property
    def of_choices(self) -> bool:
        """Return whether the answers are a study's choices; a table of the plan's own goes before `source`."""
        return self.source == "choices" and self.table is None


class BradleyTerry(ChoiceSettings):
    """The settings of Bradley-Terry: columns `winner`, `loser`, optional `tie` (true for ties), `first` (presented
    first).

    `count` is the number of equal comparisons, `participant` the column of people (None: the column of that name, if
    any). `reference`: the item whose value is 0 (None: values sum to 0). With `source: choices` a study's pairs are
    compared: who won is known, ties are modelled if there are any, and `first: stimulus` adds the effect of the
    interval. `independent`: standard errors are over participants, or as if every choice were independent of the
    others, which one participant's are not; of one participant, or unknown ones, choices always are.
    """

    test: Literal["bradley_terry"]
    winner: Text = "winner"
    loser: Text = "loser"
    tie: Text | None = None
    first: Text | None = None
    count: Text | None = None
    participant: Text | None = None
    reference: Level | None = None
    correction: Correction = "holm"
    confidence: Confidence = 0.95
    independent: Independent = "participants"

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        yield from _idle_on_pairs(self)

    @model_validator(mode="after")
    def _first_of_a_pair(self) -> Self:
        if self.of_choices and self.first not in (None, "stimulus"):
            raise ValueError("first: stimulus is expected with `source: choices`: it is the one that came first")
        return self


def _idle_on_pairs(settings: BradleyTerry | Thurstone) -> Iterator[Idle]:
    if settings.of_choices:
        names = ("winner", "loser", "tie", "count", "participant")
        yield from (Idle(name, "with `source: choices`, which say who won and who chose") for name in names)


class Thurstone(ChoiceSettings):
    """The settings of Thurstone's scale: as for bradley_terry, but without ties and effects of the place; `method`:
    likelihood or least squares.
    """

    test: Literal["thurstone"]
    winner: Text = "winner"
    loser: Text = "loser"
    count: Text | None = None
    participant: Text | None = None
    method: Literal["likelihood", "least_squares"] = "likelihood"
    reference: Level | None = None
    correction: Correction = "holm"
    confidence: Confidence = 0.95
    independent: Independent = "participants"

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        yield from _idle_on_pairs(self)
        if self.method == "least_squares":
            names = ("correction", "confidence", "independent")
            yield from (Idle(name, "with `method: least_squares`, which has no standard errors") for name in names)


class PsychometricFunction(ChoiceSettings):
    """The settings of psychometric functions, one for each combination of `by` (default: participants, if any).

    The table has one row per trial (`correct` 0 or 1), or `correct` of `n`. `task` decides which rates are free;
    `guess` and `lapse` are fixed rates or bounds (lowest, highest) of free ones. A plan without a task is from before
    tasks were declared: guess 0, lapse from 0 to 0.06, plain profile intervals, and a note. `threshold` is a value of F
    (0.5: halfway from guess to 1 - lapse). `method: staircase` also takes the last `last` reversals of each staircase:
    rows in the order of the column `order`, with staircases distinguished by the columns `staircase` and `by`. Means
    are over participants, for each combination of the other columns of `by`. `interval` (None: corrected, or profile
    without a task): posterior takes the estimates from the posterior, too. `level_unit: db`: levels are in dB, a
    Weibull function is one of the amplitude, and a Weber fraction the ratio 10^(JND / 20) - 1.

    With `source: choices` the design in the table decides `task`, `alternatives`, `guess`, `falling` and the column of
    hits; functions are of participants and tracks unless `by` says otherwise, and the levels of staircases and QUEST+
    have the posterior unless `interval` says otherwise. `prior` of the posterior of QUEST+ tracks: the model that the
    study declares (declared_model, the default where it has one; `threshold` is then the model's own unless the plan
    gives it), or one that follows from the levels presented (levels), as for all other tracks. `easy_catch: counted`
    takes catch trials at the easiest level among the answers, since they tell how often somebody lapses.
    """

    test: Literal["psychometric"]
    level: Text = "level"
    correct: Text = "correct"
    n: Text | None = None
    level_unit: Literal["linear", "db"] = "linear"
    by: tuple[Text, ...] | None = None
    method: Literal["constant", "staircase"] = "constant"
    order: Text | None = None
    staircase: tuple[Text, ...] = ()
    last: Annotated[Whole, Field(ge=2, multiple_of=2)] = 6
    function: Literal["logistic", "gaussian", "weibull", "weibull_db"] = "logistic"
    task: Literal["symmetric", "forced_choice", "yes_no"] | None = None
    alternatives: Annotated[Whole, Field(ge=2)] | None = None
    guess: Rate | tuple[Rate, Rate] | None = None
    lapse: Rate | tuple[Rate, Rate] | None = None
    threshold: Annotated[float, Field(gt=0, lt=1)] = 0.5
    jnd: Literal["half_interquartile", "x84_x50"] = "half_interquartile"
    falling: bool = False
    interval: Literal["corrected", "profile", "bootstrap", "posterior", "none"] | None = None
    draws: Draws | None = None
    confidence: Confidence = 0.95
    prior: Literal["declared_model", "levels"] | None = None
    easy_catch: Literal["left_out", "counted"] = "left_out"

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if not self.of_choices:
            yield Idle("prior", "without `source: choices`, whose study may declare a model")
            yield Idle("easy_catch", "without `source: choices`, which has catch trials", "left_out")
        elif self.interval not in (None, "posterior"):
            yield Idle("prior", f"with `interval: {self.interval}`, which is not of a posterior")
        if self.method == "constant":
            yield from (Idle(name, "with `method: constant`") for name in ("order", "staircase", "last"))
        if self.of_choices:
            yield from (Idle(name, "with `source: choices`, whose table has these columns") for name in ("level", "n"))
            of_design = ("task", "alternatives", "correct", "falling")
            yield from (Idle(name, "with `source: choices`, whose design decides it") for name in of_design)
        elif self.function not in ("weibull", "weibull_db"):
            yield Idle("level_unit", "with this function of a table of the plan's own", "linear")
        if self.interval in ("none", "posterior"):
            yield Idle("draws", f"with `interval: {self.interval}`")

    @model_validator(mode="after")
    def _a_model(self) -> Self:
        if self.of_choices and self.method == "staircase":
            raise ValueError("method: staircase is for a table of the plan's own; choices name their procedure")
        if not self.of_choices:
            self.model()
        return self

    @property
    def interval_kind(self) -> str:
        """The kind of interval; for a plan that gives neither it nor a task, the former default."""
        return self.interval or ("profile" if self.task is None else "corrected")

    def model(self) -> Model:
        """Return the specification of the function.

        Raises BadOption for rates that the task determines, or missing ones.
        """
        from palpate.analysis.choices.posterior import UP_TO_HALF
        from palpate.analysis.choices.specification import ESTIMATED, function_spec, rates_of

        estimated = UP_TO_HALF if self.interval_kind == "posterior" else ESTIMATED
        rates = rates_of(self.task, self.alternatives, self.guess, self.lapse, estimated)
        function = "weibull_db" if self.function == "weibull" and self.level_unit == "db" else self.function
        return function_spec(function, rates, self.threshold, self.jnd, self.falling)


class DPrime(ChoiceSettings):
    """The settings of d' and c, one for each combination of `by` (default: participants and tracks).

    `model` is for same/different designs. `correction` says which rates have the log-linear correction: all
    (log_linear), or half an answer those of 0 and 1 alone (when_extreme). `confidence` is of the intervals of a
    participant (delta method) and of the mean (Student's t).
    """

    test: Literal["dprime"]
    by: tuple[Text, ...] | None = None
    model: Literal["differencing", "independent_observation"] = "differencing"
    correction: Literal["log_linear", "when_extreme", "none"] = "log_linear"
    confidence: Confidence = 0.95


class BinomialMixedModel(ChoiceSettings):
    """The settings of a binomial mixed model: participants differ in intercept, or also in the slope of the level.

    With `random: intercept_and_condition` they differ in intercept, and in the difference of two conditions: a
    comparison of conditions within people needs it where that difference is not the same for all of them.

    `condition` is a column whose levels have a PSE and a slope each. `nodes` are those of the quadrature of each random
    effect (1: Laplace). A table of the plan's own has one row per trial (`correct` 0 or 1), or `correct` of `n`.
    """

    not_columns: ClassVar[frozenset[str]] = frozenset({"random"})
    test: Literal["binomial_mixed_model"]
    level: Text = "level"
    correct: Text = "correct"
    n: Text | None = None
    condition: Text | None = None
    random: Literal["intercept", "intercept_and_slope", "intercept_and_condition"] = "intercept_and_slope"
    link: Literal["probit", "logit"] = "probit"
    nodes: Annotated[Whole, Field(ge=1, le=51)] = 7
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if self.table is None:
            names = (("level", "level"), ("correct", "correct"), ("n", None))
            yield from (Idle(name, "on choices, whose table has these columns", value) for name, value in names)

    @model_validator(mode="after")
    def _a_condition_to_differ_in(self) -> Self:
        if self.random == "intercept_and_condition" and self.condition is None:
            raise ValueError("random: intercept_and_condition goes together with condition: COLUMN")
        return self


KINDS: Mapping[str, Kind] = {
    "bradley_terry": Kind(
        "Bradley–Terry scale",
        BradleyTerry,
        lazy_function(f"{_ANSWERS}:bradley_terry_answer"),
        takes="table",
        each="all",
        problems=lazy_function(f"{_OF_STUDY}:scale_problems"),
    ),
    "thurstone": Kind(
        "Thurstone scale",
        Thurstone,
        lazy_function(f"{_ANSWERS}:thurstone_answer"),
        takes="table",
        each="all",
        problems=lazy_function(f"{_OF_STUDY}:scale_problems"),
    ),
    "psychometric": Kind(
        "psychometric functions",
        PsychometricFunction,
        lazy_function(f"{_ANSWERS}:psychometric_answer"),
        takes="table",
        each="all",
        problems=lazy_function(f"{_OF_STUDY}:function_problems"),
    ),
    "binomial_mixed_model": Kind(
        "binomial mixed model",
        BinomialMixedModel,
        lazy_function("palpate.analysis.plans.families.binomial_mixed_answers:binomial_mixed_answer"),
        takes="choices",
        each="all",
        problems=lazy_function(f"{_OF_STUDY}:mixed_model_problems"),
        headings={"pse": "PSE", "pse_low": "PSE, low", "pse_high": "PSE, high"},
    ),
    "dprime": Kind(
        "sensitivity d′",
        DPrime,
        lazy_function("palpate.analysis.plans.families.detection_answers:dprime_answer"),
        takes="choices",
        each="all",
        problems=lazy_function(f"{_OF_STUDY}:sensitivity_problems"),
        headings={"dprime": "d′", "dprime_low": "d′, low", "dprime_high": "d′, high", "criterion": "c"},
    ),
}
