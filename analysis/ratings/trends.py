"""Trends of ratings along the levels of a family, and differences of levels from the reference."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.one_sample import NAN, OneSample, columns_of, one_sample
from palpate.analysis.ratings.person_cells import (
    NO_LEVELS,
    Levels,
    PersonCells,
    complete_people,
    person_cells,
    texts_of,
)
from palpate.analysis.statistics.doubles import Floats, differences
from palpate.analysis.statistics.f_and_t import adjusted
from palpate.analysis.statistics.refusals import BadOption, listed
from palpate.protocols.did_you_mean import nearest

Row: TypeAlias = dict[str, object]
CORRECTIONS = {"holm": "holm", "bonferroni": "bonf", "none": "none"}


@dataclass(frozen=True)
class Trends:
    """The result: `slopes` has a row per family, `levels` a row per level against the reference, empty without one.

    Columns of both: n, mean, sd, ci_low, ci_high, t, df, p, p_corrected, family_size, dz, note. `mean` is the mean
    slope over participants (per step, or per unit of the numeric column) or the mean difference from the reference.
    """

    slopes: pd.DataFrame
    levels: pd.DataFrame
    reference: str | None


def trends(
    data: pd.DataFrame,
    dv: str = "value",
    *,
    level: str,
    family: str,
    subject: str = "participant",
    numeric: str | None = None,
    reference: str | None = None,
    correction: str = "holm",
    size: int | None = None,
    confidence: float = 0.95,
    missing: str = "raise",
    levels: Levels = NO_LEVELS,
) -> Trends:
    """Return each participant's least-squares slope over a family's levels, and their mean with its t interval.

    The levels are one step apart in their order (`levels`, else natural), or at the numbers in the column `numeric`,
    one per level. Values of a participant at one level are averaged first. `reference` is a level that belongs to no
    trend (None: the first one, where it is a family of its own). p is corrected over the families that have a slope,
    and by itself over the levels that are compared with the reference; `size` fixes a larger family of slopes
    beforehand. A family of one level has no slope and a note. Raises DataRefused where a level is in two families or
    has two numbers, IncompleteCells where a participant lacks a level (unless `missing="listwise"`, which leaves them
    out of this family), BadOption, UnknownColumn, BadValue.
    """
    cells = person_cells(data, (level,), dv=dv, subject=subject, levels=levels)
    families = families_of(data, level, family, cells.level(level))
    steps = steps_of(data, level, numeric)
    return cell_trends(cells, families, steps, reference, correction, size, confidence, missing)


def cell_trends(
    cells: PersonCells,
    families: Mapping[str, str],
    steps: Mapping[str, float] | None,
    reference: str | None = None,
    correction: str = "holm",
    size: int | None = None,
    confidence: float = 0.95,
    missing: str = "raise",
) -> Trends:
    """Return `trends` from the participants' means at each level (cells of one column, in order)."""
    order = cells.level(cells.by[0])
    # The cells of each family, in order; families as they come along the levels.
    members = {
        families[level]: [j for j, two in enumerate(order) if families[two] == families[level]] for level in order
    }
    if not any(len(at) > 1 for at in members.values()):
        raise DataRefused("no family has two levels; a trend needs at least two")
    start = reference_level(order, families, reference)
    if correction not in CORRECTIONS:
        raise BadOption(f"correction {correction!r} is unknown: one of {', '.join(CORRECTIONS)}")
    slopes = [
        (name, _slope(cells, at, steps, confidence, missing))
        for name, at in members.items()
        if [order[j] for j in at] != [start]
    ]
    against = []  # every other level minus the reference
    for j, one in enumerate(order):
        if start is not None and one != start:
            pair = cells.only([order.index(start), j])
            pair = pair.only((0, 1), _there(pair, missing))
            gaps = pair.values[:, 1] - pair.values[:, 0]
            difference = one_sample(gaps, floor=pair.floor(), confidence=confidence, what="differences")
            against.append((one, difference))
    return Trends(
        pd.DataFrame(
            _rows([{"family": name, "levels": len(members[name])} for name, _ in slopes], slopes, correction, size)
        ),
        pd.DataFrame(
            _rows([{"level": name, "family": families[name]} for name, _ in against], against, correction, None)
        ),
        start,
    )


