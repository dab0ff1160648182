"""The schema of `procedure:` in a study: how the level of each trial is chosen, from which levels, and until when.

The procedures themselves are in `palpate.studies.procedures`, a module for each kind; here nothing is computed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AliasChoices, ConfigDict, Discriminator, Field, Tag, model_validator

from palpate.protocols.extensions import ExtensionError, finder, is_own
from palpate.protocols.strict import KnownKeys, by_kind, form_of, list_by_kind, problem_at
from palpate.protocols.study import Level as Id
from palpate.protocols.study import Name, Number, Text, Whole

MOST_LEVELS, MOST_TRIALS = 1000, 2000
SIGNIFICANT = 12
"""Significant digits of a level: steps of a tenth are then written as tenths."""
Level = float | tuple[float, ...]
"""A level, or one for each dimension of the stimulus."""
Points = Annotated[Whole, Field(ge=1, le=MOST_LEVELS)]
Trials = Annotated[Whole, Field(ge=1, le=MOST_TRIALS)]


class Grid(KnownKeys):
    """The only levels that may be presented: equal steps `from`, `to`, `points`, or `values`, of a stimulus's column.

    With `of: stimuli` each level is a row of the stimulus table, at its value in `column`.
    """

    column: Text
    low: Number | None = Field(default=None, validation_alias=AliasChoices("from", "low"))
    high: Number | None = Field(default=None, validation_alias=AliasChoices("to", "high"))
    points: Annotated[Whole, Field(ge=2, le=MOST_LEVELS)] | None = None
    values: Annotated[tuple[Number, ...], Field(min_length=1, max_length=MOST_LEVELS)] | None = None
    of: Literal["stimuli"] | None = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        steps = (self.low, self.high, self.points)
        ways = [any(part is not None for part in steps), self.values is not None, self.of is not None]
        if sum(ways) != 1 or (ways[0] and None in steps):
            raise ValueError("one of {from, to, points}, {values} and {of: stimuli} is expected")
        if self.low is not None and self.high is not None and self.low >= self.high:
            raise ValueError(f"from ({self.low}) must be below to ({self.high})")
        if self.values is not None and any(b <= a for a, b in pairwise(self.values)):
            raise problem_at(("values",), "different levels are expected, from the lowest to the highest")
        if len(set(self.levels)) < len(self.levels):
            raise ValueError("levels so close to one another cannot be told apart")
        return self

    @property
    def levels(self) -> tuple[float, ...]:
        """Return the levels from the lowest to the highest; () if they are rows of the stimulus table."""
        if self.values is not None:
            return tuple(float(value) for value in self.values)
        if self.low is None or self.high is None or self.points is None:
            return ()
        width, last = self.high - self.low, self.points - 1
        return tuple(float(f"{self.low + width * n / last:.{SIGNIFICANT}g}") for n in range(self.points))


class Axis(KnownKeys):
    """The values of a parameter of a model: `from`, `to`, `points`, in equal steps or equal ratios (`spacing: log`)."""

    low: Number = Field(validation_alias=AliasChoices("from", "low"))
    high: Number = Field(validation_alias=AliasChoices("to", "high"))
    points: Annotated[Whole, Field(ge=2, le=MOST_LEVELS)]
    spacing: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.low >= self.high:
            raise ValueError(f"from ({self.low}) must be below to ({self.high})")
        if self.spacing == "log" and self.low <= 0:
            raise ValueError(f"from ({self.low}): equal ratios need values above 0")
        return self

    @property
    def values(self) -> tuple[float, ...]:
        """Return the values from the lowest to the highest."""
        last = self.points - 1
        if self.spacing == "log":
            ratio = self.high / self.low
            return tuple(float(self.low * ratio ** (n / last)) for n in range(self.points))
        return tuple(float(self.low + (self.high - self.low) * n / last) for n in range(self.points))


_Listed = Annotated[tuple[Number, ...], Field(min_length=1, max_length=MOST_LEVELS)]
Values = Annotated[
    Annotated[Number, Tag("[value]")] | Annotated[_Listed, Tag("[list]")] | Annotated[Axis, Tag("[keys]")],
    Discriminator(form_of),
]


def values_of(values: Values) -> tuple[float, ...]:
    """Return the values of a parameter: a number is fixed."""
    if isinstance(values, Axis):
        return values.values
    return tuple(float(value) for value in values) if isinstance(values, tuple) else (float(values),)


class Stop(KnownKeys):
    """When a track ends: after `trials` at the latest, earlier after `reversals` or `series`, or when sure enough.

    `threshold_sd`: the standard deviation of the threshold's posterior, in units of the level, is at most this after
    `at_least` trials.
    """

    trials: Trials
    reversals: Annotated[Whole, Field(ge=2, le=200)] | None = None
    series: Annotated[Whole, Field(ge=1, le=200)] | None = None
    threshold_sd: Annotated[Number, Field(gt=0)] | None = None
    at_least: Trials | None = None

    @model_validator(mode="after")
    def _at_least_goes_with(self) -> Self:
        if self.at_least is not None and self.threshold_sd is None:
            raise ValueError("at_least goes together with threshold_sd")
        if self.at_least is not None and self.at_least > self.trials:
            raise ValueError(f"at_least ({self.at_least}) must not be above trials ({self.trials})")
        return self


class Procedure(KnownKeys):
    """What all procedures have: a kind, a name if there are several, the levels, and which end of them is the easier.

    It is for all stimuli unless `stimuli` names some of them.
    """

    kind: str
    name: Name | None = None
    level: Annotated[
        Annotated[Grid, Tag("[keys]")] | Annotated[tuple[Grid, Grid], Tag("[list]")],
        Discriminator(lambda value: "[list]" if form_of(value) == "[list]" else "[keys]"),
    ]
    easier: Literal["higher", "lower"] = "higher"
    stimuli: tuple[Id, ...] | None = None

    @property
    def grids(self) -> tuple[Grid, ...]:
        """Return the grid of each dimension."""
        return self.level if isinstance(self.level, tuple) else (self.level,)

    def most_trials(self, levels: int) -> int:
        """Return the greatest number of trials of a track with so many levels."""
        raise NotImplementedError

    @property
    def counted_trials(self) -> int:
        """Return the number that decides how long a track is: its cap of trials, or the repeats of each level."""
        raise NotImplementedError

    def with_trials(self, count: int) -> Self:
        """Return the procedure with another number in the place of `counted_trials`."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _dimensions(self) -> Self:
        if isinstance(self.level, tuple):
            if self.kind != "questplus":
                raise problem_at(("level",), "two dimensions are for kind: questplus")
            if self.level[0].column == self.level[1].column:
                raise problem_at(("level", 1, "column"), "two different columns are expected")
            if any(grid.of for grid in self.level):
                raise problem_at(("level",), "of: stimuli has one dimension")
        return self


