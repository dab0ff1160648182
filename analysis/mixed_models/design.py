"""The columns of a mixed model: variables, effects, contrasts and random effects.

The model is fitted in columns that are centred and of size one (or in sum coding), so that neither an offset of 1e9 nor
a unit of measurement costs a digit. `back` maps to the reported columns: with c the internal and x the reported columns
of a variable, [1, c] = [1, x] back, and so the coefficients of x are back times those of c. The contrasts of type III
are lmerTest's (3.1), in internal coordinates: F does not depend on the rows of a hypothesis, but its pooled denominator
df does slightly, where the rows have different df. With several effects they are each level against the first, averaged
over the other factors; with a single effect the rows of a Doolittle factorisation of X'X in treatment coding.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import combinations, product
from typing import Any, Literal, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.statistics.cells import Coded, Codes, coded, numbers_of
from palpate.analysis.statistics.doubles import Floats, difference
from palpate.analysis.statistics.refusals import BadOption, BadValue, NotIdentified, TooFew, UnknownColumn, listed

Effect: TypeAlias = tuple[str, ...]
INTERCEPT = "(Intercept)"
Coding: TypeAlias = Literal["treatment", "sum"]
RowSelection: TypeAlias = slice | Codes


@dataclass(frozen=True)
class Design:
    """The effects of a model, the intercept () first, each after all of its parts; `variables` by name."""

    variables: Mapping[str, Variable]
    effects: tuple[Effect, ...]

    @property
    def widths(self) -> list[int]:
        """The number of columns of each effect."""
        return [math.prod(self.variables[name].width for name in effect) for effect in self.effects]

    @property
    def places(self) -> dict[Effect, slice]:
        """The slice of each effect's columns."""
        ends = np.cumsum(self.widths).tolist()
        return {e: slice(end - w, end) for e, end, w in zip(self.effects, ends, self.widths, strict=True)}

    @property
    def names(self) -> list[str]:
        """The names of the reported columns, such as "car[K8]:damping"."""
        labels = [product(*(self.variables[name].labels for name in effect)) for effect in self.effects]
        return [":".join(parts) or INTERCEPT for of_effect in labels for parts in of_effect]

    def columns(self, rows: RowSelection, count: int) -> Floats:
        """Return the internal columns of these rows, (rows, columns)."""
        parts = {name: variable.columns(rows) for name, variable in self.variables.items()}
        ones = np.ones((count, 1))
        return np.concatenate([reduce(_times, (parts[v] for v in effect), ones) for effect in self.effects], axis=1)

    def back(self) -> Floats:
        """Return the matrix B with which reported coefficients are B times the internal ones."""
        places = self.places
        whole = np.zeros((sum(self.widths),) * 2)
        for effect in self.effects:
            for part in _parts(effect):
                backs = {name: self.variables[name].back for name in effect}
                blocks = [back[1:, 1:] if name in part else back[:1, 1:] for name, back in backs.items()]
                whole[places[part], places[effect]] = kronecker(blocks)
        return whole


def _times(a: Floats, b: Floats) -> Floats:
    return (a[:, :, None] * b[:, None, :]).reshape(len(a), -1)


def _parts(effect: Effect) -> list[Effect]:
    return [part for size in range(len(effect) + 1) for part in combinations(effect, size)]


def effects_of(mains: Sequence[str], interactions: Sequence[str]) -> tuple[Effect, ...]:
    """Return the effects of main effects and "a:b" interactions, sorted by size.

    Every part of an interaction must be included. Raises UnknownColumn (an effect named twice) or BadOption (an
    interaction without its parts).
    """
    place = {name: i for i, name in enumerate(mains)}
    if len(place) < len(mains):
        raise UnknownColumn(f"a column is named twice among the effects {', '.join(map(repr, mains))}")
    crossed = [tuple(sorted(text.split(":"), key=lambda v: place.get(v, -1))) for text in interactions]
    effects: list[Effect] = [(), *((name,) for name in mains), *sorted(crossed, key=len)]
    if len(set(effects)) < len(effects):
        raise UnknownColumn(f"an interaction is named twice: {', '.join(interactions)}")
    for effect in crossed:
        missing = [":".join(part) for part in _parts(effect) if part not in effects]
        if missing or len(set(effect)) < len(effect):
            raise BadOption(
                f"the interaction {':'.join(effect)!r} needs {', '.join(missing) or 'two different columns'} "
                "among the effects; an interaction without its parts has no meaning"
            )
    return tuple(effects)


def triangle_of(rows: Floats) -> Floats:
    """Return R of rows = Q R, of one matrix or a stack, which has the same sums of squares in fewer rows."""
    r: Any = np.linalg.qr(rows, mode="r")
    triangle: Floats = r
    return triangle


def kronecker(blocks: Iterable[Floats]) -> Floats:
    """Return the Kronecker product of matrices, [[1]] of none."""
    whole: Floats = np.ones((1, 1))
    for block in blocks:
        whole = np.asarray(np.kron(whole, block), dtype=np.float64)
    return whole


