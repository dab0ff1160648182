"""A long table of ordered answers as answers and columns of an ordinal model, independent of the order of rows."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.ordinal.ranks import Ints, doubled_ranks, refuse_huge, rounding
from palpate.analysis.statistics.cells import check_columns, coded, numbers_of
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadOption, BadValue, IncompleteCells, TooFew, UnknownColumn, listed
from palpate.protocols.wording import count

MOST_POINTS = 200
ALIASED = 1e-9  # what is left of a column once the ones before it are taken out, relative
Coding: TypeAlias = Literal["treatment", "sum"]
Orders: TypeAlias = Mapping[str, Sequence[Hashable]]
Named: TypeAlias = list[tuple[str, Floats]]


@dataclass(frozen=True)
class OrdinalData:
    """Answers 0 .. points - 1 with the predictors' terms: each different row once, with its number in `weights`.

    Rows are sorted by participant, then by answer and predictors. `names` are the original answers from lowest to
    highest; `people` the participants, None if they do not matter; `starts` each participant's first row.
    """

    answers: Ints
    names: tuple[str, ...]
    terms: tuple[Term, ...]
    weights: Floats
    starts: Ints
    people: int | None

    @property
    def points(self) -> int:
        """The number of different answers."""
        return len(self.names)


def ordinal_data(
    data: pd.DataFrame,
    dv: Hashable,
    predictors: Predictors,
    subject: Hashable | None,
    levels: Sequence[Hashable] | None,
    orders: Orders,
) -> OrdinalData:
    """Return the answers and predictors of a long table.

    Raises UnknownColumn, BadValue, IncompleteCells, BadOption or TooFew.
    """
    check_columns(data, [dv, *predictors.names, *([] if subject is None else [subject])])
    if levels is not None:
        answers, names = _labelled(data, dv, list(levels))
    else:
        answers, names = _numbered(numbers_of(data[dv], dv), dv)
    if len(names) < 3:
        different = f"{count(len(names), 'different answer')} ({', '.join(names)})"
        raise TooFew(f"column {dv!r} holds {different}; an ordinal model needs three")
    if len(names) > MOST_POINTS:
        raise BadOption(f"column {dv!r} holds {len(names):,} different answers, more than {MOST_POINTS}: not ordinal")
    terms = terms_of(data, predictors, orders)
    people = np.zeros(len(answers), dtype=np.intp)
    participants = None
    if subject is not None:
        people, labels = coded(data[subject], subject)
        participants = len(labels)
        if participants < 2:
            raise TooFew(f"one participant, {labels[0]!r}; a random intercept needs two or more")
    # Where each different row stands, in sorted order, and how often it occurs.
    rows = np.column_stack((people, answers, *(term.values for term in terms)))
    order = np.lexsort(rows.T[::-1]).astype(np.int64)
    new = np.append(True, (np.diff(rows[order], axis=0) != 0).any(axis=1))
    first = np.flatnonzero(new)
    distinct, weights = order[first], np.diff(np.append(first, len(order))).astype(np.float64)
    shared = tuple(Term(term.name, term.parts, term.columns, term.values[distinct]) for term in terms)
    refuse_aliased(shared)
    starts = np.flatnonzero(np.diff(people[distinct], prepend=-1)).astype(np.int64)
    return OrdinalData(answers[distinct], names, shared, weights, starts, participants)


def _numbered(values: Floats, dv: Hashable) -> tuple[Ints, tuple[str, ...]]:
    """Return the answers as numbers; values that differ only by rounding are equal."""
    lost = np.flatnonzero(np.isnan(values)).tolist()
    if lost:
        where = listed((f"row {row + 1}" for row in lost), len(lost))
        raise IncompleteCells(f"no answer in column {dv!r} in {where}; take these rows out")
    refuse_huge(values)
    _, first, codes = np.unique(
        doubled_ranks(values[None], rounding(values)[None])[0], return_index=True, return_inverse=True
    )
    return codes.astype(np.int64), tuple(f"{value:.15g}" for value in values[first].tolist())


def _labelled(data: pd.DataFrame, dv: Hashable, levels: list[Hashable]) -> tuple[Ints, tuple[str, ...]]:
    codes, labels = coded(data[dv], dv)
    unknown = [repr(label) for label in labels if label not in levels]
    if unknown or len(set(levels)) < len(levels):
        what = listed(unknown, len(unknown)) or "an answer twice"
        raise BadValue(f"column {dv!r} and its levels do not agree: {what}; give every answer once, lowest first")
    ordered_levels = [label for label in levels if label in labels]
    place = np.array([ordered_levels.index(label) for label in labels], dtype=np.int64)
    return place[codes], tuple(map(str, ordered_levels))


def refuse_aliased(terms: Sequence[Term]) -> None:
    """Refuse a column that is a linear combination of the columns before it (and the thresholds)."""
    names = [name for term in terms for name in term.columns]
    x = np.concatenate([term.values for term in terms], axis=1)
    centred = x - x.mean(axis=0)
    room = np.abs(x).max(axis=0)
    basis = np.zeros((len(x), 0))
    for name, column, size in zip(names, centred.T, room.tolist(), strict=True):
        left = column - basis @ (basis.T @ column)
        left = left - basis @ (basis.T @ left)
        norm, whole = float(np.linalg.norm(left)), float(np.linalg.norm(column))
        if norm <= ALIASED * whole or whole <= 1e-14 * size * len(x) ** 0.5:
            raise BadOption(f"predictor {name!r} adds nothing to the ones before it (or never varies); leave it out")
        basis = np.concatenate((basis, (left / norm)[:, None]), axis=1)


@dataclass(frozen=True)
class Term:
    """One term of a model: its name, the columns of the table that it uses, and its own columns."""

    name: str
    parts: frozenset[str]
    columns: tuple[str, ...]
    values: Floats  # (rows, columns)


@dataclass(frozen=True)
class Predictors:
    """The predictors of a model by column: factors, numbers, and interactions written "a:b"."""

    fixed: tuple[str, ...]
    numeric: tuple[str, ...] = ()
    interactions: tuple[str, ...] = ()
    coding: Coding = "treatment"

    @property
    def names(self) -> list[str]:
        """The table's columns that the model needs."""
        return [*self.fixed, *self.numeric]


