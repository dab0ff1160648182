"""A data set of ratings: the long table, the meaning of its columns, its cells, its sources and its exclusions."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from math import prod
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from palpate.protocols.wording import some

if TYPE_CHECKING:
    import pandas as pd

OF_THE_TABLE = (
    "participant", "attribute", "value", "group", "study", "session", "trial", "block", "stimulus",
    "response_time_s", "revised",
)  # fmt: skip
"""The columns that a table of ratings has, or may have, beside its factors."""
OF_THE_MEANS = ("kind", "n", "mean", "sd", "sd_reason", "ratings", "ratings_min", "ratings_max", "category")
"""The columns that a table of means has beside its factors."""
RESERVED = frozenset((*OF_THE_TABLE, *OF_THE_MEANS))


def taken_names(roles: Mapping[str, Iterable[str]]) -> Iterator[tuple[str, str]]:
    """Yield each (role, name) with a reserved name, except 'group' as a between factor, which is its meaning."""
    for role, names in roles.items():
        for name in names:
            if name in RESERVED and (role, name) != ("between", "group"):
                yield role, name


_NONE: Mapping[str, str] = MappingProxyType({})
_NO_COUNTS: Mapping[str, int] = MappingProxyType({})


class DataRefused(ValueError):
    """The data cannot be used as they are; the message says where, what was found and what to do."""


class DeclarationRefused(DataRefused):
    """A test asks about something that the answers cannot have, whatever they are: its declaration is wrong."""


class NoRows(DataRefused):
    """No answer is among those that a test asks about."""


@dataclass(frozen=True)
class Scale:
    """The ends of a rating scale and its step (None: any value between the ends)."""

    low: float
    high: float
    step: float | None = None

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise DataRefused(f"a scale from {self.low:g} to {self.high:g}: the first end must be the lower one")
        if self.step is not None and not self.step > 0:
            raise DataRefused(f"a scale with step {self.step:g}: the step must be above 0")

    def holds(self, value: float) -> bool:
        """Return whether `value` lies between the ends, both included."""
        return self.low <= value <= self.high

    def on_step(self, value: float) -> bool:
        """Return whether `value` is a whole number of steps from the lower end.

        A step such as 0.1 is no binary fraction: 1e-9 of a step is allowed, and as much of the count of steps.
        """
        if self.step is None:
            return True
        steps = (value - self.low) / self.step
        return abs(steps - round(steps)) <= 1e-9 * max(1.0, abs(steps))


@dataclass(frozen=True)
class Input:
    """A file that the data are from, by name and SHA-256 (hex), and how it was read."""

    name: str
    sha256: str
    note: str = ""


@dataclass(frozen=True)
class Exclusion:
    """A line of the table of exclusions: what was left out or averaged, whose, why, and how many.

    `what` says what `rows` counts: ratings left out with a 'session', as 'practice', with a 'participant', or as
    'repeated' in their cell; ratings 'averaged' `into` fewer values; 'rows' of a foreign table that are no ratings.
    """

    what: str
    who: str
    why: str
    rows: int
    into: int = 0


@dataclass(frozen=True)
class Crossing:
    """The cells expected of each participant of one group: every combination of `levels`.

    `between` names the group by its between factors; it is empty where there are no groups.
    """

    between: Mapping[str, str]
    levels: Mapping[str, tuple[str, ...]]


LARGEST = 1e100
"""The largest rating; sums of squares of larger ones overflow double precision."""


@dataclass(frozen=True)
class Ratings:
    """One row per rating, with the information that statistics and reports need about the rows.

    `table` has at least `participant`, `attribute` (text) and `value` (float64), and one text column for each factor in
    `within` and `between`. `attributes` are in the study's order. `antonyms` and `categories` map an attribute to the
    other end of its scale and to 'physical' or 'emotional', where the study says so. `crossings` are the declared
    cells, empty if only the rows show what was planned; each cell is expected `repeats` times in each of `sessions`
    sessions (None: rows know no sessions). `pooled` and `families` name the factor that all participants share and the
    column that groups its levels, where the study says so. `interrupted` names the interrupted sessions among the
    ratings; `seeds` are those of simulated sessions; `stimulus_sources` counts the stimuli by source. `sample` is the
    planned and the achieved sample, before any exclusion. Raises DataRefused for a factor without a column, or with a
    reserved name.
    """

    name: str
    table: pd.DataFrame
    within: tuple[str, ...]
    between: tuple[str, ...]
    attributes: tuple[str, ...]
    scale: Scale | None
    inputs: tuple[Input, ...]
    exclusions: tuple[Exclusion, ...] = ()
    antonyms: Mapping[str, str] = field(default_factory=lambda: _NONE)
    categories: Mapping[str, str] = field(default_factory=lambda: _NONE)
    crossings: tuple[Crossing, ...] = ()
    repeats: int = 1
    sessions: int | None = None
    pooled: str = ""
    families: str = ""
    simulated: bool = False
    interrupted: tuple[str, ...] = ()
    seeds: tuple[int, ...] = ()
    stimulus_sources: Mapping[str, int] = field(default_factory=lambda: _NO_COUNTS)
    sample: Mapping[str, Any] = field(default_factory=lambda: _NONE)
    source: str = ""
    licence: str = ""

    def __post_init__(self) -> None:
        needed = ("participant", "attribute", "value", *self.within, *self.between)
        for column in needed:
            if column not in self.table.columns:
                names = ", ".join(map(str, self.table.columns))
                raise DataRefused(f"data set {self.name!r}: no column {column!r}; the columns are {names}")
        if len(set(needed)) != len(needed):
            raise DataRefused(f"data set {self.name!r}: a factor is named twice among {', '.join(needed)}")
        largest = float(self.table["value"].abs().max()) if len(self.table) else 0.0
        ends = (abs(self.scale.low), abs(self.scale.high)) if self.scale is not None else ()
        most = max(largest, *ends) if ends else largest
        if LARGEST < most < math.inf:  # what is not finite is the design check's
            raise DataRefused(
                f"data set {self.name!r}: a rating or scale end of {most:g}; at most {LARGEST:g} is expected, whose"
                " sums and squares a computer can hold: correct the table, or give the ratings in a larger unit"
            )
        for role, name in taken_names({"within": self.within, "between": self.between}):
            if (role, name) == ("within", "stimulus"):
                continue  # the factor of a study whose stimuli nothing crosses
            raise DataRefused(
                f"data set {self.name!r}: the {role} factor {name!r} has a name with a special meaning;"
                f" give it another one than {', '.join(sorted(RESERVED))}"
            )

    @property
    def cells(self) -> tuple[str, ...]:
        """The columns whose combinations each participant should have: the declared ones, else the within factors."""
        return tuple(dict.fromkeys(name for crossing in self.crossings for name in crossing.levels)) or self.within

    @property
    def participants(self) -> tuple[str, ...]:
        """The participants with at least one rating, in natural order."""
        return natural(self.table["participant"].tolist())

    def levels(self, factor: str) -> tuple[str, ...]:
        """Return the levels of `factor`: declared ones in their order, then others that occur, in natural order."""
        if factor not in self.table.columns:
            raise DataRefused(f"data set {self.name!r}: no factor {factor!r}; the factors are {self.factors_text()}")
        declared: dict[str, None] = {}
        for crossing in self.crossings:
            declared.update(dict.fromkeys(crossing.levels.get(factor, ())))
            if factor in crossing.between:
                declared[crossing.between[factor]] = None
        if factor == "attribute":
            declared.update(dict.fromkeys(self.attributes))
        if factor == self.families and self.pooled not in ("", factor):
            # The families as they come along the levels of the factor that all participants share.
            pairs = set(zip(self.table[self.pooled].tolist(), self.table[self.families].tolist(), strict=True))
            rank = {level: place for place, level in enumerate(self.levels(self.pooled))}
            in_order = sorted(pairs, key=lambda pair: (rank[pair[0]], natural_key(pair[1])))
            declared.update(dict.fromkeys(family for _, family in in_order))
        return (*declared, *natural(set(self.table[factor].tolist()) - set(declared)))

    def factors_text(self) -> str:
        """Return the factors as text for a message."""
        return ", ".join((*self.within, *self.between)) or "none"

    def only(self, attribute: str) -> Ratings:
        """Return the ratings of one attribute; leaving out the others is no exclusion."""
        if attribute not in self.attributes:
            raise DataRefused(
                f"data set {self.name!r}: no attribute {attribute!r}; the attributes are {some(self.attributes)}"
            )
        rows = self.table[self.table["attribute"] == attribute].reset_index(drop=True)
        return replace(self, table=rows, attributes=(attribute,))


def natural(texts: Iterable[str]) -> tuple[str, ...]:
    """Return the distinct texts in natural order: g2 before g10."""
    return tuple(sorted(set(texts), key=natural_key))


def natural_key(text: str) -> tuple[tuple[tuple[int, int, str], ...], str]:
    """Return a sort key that reads runs of digits as numbers of any length; it is equal only for equal texts."""
    parts: list[tuple[int, int, str]] = []
    for part in re.findall(r"[0-9]+|[^0-9]+", text):
        digits = part.lstrip("0")
        parts.append((0, len(digits), digits) if part[0] in "0123456789" else (1, 0, part))
    return tuple(parts), text


def crossed_columns(groups: Sequence[Sequence[Mapping[str, str]]], only: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the largest set of columns whose full crossing identifies every stimulus of every group, each cell once.

    `groups` has the columns of each group's stimuli. A column with one level is no factor; `only`, if given, are the
    columns to choose from. Of two sets of equal size the one with the earlier columns is chosen. Returns () if no set
    identifies the stimuli.
    """
    stimuli = [stimulus for group in groups for stimulus in group]
    shared = [name for name in stimuli[0] if all(name in stimulus for stimulus in stimuli)] if stimuli else []
    columns = []
    for name in only or shared:
        levels_and_stimuli = [(len({stimulus[name] for stimulus in group}), len(group)) for group in groups]
        if all(levels > 1 and number % levels == 0 for levels, number in levels_and_stimuli):
            columns.append(name)

    def is_full_crossing(chosen: tuple[str, ...], group: Sequence[Mapping[str, str]]) -> bool:
        cells = {tuple(stimulus[name] for name in chosen) for stimulus in group}
        return len(cells) == len(group) == prod(map(len, levels_of(chosen, group).values()))

    for size in range(len(columns), 0, -1):
        for chosen in combinations(columns, size):
            if all(is_full_crossing(chosen, group) for group in groups):
                return chosen
    return ()


def levels_of(columns: Sequence[str], stimuli: Sequence[Mapping[str, str]]) -> dict[str, tuple[str, ...]]:
    """Return the levels of each column in the study's order."""
    return {name: tuple(dict.fromkeys(stimulus[name] for stimulus in stimuli)) for name in columns}