@dataclass(frozen=True)
class Variable:
    """A factor (`codes` and the `table` of its levels' columns) or a number (`values`), by row."""

    name: str
    labels: tuple[str, ...]
    back: Floats
    codes: Codes | None = None
    table: Floats | None = None
    values: Floats | None = None

    @property
    def width(self) -> int:
        """The number of columns of the variable."""
        return len(self.back) - 1

    def columns(self, rows: RowSelection) -> Floats:
        """Return the internal columns of these rows, (rows, width)."""
        if self.codes is not None and self.table is not None:
            picked: Floats = self.table[self.codes[rows]]
            return picked
        return np.asarray(self.values)[rows, None]


@dataclass(frozen=True)
class Factor:
    """The levels of a column, and each row's level."""

    name: str
    codes: Codes
    levels: tuple[str, ...]


def factor_of(column: pd.Series[Any], name: Hashable, order: Sequence[Any] | None = None) -> Factor:
    """Return a column of labels as a factor, with levels in the given order or else in natural order.

    Raises BadValue (no label, labels with the same text), BadOption (a level missing in the order), TooFew (one level).
    """
    groups = coded(column, name)
    texts = [str(label) for label in groups.labels]
    if len(texts) < 2:
        raise TooFew(f"factor {name!r} has one level, {texts[0]!r}; a comparison needs two or more")
    if order is None:
        return Factor(str(name), groups.codes, tuple(texts))
    place = {str(level): i for i, level in enumerate(order)}
    unknown = [text for text in texts if text not in place]
    if unknown:
        raise BadOption(f"levels of {name!r} lack {listed(map(repr, unknown), len(unknown))}; name every level")
    sorted_texts = sorted(texts, key=place.__getitem__)
    rank = np.array([sorted_texts.index(text) for text in texts], dtype=np.intp)
    return Factor(str(name), rank[groups.codes], tuple(sorted_texts))


def sum_table(levels: int) -> Floats:
    """Return sum coding, (levels, levels - 1): each column is one level against the last; effects sum to zero."""
    return np.vstack([np.eye(levels - 1), -np.ones(levels - 1)])


def factor_variable(factor: Factor, coding: Coding, internal: Coding = "sum") -> Variable:
    """Return a factor in `internal` columns that is reported in `coding`."""
    k = len(factor.levels)
    tables = {"sum": sum_table(k), "treatment": np.eye(k)[:, 1:]}
    inner, outer = (np.column_stack([np.ones(k), tables[kind]]) for kind in (internal, coding))
    reported = factor.levels[1:] if coding == "treatment" else factor.levels[:-1]
    back = np.eye(k) if internal == coding else np.linalg.solve(outer, inner)
    labels = tuple(f"{factor.name}[{level}]" for level in reported)
    return Variable(factor.name, labels, back, codes=factor.codes, table=tables[internal])


def number_variable(column: pd.Series[Any], name: Hashable, centre: bool = True) -> Variable:
    """Return a numeric column, centred (if `centre`) and divided by a power of two near its size.

    Raises BadValue (text, NaN, infinity) or TooFew (one value).
    """
    x = numbers_of(column, name)
    empty = np.flatnonzero(np.isnan(x)).tolist()
    if empty:
        where = listed((f"row {row + 1}" for row in empty), len(empty))
        raise BadValue(f"column {name!r} has no number in {where}; name every row's number or take these rows out")
    high, low = difference(x, np.full_like(x, x.min()))
    if not high.any():
        raise TooFew(f"column {name!r} has one value, {x[0]:g}; an effect of it needs two or more")
    mean = math.fsum(high.tolist()) / len(high) if centre else 0.0
    moved = (high - mean) + low if centre else x
    largest = float(np.abs(moved).max())
    _, exponent = math.frexp(math.sqrt(float(np.mean((moved / largest) ** 2)) * largest * largest))
    middle, size = (float(x.min()) + mean if centre else 0.0), math.ldexp(1.0, exponent)
    back = np.array([[1.0, -middle / size], [0.0, 1 / size]])
    return Variable(str(name), (str(name),), back, values=np.ldexp(moved, -exponent))


def type_three(design: Design, triangle: Floats) -> dict[Effect, Floats]:
    """Return each effect's contrasts; `design` reports sum coding, `triangle` is R of its columns (X'X = R'R)."""
    effects = [effect for effect in design.effects if effect]
    if len(effects) == 1:
        # The effect's rows of L', where X'X = L D L' in treatment coding; a triangle of X is D^(1/2) L'.
        back = design.back().copy()
        effect = design.effects[-1]
        if design.variables[effect[0]].table is not None:
            back[1:] = _against_first(design, effect) @ back[1:]
            back[0, 1:] = np.asarray(design.variables[effect[0]].table)[0]
        upper = triangle_of(triangle @ np.linalg.inv(back))
        rows: Floats = (upper / np.diag(upper)[:, None])[1:] @ back
        return {effects[0]: rows}
    back, places = design.back(), design.places
    return {effect: _against_first(design, effect) @ back[places[effect]] for effect in effects}