def families_of(data: pd.DataFrame, level: str, family: str, order: Sequence[str]) -> dict[str, str]:
    """Return the family of each level. Raises DataRefused for a level in two families."""
    families: dict[str, set[str]] = {}
    for one, group in zip(texts_of(data, level), texts_of(data, family), strict=True):
        families.setdefault(one, set()).add(group)
    if torn := [f"{label!r} in {' and '.join(sorted(families[label]))}" for label in order if len(families[label]) > 1]:
        raise DataRefused(
            f"column {family!r}: {listed(torn, len(torn))}; a trend needs one {family} for each {level}:"
            " correct the stimulus table or name another column"
        )
    return {level: next(iter(families[level])) for level in order}


def steps_of(data: pd.DataFrame, level: str, numeric: str | None) -> dict[str, float] | None:
    """Return the number of each level in a column, None without a column.

    Raises an error for several numbers of a level.
    """
    if numeric is None:
        return None
    numbers: dict[str, set[str]] = {}
    for one, number in zip(texts_of(data, level), texts_of(data, numeric), strict=True):
        numbers.setdefault(one, set()).add(number)
    if several := [f"{one!r} ({len(numbers)} numbers)" for one, numbers in sorted(numbers.items()) if len(numbers) > 1]:
        raise DataRefused(
            f"column {numeric!r} has more than one number for {level} {listed(several, len(several))};"
            " name a column with one number for each, or leave it out: the levels then stand one step apart"
        )
    return {one: _number(next(iter(numbers)), numeric, one) for one, numbers in numbers.items()}


def _number(text: str, column: str, level: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = NAN
    if not math.isfinite(value):
        raise DataRefused(f"column {column!r} holds {text!r} at {level!r}; a finite number is expected")
    return value


def reference_level(order: Sequence[str], families: Mapping[str, str], chosen: str | None = None) -> str | None:
    """Return the level that others are compared with: the given one, else the first if it is its own family."""
    if chosen is not None:
        if chosen not in order:
            raise DataRefused(f"no level {chosen!r} to compare with; {nearest(chosen, order)}")
        return chosen
    sizes = Counter(families[level] for level in order)
    alone = len(sizes) > 1 and sizes[families[order[0]]] == 1
    return order[0] if alone and max(sizes.values()) > 1 else None


def _slope(
    cells: PersonCells, at: list[int], steps: Mapping[str, float] | None, confidence: float, missing: str
) -> OneSample:
    family = cells.only(at)
    names = family.level(family.by[0])
    x = np.arange(len(at), dtype=float) if steps is None else np.array([steps[level] for level in names])
    if len(at) < 2 or np.ptp(x) == 0:
        why = "one level has no slope" if len(at) < 2 else "its levels share one number: no slope"
        return one_sample(np.array([]), confidence=confidence)._replace(note=why)
    family = family.only(range(len(at)), _there(family, missing))
    # The weight of each level's value in a least-squares slope: (x - mean) / sum of squares.
    away = x - x[0]
    away = away - math.fsum(away.tolist()) / len(away)
    weights: Floats = away / math.fsum((away * away).tolist())
    # The slope of every row, from differences to its first value.
    high, low = differences((family.values, None), 1) if len(family.values) else (family.values, None)
    change = high if low is None else high + low
    rises = np.array([math.fsum(row) for row in (change * weights).tolist()])
    floor = family.floor() * float(np.abs(weights).sum())
    return one_sample(rises, floor=floor, confidence=confidence, what="slopes")


def _there(cells: PersonCells, missing: str) -> list[int]:
    """Return who rated all of these levels; those who rated none belong to another group and are not missing."""
    any_here = np.flatnonzero(~np.isnan(cells.values).all(axis=1)).tolist()
    here = cells.only(range(len(cells.cells)), any_here)
    return [any_here[i] for i in complete_people(here, missing)]


def _rows(
    heads: Sequence[Row], samples: Sequence[tuple[str, OneSample]], correction: str, size: int | None
) -> list[Row]:
    p = [sample.p for _, sample in samples]
    tested = [i for i, (_, sample) in enumerate(samples) if sample.n > 0]
    family = len(tested) if size is None else size
    if family < len(tested):
        raise BadOption(f"a family of {size} is fixed, but {len(tested)} slopes are tested; fix at least as many")
    padded = adjusted([p[i] for i in tested] + [NAN] * (family - len(tested)), CORRECTIONS[correction])
    corrected = dict(zip(tested, padded, strict=False))
    return [
        {
            **head,
            **columns_of(sample),
            "p_corrected": corrected.get(i, NAN),
            "family_size": family,
            "note": sample.note,
        }
        for i, (head, (_, sample)) in enumerate(zip(heads, samples, strict=True))
    ]
