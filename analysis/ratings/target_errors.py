"""Errors of ratings against the target of a stimulus, on the attribute that the stimulus was made for."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.normalisation import rescaled_values
from palpate.analysis.ratings.one_sample import NAN, OneSample, one_sample
from palpate.analysis.ratings.person_cells import NO_LEVELS, Levels, PersonCells, person_cells, texts_of
from palpate.analysis.statistics.cells import check_columns, numbers_of
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import listed, refuse_idle_levels
from palpate.protocols.did_you_mean import nearest

Ends = tuple[float, float]
EACH, ATTRIBUTE, CATEGORY, ALL = "attribute and end", "attribute", "category", "all"


@dataclass(frozen=True)
class TargetError:
    """One mean absolute error: what it is of, the mean signed error, and over whom.

    `of` is 'attribute and end', 'attribute', 'category', 'all', or 'difference' between two categories. `error` is
    over participants of each participant's mean absolute error; `bias` the same of rating - target.
    """

    of: str
    attribute: str
    end: str
    target: float
    error: OneSample
    bias: OneSample


def target_errors(
    data: pd.DataFrame,
    *,
    target: str = "target",
    attribute_column: str = "stimulus.attribute",
    scale: Ends | None = None,
    target_scale: Ends | None = None,
    categories: Mapping[str, str] | None = None,
    subject: str = "participant",
    confidence: float = 0.95,
    levels: Levels = NO_LEVELS,
) -> tuple[TargetError, ...]:
    """Return |rating - target| on the attribute that each stimulus was made for (thesis 5.7.1.2).

    `data` is a table of ratings; only rows whose `attribute` is the one in `attribute_column` count. `scale` are the
    ends of the ratings' scale; targets on another scale are converted from `target_scale`. The errors of a participant
    are averaged: trials within an end, ends within an attribute, attributes within a category, attributes over all,
    each counting equally; a participant who lacks one of the parts has no average. `end` is 'min' and 'max' for an
    attribute's lowest and highest target. Intervals are Student's over participants. Raises DataRefused if no row is
    about its own attribute, and on a target that is no number or off the scale.
    """
    check_columns(data, ["value", "attribute", subject, attribute_column, target])
    refuse_idle_levels(levels, ("attribute",))
    attributes, targets = texts_of(data, "attribute"), texts_of(data, attribute_column)
    unknown = sorted(set(targets) - set(attributes))
    own = data[[a == w for a, w in zip(attributes, targets, strict=True)]].reset_index(drop=True)
    if not len(own):
        first = unknown[0] if unknown else ""
        raise DataRefused(
            f"no rating is on the attribute that column {attribute_column!r} names: {first!r} is not rated here;"
            f" {nearest(first, dict.fromkeys(attributes))}"
        )
    aims = _targets(own, target, scale, target_scale)
    values = numbers_of(own["value"], "value")
    errors = own.assign(end=_ends(own, aims), absolute=np.abs(values - aims), signed=values - aims)
    order = {**levels, "end": ("min", "between", "max", "only")}
    both = [
        person_cells(errors, ("attribute", "end"), dv=dv, subject=subject, levels=order)
        for dv in ("absolute", "signed")
    ]
    goal = dict(zip(zip(errors["attribute"], errors["end"], strict=True), aims.tolist(), strict=True))
    return tuple(_all(both, goal, categories or {}, confidence))


def _targets(own: pd.DataFrame, target: str, scale: Ends | None, target_scale: Ends | None) -> Floats:
    texts = texts_of(own, target)
    numbers = {}
    for text in set(texts):
        try:
            value = float(text)
        except ValueError:
            value = NAN
        if not math.isfinite(value):
            raise DataRefused(f"column {target!r} holds {text!r}; a target is a finite number")
        numbers[text] = value
    aims = np.array([numbers[text] for text in texts])
    if target_scale is not None:
        if scale is None:
            raise DataRefused("`target_scale` needs the ends of the ratings' own scale, and they have none")
        if not target_scale[0] < target_scale[1]:
            raise DataRefused(f"target_scale {target_scale}: the lower end comes first")
        aims = rescaled_values(aims, target_scale, scale)
    if scale is not None and (beyond := sorted({float(a) for a in aims if not scale[0] <= a <= scale[1]})):
        raise DataRefused(
            f"targets beyond the ratings' scale from {scale[0]:g} to {scale[1]:g}:"
            f" {listed((f'{a:g}' for a in beyond), len(beyond))}; give the scale that they are on as `target_scale`"
        )
    return aims


def _ends(own: pd.DataFrame, aims: Floats) -> list[str]:
    """Return which of an attribute's targets each is; targets between the ends are named by their number."""
    attributes = own["attribute"].tolist()
    targets: dict[str, set[float]] = {}
    for name, aim in zip(attributes, aims.tolist(), strict=True):
        targets.setdefault(name, set()).add(aim)
    ends = []
    for name, aim in zip(attributes, aims.tolist(), strict=True):
        low, high = min(targets[name]), max(targets[name])
        ends.append("only" if low == high else "min" if aim == low else "max" if aim == high else f"{aim:g}")
    return ends


def _all(
    both: Sequence[PersonCells], goal: Mapping[tuple[str, str], float], categories: Mapping[str, str], confidence: float
) -> Iterator[TargetError]:
    cells = both[0]
    attributes = list(dict.fromkeys(cell[0] for cell in cells.cells))

    def error(of: str, attribute: str, end: str, target: float, values: Sequence[Floats]) -> TargetError:
        absolute, signed = (
            one_sample(column, floor=cells.floor(), confidence=confidence, what="errors") for column in values
        )
        return TargetError(of, attribute, end, target, absolute, signed)

    for j, (attribute, end) in enumerate(cells.cells):
        yield error(EACH, attribute, end, goal[attribute, end], [errors.values[:, j] for errors in both])
    whole: dict[str, list[Floats]] = {}
    for name in attributes:
        at = [j for j, cell in enumerate(cells.cells) if cell[0] == name]
        rows_of = [errors.values[:, at].tolist() for errors in both]
        whole[name] = [np.array([math.fsum(row) / len(row) for row in rows]) for rows in rows_of]
    for name in attributes:
        yield error(ATTRIBUTE, name, "", NAN, whole[name])
    groups: dict[str, list[str]] = {}
    for name in attributes:
        groups.setdefault(categories.get(name, ""), []).append(name)
    means = {group: [_over(whole, names, k) for k in (0, 1)] for group, names in groups.items() if group}
    for group, values in means.items():
        yield error(CATEGORY, group, "", NAN, values)
    if len(means) == 2:
        (first, one), (second, two) = means.items()
        yield error("difference", f"{second} − {first}", "", NAN, [two[k] - one[k] for k in (0, 1)])
    yield error(ALL, "all attributes", "", NAN, [_over(whole, attributes, k) for k in (0, 1)])


def _over(whole: Mapping[str, Sequence[Floats]], names: Sequence[str], k: int) -> Floats:
    rows = np.column_stack([whole[name][k] for name in names]).tolist()
    return np.array([math.fsum(row) / len(row) for row in rows])