class Constant(Procedure):
    """Constant stimuli: each level `repeats` times, in a random order within each round of all levels."""

    kind: Literal["constant"]
    repeats: Annotated[Whole, Field(ge=1, le=MOST_TRIALS)]

    def most_trials(self, levels: int) -> int:
        """Return the number of trials of a track with so many levels."""
        return self.repeats * levels

    @property
    def counted_trials(self) -> int:
        """Return the repeats of each level."""
        return self.repeats

    def with_trials(self, count: int) -> Self:
        """Return the procedure with so many repeats of each level."""
        return self.model_copy(update={"repeats": count})


class Ending(Procedure):
    """What the procedures have that go by the answers: rules by which a track ends, a cap among them.

    `ends` names the rules that a kind can have beside `trials`.
    """

    ends: ClassVar[frozenset[str]]
    stop: Stop

    def most_trials(self, levels: int) -> int:  # noqa: ARG002
        """Return the cap."""
        return self.stop.trials

    @property
    def counted_trials(self) -> int:
        """Return the cap."""
        return self.stop.trials

    def with_trials(self, count: int) -> Self:
        """Return the procedure with another cap."""
        return self.model_copy(update={"stop": self.stop.model_copy(update={"trials": count})})

    @model_validator(mode="after")
    def _rules_of_the_kind(self) -> Self:
        for rule in ("reversals", "series", "threshold_sd"):
            if getattr(self.stop, rule) is not None and rule not in self.ends:
                raise problem_at(("stop", rule), f"{rule} is not a rule of kind: {self.kind}")
        return self


