"""The columns of a set of effects: main effects and interactions of variables, with the way back to reported ones."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import combinations, product
from typing import TypeAlias

import numpy as np

from palpate.analysis.mixed_models.linear import kronecker
from palpate.analysis.mixed_models.variables import Rows, Variable
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadOption, UnknownColumn

Effect: TypeAlias = tuple[str, ...]
INTERCEPT = "(Intercept)"


@dataclass(frozen=True)
class Design:
    """Effects, the intercept () first, each after all of its parts; `variables` by name."""

    variables: Mapping[str, Variable]
    effects: tuple[Effect, ...]

    @property
    def widths(self) -> list[int]:
        """The number of columns of each effect."""
        return [math.prod(self.variables[name].width for name in effect) for effect in self.effects]

    @property
    def places(self) -> dict[Effect, slice]:
        """Where each effect's columns stand."""
        ends = np.cumsum(self.widths).tolist()
        return {e: slice(end - w, end) for e, end, w in zip(self.effects, ends, self.widths, strict=True)}

    @property
    def names(self) -> list[str]:
        """The names of the reported columns, such as "car[K8]:damping"."""
        labels = [product(*(self.variables[name].labels for name in effect)) for effect in self.effects]
        return [":".join(parts) or INTERCEPT for each in labels for parts in each]

    def columns(self, rows: Rows, count: int) -> Floats:
        """The internal columns of these rows, (rows, columns)."""
        parts = {name: variable.columns(rows) for name, variable in self.variables.items()}
        ones = np.ones((count, 1))
        return np.concatenate([reduce(_times, (parts[v] for v in effect), ones) for effect in self.effects], axis=1)

    def back(self) -> Floats:
        """The matrix B with which reported coefficients are B times the internal ones."""
        places = self.places
        whole = np.zeros((sum(self.widths),) * 2)
        for effect in self.effects:
            for part in _parts(effect):
                blocks = [self._block(name, name in part) for name in effect]
                whole[places[part], places[effect]] = kronecker(blocks)
        return whole

    def _block(self, name: str, kept: bool) -> Floats:
        back = self.variables[name].back
        return back[1:, 1:] if kept else back[:1, 1:]


def _times(a: Floats, b: Floats) -> Floats:
    return (a[:, :, None] * b[:, None, :]).reshape(len(a), -1)


def _parts(effect: Effect) -> list[Effect]:
    return [part for size in range(len(effect) + 1) for part in combinations(effect, size)]


def effects_of(mains: Sequence[str], interactions: Sequence[str]) -> tuple[Effect, ...]:
    """The effects of main effects and "a:b" interactions, sorted by size; every part of an interaction must be there.

    Raises UnknownColumn (an effect named twice) or BadOption (an interaction without its parts).
    """
    place = {name: i for i, name in enumerate(mains)}
    if len(place) < len(mains):
        raise UnknownColumn(f"a column is named twice among the effects {', '.join(map(repr, mains))}")
    crossed = [tuple(sorted(text.split(":"), key=lambda v: place.get(v, -1))) for text in interactions]
    effects: list[Effect] = [(), *((name,) for name in mains), *sorted(crossed, key=len)]
    if len(set(effects)) < len(effects):
        raise UnknownColumn(f"an interaction is named twice: {', '.join(interactions)}")
    for effect in crossed:
        lacking = [":".join(part) for part in _parts(effect) if part not in effects]
        if lacking or len(set(effect)) < len(effect):
            raise BadOption(
                f"the interaction {':'.join(effect)!r} needs {', '.join(lacking) or 'two different columns'} "
                "among the effects; an interaction without its parts has no meaning of its own"
            )
    return tuple(effects)
