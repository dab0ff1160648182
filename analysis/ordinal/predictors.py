"""Columns of a long table to the columns of a model: coded factors, numbers and their products."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.ordinal.ranks import refuse_huge
from palpate.analysis.statistics.column_values import numbers_of
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.labels import coded
from palpate.analysis.statistics.refusals import BadOption, BadValue, TooFew, UnknownColumn, listed

Coding: TypeAlias = Literal["treatment", "sum"]
Orders: TypeAlias = Mapping[str, Sequence[Hashable]]
Named: TypeAlias = list[tuple[str, Floats]]


@dataclass(frozen=True)
class Term:
    """One term of a model: its name, the columns of the table that it is made of, and its own columns."""

    name: str
    parts: frozenset[str]
    columns: tuple[str, ...]
    values: Floats  # (rows, columns)


@dataclass(frozen=True)
class Asked:
    """The predictors of a model by column: factors, numbers, and interactions written "a:b"."""

    fixed: tuple[str, ...]
    numeric: tuple[str, ...] = ()
    interactions: tuple[str, ...] = ()
    coding: Coding = "treatment"

    @property
    def names(self) -> list[str]:
        """The table's columns that the model needs."""
        return [*self.fixed, *self.numeric]


def terms_of(data: pd.DataFrame, asked: Asked, orders: Orders) -> list[Term]:
    """The model's terms, in the order asked for, interactions last.

    `orders` gives a factor's levels in an order of one's own; the first is what "treatment" compares with. Raises
    UnknownColumn, BadValue, BadOption or TooFew.
    """
    made = {name: _factor(data, name, asked.coding, orders.get(name)) for name in asked.fixed}
    made |= {name: [(name, _numbers(data, name))] for name in asked.numeric}
    terms = [_term(name, frozenset((name,)), named) for name, named in made.items()]
    for name in asked.interactions:
        parts = _parts(name, made)
        terms.append(_term(name, frozenset(parts), _products([made[part] for part in parts])))
    _refuse_twice([term.name for term in terms], [term.parts for term in terms])
    return terms


def _term(name: str, parts: frozenset[str], named: Named) -> Term:
    return Term(name, parts, tuple(label for label, _ in named), np.column_stack([values for _, values in named]))


def _factor(data: pd.DataFrame, name: str, coding: Coding, order: Sequence[Hashable] | None) -> Named:
    codes, labels = coded(data[name], name)
    if len(labels) < 2:
        raise TooFew(f"factor {name!r} has one level, {labels[0]!r}; a comparison needs two or more")
    if order is not None:
        codes, labels = _reordered(codes, labels, list(order), name)
    if coding == "treatment":
        return [(f"{name}[{label}]", (codes == i) * 1.0) for i, label in enumerate(labels) if i]
    last = len(labels) - 1
    return [(f"{name}[{labels[i]}]", (codes == i) * 1.0 - (codes == last)) for i in range(last)]


def _reordered(
    codes: np.ndarray, labels: list[Hashable], order: list[Hashable], name: str
) -> tuple[np.ndarray, list[Hashable]]:
    lost = [repr(label) for label in labels if label not in order]
    if lost:
        raise BadOption(f"the order of {name!r} lacks {listed(lost, len(lost))}; give every level that has rows")
    kept = [label for label in dict.fromkeys(order) if label in labels]
    place = np.array([kept.index(label) for label in labels], dtype=np.intp)
    return place[codes], kept


def _numbers(data: pd.DataFrame, name: str) -> Floats:
    values = numbers_of(data[name], name)
    rows = np.flatnonzero(np.isnan(values)).tolist()
    if rows:
        where = listed((f"row {row + 1}" for row in rows), len(rows))
        raise BadValue(f"column {name!r} has no number in {where}; take these rows out")
    refuse_huge(values)
    return values


def _parts(name: str, made: Iterable[str]) -> list[str]:
    known, parts = list(made), name.split(":")
    for part in parts:
        if part not in known:
            raise UnknownColumn(f"the interaction {name!r} names {part!r}, which is no predictor: {', '.join(known)}")
    if len(parts) < 2 or len(set(parts)) < len(parts):
        raise BadOption(f"interaction {name!r}: two or more different predictors are expected, as in 'a:b'")
    return parts


def _products(parts: list[Named]) -> Named:
    found = []
    for combination in product(*parts):
        label = ":".join(name for name, _ in combination)
        found.append((label, np.prod([values for _, values in combination], axis=0)))
    return found


def _refuse_twice(names: list[str], parts: list[frozenset[str]]) -> None:
    if not names:
        raise BadOption("no predictor is named; give `fixed`, `numeric` or both")
    twice = sorted({repr(name) for name, own in zip(names, parts, strict=True) if parts.count(own) > 1})
    if twice:
        raise BadOption(f"{listed(twice, len(twice))} named twice; name every term once")