def _against_first(design: Design, effect: Effect) -> Floats:
    return kronecker(_differences(design.variables[name]) for name in effect)


def _differences(variable: Variable) -> Floats:
    """Return the differences from the first level in sum-coded coefficients; a number is unchanged."""
    if variable.table is None:
        return np.ones((1, 1))
    differences: Floats = variable.table[1:] - variable.table[:1]
    return differences


@dataclass(frozen=True)
class Random:
    """The random effects of one grouping factor: an intercept and slopes, correlated or not.

    `back` maps a level's effects from internal to reported coordinates.
    """

    name: str
    codes: Codes
    levels: tuple[str, ...]
    design: Design
    back: Floats
    correlated: bool

    @property
    def size(self) -> int:
        """The number of random effects per level."""
        return len(self.back)

    @property
    def effects(self) -> list[str]:
        """The names of a level's reported random effects."""
        return self.design.names

    @property
    def free(self) -> int:
        """The number of parameters of its relative covariance factor."""
        return self.size * (self.size + 1) // 2 if self.correlated else self.size


def grouping(frame: pd.DataFrame, name: str) -> Coded:
    """Return the levels of a grouping factor: a column, or nested columns joined by ":"."""
    parts = [name] if name in frame.columns else name.split(":")
    axes = [coded(frame[part], part) for part in parts]
    flat = np.zeros(len(frame), dtype=np.intp)
    for axis in axes:
        flat = flat * len(axis.labels) + axis.codes
    cells, codes = np.unique(flat, return_inverse=True)
    places = np.unravel_index(cells, [len(axis.labels) for axis in axes])
    labels = zip(*([axis.labels[i] for i in place] for axis, place in zip(axes, places, strict=True)), strict=True)
    return Coded(codes.reshape(-1), [":".join(map(str, parts_of_one)) for parts_of_one in labels])


def group_columns(names: Sequence[str], columns: Sequence[object]) -> list[str]:
    """Return the columns of grouping factors."""
    parts = [[name] if name in columns else name.split(":") for name in names]
    return list(dict.fromkeys(part for columns_of_one in parts for part in columns_of_one))


def random_effects_of(
    frame: pd.DataFrame,
    name: str,
    slopes: Sequence[str],
    factors: Mapping[str, Factor],
    coding: Coding,
    correlated: bool,
) -> Random:
    """Return the random effects of one grouping factor: intercept, slopes of columns and of their "a:b" interactions.

    Raises TooFew (one level) or NotIdentified (more effects than values, a slope that never varies within a level).
    """
    groups = grouping(frame, name)
    if len(groups.labels) < 2:
        raise TooFew(f"grouping factor {name!r} has one level, {groups.labels[0]!r}; a variance needs two or more")
    mains = [slope for slope in slopes if ":" not in slope or slope in frame.columns]
    crossed = [slope for slope in slopes if slope not in mains]
    internal: Coding = "sum" if correlated else coding
    variables = {
        slope: factor_variable(factors[slope], coding, internal)
        if slope in factors
        else number_variable(frame[slope], slope, centre=correlated)
        for slope in mains
    }
    if name in mains or set(name.split(":")) & set(mains):
        raise UnknownColumn(f"{name!r} is both a grouping factor and one of its slopes; name another column")
    design = Design(variables, effects_of(mains, crossed))
    random = Random(name, groups.codes, tuple(map(str, groups.labels)), design, design.back(), correlated)
    count = len(random.levels) * random.size
    if count >= len(frame):
        raise NotIdentified(
            f"grouping factor {name!r} has {count:,} random effects ({len(random.levels):,} levels x {random.size}) for"
            f" {len(frame):,} values; the residual cannot be separated from them: drop slopes or the factor"
        )
    _refuse_constant_slopes(random, len(frame))
    return random


def _refuse_constant_slopes(random: Random, rows: int) -> None:
    """Raise NotIdentified for slopes that never vary within a level, which cannot be separated from the intercept."""
    first = np.zeros(len(random.levels), dtype=np.intp)
    first[random.codes[::-1]] = np.arange(rows)[::-1]
    for effect, place in random.design.places.items():
        alone = Design(random.design.variables, (effect,))
        varies = np.zeros(place.stop - place.start, dtype=bool)
        for start in range(0, rows, 65536):
            part = np.arange(start, min(start + 65536, rows))
            here, there = (alone.columns(at, len(at)) for at in (part, first[random.codes[part]]))
            varies |= (here != there).any(axis=0)
        still = [random.effects[place.start + i] for i in np.flatnonzero(~varies).tolist()]
        if effect and still:
            raise NotIdentified(
                f"the random slope of {listed(map(repr, still), len(still))} varies within no level of "
                f"{random.name!r}, so it cannot be separated from the intercept; remove the slope"
            )