def terms_of(data: pd.DataFrame, predictors: Predictors, orders: Orders) -> list[Term]:
    """Return the model's terms, in the order requested, interactions last.

    `orders` gives the order of a factor's levels; "treatment" coding compares with the first. Raises UnknownColumn,
    BadValue, BadOption or TooFew.
    """
    built = {name: _factor(data, name, predictors.coding, orders.get(name)) for name in predictors.fixed}
    for name in predictors.numeric:
        values = numbers_of(data[name], name)
        if rows := np.flatnonzero(np.isnan(values)).tolist():
            where = listed((f"row {row + 1}" for row in rows), len(rows))
            raise BadValue(f"column {name!r} has no number in {where}; take these rows out")
        refuse_huge(values)
        built[name] = [(name, values)]
    terms = [_term(name, frozenset((name,)), named) for name, named in built.items()]
    for name in predictors.interactions:
        parts = name.split(":")
        if strange := [part for part in parts if part not in built]:
            raise UnknownColumn(
                f"the interaction {name!r} names {strange[0]!r}, which is not a predictor: {', '.join(built)}"
            )
        if len(parts) < 2 or len(set(parts)) < len(parts):
            raise BadOption(f"interaction {name!r}: two or more different predictors are expected, as in 'a:b'")
        crossed: Named = []
        for columns in product(*(built[part] for part in parts)):
            label = ":".join(column for column, _ in columns)
            crossed.append((label, np.prod([values for _, values in columns], axis=0)))
        terms.append(_term(name, frozenset(parts), crossed))
    if not terms:
        raise BadOption("no predictor is named; give `fixed`, `numeric` or both")
    columns_of = [term.parts for term in terms]
    twice = sorted({repr(term.name) for term in terms if columns_of.count(term.parts) > 1})
    if twice:
        raise BadOption(f"{listed(twice, len(twice))} named twice; name every term once")
    return terms


def _term(name: str, parts: frozenset[str], named: Named) -> Term:
    return Term(name, parts, tuple(label for label, _ in named), np.column_stack([values for _, values in named]))


def _factor(data: pd.DataFrame, name: str, coding: Coding, order: Sequence[Hashable] | None) -> Named:
    codes, labels = coded(data[name], name)
    if len(labels) < 2:
        raise TooFew(f"factor {name!r} has one level, {labels[0]!r}; a comparison needs two or more")
    if order is not None:
        lost = [repr(label) for label in labels if label not in order]
        if lost:
            raise BadOption(f"the order of {name!r} lacks {listed(lost, len(lost))}; give every level that has rows")
        ordered_labels = [label for label in dict.fromkeys(order) if label in labels]
        place = np.array([ordered_labels.index(label) for label in labels], dtype=np.intp)
        codes, labels = place[codes], ordered_labels
    if coding == "treatment":
        return [(f"{name}[{label}]", (codes == i) * 1.0) for i, label in enumerate(labels) if i]
    last = len(labels) - 1
    return [(f"{name}[{labels[i]}]", (codes == i) * 1.0 - (codes == last)) for i in range(last)]
