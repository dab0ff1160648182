"""Grouping factors and their random effects: who belongs where, which effects vary, and in which coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from palpate.analysis.mixed_models.design import Design, effects_of
from palpate.analysis.mixed_models.refusals import NotIdentified
from palpate.analysis.mixed_models.variables import Coding, Factor, factor_variable, number_variable
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.labels import Coded, Codes, coded
from palpate.analysis.statistics.refusals import TooFew, UnknownColumn, listed


@dataclass(frozen=True)
class Random:
    """The random effects of one grouping factor: an intercept and slopes, correlated or not.

    `back` maps the effects of a level in internal coordinates to those that are reported.
    """

    name: str
    codes: Codes
    levels: tuple[str, ...]
    design: Design
    back: Floats
    correlated: bool

    @property
    def size(self) -> int:
        """Random effects per level."""
        return len(self.back)

    @property
    def effects(self) -> list[str]:
        """The names of a level's reported random effects."""
        return self.design.names

    @property
    def free(self) -> int:
        """How many numbers its relative covariance factor has."""
        return self.size * (self.size + 1) // 2 if self.correlated else self.size


def grouping(frame: pd.DataFrame, name: str) -> Coded:
    """The levels of a grouping factor: a column, or columns joined by ":" (the levels of one within another's)."""
    parts = [name] if name in frame.columns else name.split(":")
    axes = [coded(frame[part], part) for part in parts]
    flat = np.zeros(len(frame), dtype=np.intp)
    for axis in axes:
        flat = flat * len(axis.labels) + axis.codes
    found, codes = np.unique(flat, return_inverse=True)
    places = np.unravel_index(found, [len(axis.labels) for axis in axes])
    labels = zip(*([axis.labels[i] for i in place] for axis, place in zip(axes, places, strict=True)), strict=True)
    return Coded(codes.reshape(-1), [":".join(map(str, each)) for each in labels])


def group_columns(names: Sequence[str], columns: Sequence[object]) -> list[str]:
    """The columns that grouping factors are made of."""
    parts = [[name] if name in columns else name.split(":") for name in names]
    return list(dict.fromkeys(part for each in parts for part in each))


def random_effects_of(
    frame: pd.DataFrame,
    name: str,
    slopes: Sequence[str],
    factors: Mapping[str, Factor],
    coding: Coding,
    correlated: bool,
) -> Random:
    """The random effects of one grouping factor: intercept, slopes of columns and of their "a:b" interactions.

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
        raise UnknownColumn(f"{name!r} is a grouping factor and one of its own slopes; name another column")
    design = Design(variables, effects_of(mains, crossed))
    random = Random(name, groups.codes, tuple(map(str, groups.labels)), design, design.back(), correlated)
    _refuse_too_many(random, len(frame))
    _refuse_still(random, len(frame))
    return random


def _refuse_too_many(random: Random, rows: int) -> None:
    count = len(random.levels) * random.size
    if count >= rows:
        raise NotIdentified(
            f"grouping factor {random.name!r} has {count:,} random effects ({len(random.levels):,} levels x "
            f"{random.size}) for {rows:,} values; the residual cannot be told from them: take slopes or the factor out"
        )


def _refuse_still(random: Random, rows: int) -> None:
    """Refuse slopes that vary within no level: they cannot be told from the intercept's variance."""
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
                f"{random.name!r}, so it cannot be told from the intercept; take the slope out"
            )