class Limits(Ending):
    """The method of limits: series that rise, fall, or do so in turn, until the answer changes.

    A series begins at the end of the levels, or up to `jitter` points inside, drawn for each, and moves by `step`
    points. The threshold is the mean of the middles between the last two levels of each series.
    """

    ends: ClassVar[frozenset[str]] = frozenset({"series"})
    kind: Literal["limits"]
    direction: Literal["ascending", "descending", "alternating"] = "alternating"
    step: Points = 1
    jitter: Annotated[Whole, Field(ge=0, le=MOST_LEVELS)] = 0

    @model_validator(mode="after")
    def _needs_series(self) -> Self:
        if self.stop.series is None:
            raise problem_at(("stop",), "{trials: N, series: N} is expected for kind: limits")
        return self


class Staircase(Ending):
    """An up-down staircase (Levitt 1971): harder after `down` hits in a row, easier after `up` misses in a row.

    `step` holds the steps in points of the grid, the next one after each reversal, the last one kept. Steps to the
    easier side are `weight` times as large (Kaernbach 1991). The threshold is the mean of the last `last` reversals;
    the staircase converges to the level with a share of hits of (weight / (1 + weight))^(1 / down), for up = 1.
    """

    ends: ClassVar[frozenset[str]] = frozenset({"reversals"})
    kind: Literal["staircase"]
    down: Annotated[Whole, Field(ge=1, le=4)] = 2
    up: Annotated[Whole, Field(ge=1, le=4)] = 1
    step: Annotated[tuple[Points, ...], Field(min_length=1, max_length=20)] = (1,)
    weight: Annotated[Whole, Field(ge=1, le=20)] = 1
    start: Number
    last: Annotated[Whole, Field(ge=2, le=200, multiple_of=2)] = 6

    @model_validator(mode="before")
    @classmethod
    def _one_step(cls, data: Any) -> Any:
        if isinstance(data, Mapping) and type(data.get("step")) is int:
            return {**data, "step": [data["step"]]}
        return data

    @model_validator(mode="after")
    def _weighted(self) -> Self:
        if self.stop.reversals is not None and self.last > self.stop.reversals:
            raise problem_at(
                ("last",), f"last ({self.last}) must not be above stop: {{reversals: {self.stop.reversals}}}"
            )
        levels = self.grids[0].levels
        if levels and float(self.start) not in levels:
            raise problem_at(("start",), f"start ({self.start}) is not a level of the grid")
        return self

    @property
    def target(self) -> float | None:
        """Return the share of hits that the staircase converges to; None for more than one miss."""
        return (self.weight / (1 + self.weight)) ** (1 / self.down) if self.up == 1 else None


class Model(KnownKeys):
    """The psychometric function that QUEST+ assumes: its shape on a scale of the level, and values of its parameters.

    share(x) = guess + (1 - guess - lapse) F(x), with F, for threshold t and slope b:
    weibull: 1 - exp(-(x / t)^b) on a linear, 1 - exp(-10^(b (x - t))) on a log10, 1 - exp(-10^(b (x - t) / 20)) on a
    db scale; logistic: 1 / (1 + exp(-b (x - t))); gaussian: Phi(b (x - t)). A level in db or log10 is a logarithm
    already. With two dimensions the threshold is t + gradient * second level. A parameter is a number, a list, or
    {from, to, points}. Source: Watson 2017.
    """

    shape: Literal["weibull", "logistic", "gaussian"] = "weibull"
    scale: Literal["linear", "log10", "db"] = "linear"
    threshold: Values
    slope: Values
    guess: Values
    lapse: Values = 0.02
    gradient: Values | None = None

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        for name in ("guess", "lapse"):
            values = values_of(getattr(self, name))
            if not all(0 <= value < 1 for value in values):
                raise problem_at((name,), f"rates from 0 to below 1 are expected, found {list(values)}")
        if max(values_of(self.guess)) + max(values_of(self.lapse)) >= 1:
            raise ValueError("guess and lapse together leave no room for the function")
        if min(values_of(self.slope)) <= 0:
            raise problem_at(("slope",), "values above 0 are expected; say easier: lower for a falling function")
        if self.shape == "weibull" and self.scale == "linear" and min(values_of(self.threshold)) <= 0:
            raise problem_at(
                ("threshold",), "a Weibull function on a linear scale needs values above 0; or say scale: db"
            )
        for name in ("threshold", "slope", "guess", "lapse", "gradient"):
            values = () if getattr(self, name) is None else values_of(getattr(self, name))
            if any(b <= a for a, b in pairwise(values)):
                raise problem_at((name,), "different values are expected, from the lowest to the highest")
        if len(values_of(self.threshold)) < 2:
            raise problem_at(("threshold",), "two or more values are expected; with one there is nothing to measure")
        return self

    @property
    def points(self) -> int:
        """Return how many combinations of parameters the model has."""
        count = 1
        for values in (self.threshold, self.slope, self.guess, self.lapse, self.gradient):
            count *= 1 if values is None else len(values_of(values))
        return count


MOST_POINTS, MOST_CELLS = 200_000, 20_000_000
"""Combinations of parameters, and levels times combinations: a table of that size takes 160 MB."""


class QuestPlus(Ending):
    """QUEST+ (Watson 2017): the level with the least expected entropy of the model's parameters.

    `interest` are the parameters that are measured; the others are nuisance parameters, averaged out before the entropy
    is taken (Prins 2013).
    """

    ends: ClassVar[frozenset[str]] = frozenset({"threshold_sd"})
    kind: Literal["questplus"]
    model: Model
    interest: Annotated[
        tuple[Literal["threshold", "slope", "guess", "lapse", "gradient"], ...], Field(min_length=1)
    ] = ("threshold", "slope", "guess", "lapse", "gradient")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if (self.model.gradient is not None) != isinstance(self.level, tuple):
            raise ValueError("two dimensions (level: [GRID, GRID]) and model: {gradient: ...} go together")
        if self.model.points > MOST_POINTS:
            raise problem_at(
                ("model",), f"{self.model.points:,} combinations of parameters; at most {MOST_POINTS:,} are"
            )
        cells = self.model.points * math.prod(max(1, len(grid.levels)) for grid in self.grids)
        if cells > MOST_CELLS:
            raise ValueError(
                f"levels times combinations of parameters are {cells:,}; at most {MOST_CELLS:,} are computed"
            )
        if self.easier == "lower" and self.model.shape == "weibull":
            raise problem_at(("easier",), "lower goes with shape: logistic or gaussian")
        if self.needs_positive_levels and any(level <= 0 for level in self.grids[0].levels):
            raise problem_at(("level",), "a Weibull function on a linear scale needs levels above 0; or say scale: db")
        return self

    @property
    def needs_positive_levels(self) -> bool:
        """Return whether the model is one of ratios: a Weibull function on a linear scale."""
        return self.model.shape == "weibull" and self.model.scale == "linear"


class Absent(Ending):
    """A procedure of an extension that is not here. Enough is known of it to repeat a session in which it chose.

    A study's file that names one is refused, but not a recorded session: its levels are on record.
    """

    model_config = ConfigDict(extra="allow")
    ends: ClassVar[frozenset[str]] = frozenset({"reversals", "series", "threshold_sd"})

    @model_validator(mode="before")
    @classmethod
    def _name_unknown_keys(cls, data: Any) -> Any:
        return data


class _Schemas(Mapping[str, type[Procedure]]):
    """The schema of each kind, with those of extensions."""

    shipped: ClassVar[Mapping[str, type[Procedure]]] = {
        "constant": Constant, "limits": Limits, "staircase": Staircase, "questplus": QuestPlus,
    }  # fmt: skip

    def __getitem__(self, kind: str) -> type[Procedure]:
        if not is_own(kind):
            return self.shipped[kind]
        try:
            schema = finder().part("procedures", kind).settings
        except ExtensionError:
            return Absent
        if not isinstance(schema, type) or not issubclass(schema, Ending):
            raise ExtensionError(f"{kind}: settings are {schema!r:.60}; a schema that extends Ending is expected")
        return schema

    def __iter__(self) -> Iterator[str]:
        return iter(self.shipped)

    def __len__(self) -> int:
        return len(self.shipped)


KINDS: Mapping[str, type[Procedure]] = _Schemas()


def procedures_from(value: Any) -> tuple[Procedure, ...]:
    """Return the procedures in a study file: one, or a list of several that are interleaved, each with a name."""
    if not isinstance(value, list | tuple):
        return (by_kind(KINDS, value),)
    if not 1 <= len(value) <= 20:
        raise ValueError(f"from 1 to 20 procedures are expected, found {len(value)}")
    procedures = list_by_kind(KINDS, value)
    names = [procedure.name for procedure in procedures]
    if len(procedures) > 1 and (None in names or len(set(names)) < len(names)):
        raise ValueError("several procedures are interleaved: give each a name of its own")
    return procedures
