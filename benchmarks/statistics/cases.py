"""Figures of the statistics: each method's error beside its time, on ordinary and on extreme tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from benchmarks.statistics import choices, mixed_models, ordinal, regenerating, reliability, sensitivity, spaces
from benchmarks.statistics.families import family_cases
from benchmarks.statistics.inputs import (
    Answer,
    Input,
    big_inputs,
    edge_inputs,
    label_inputs,
    nist_inputs,
    reference_inputs,
    wide_input,
)
from benchmarks.statistics.methods import BETWEEN, EXACT, ORDINARY, REPORTED, Method, Numbers
from palpate.protocols.bench import Case

AREA = "statistics"
PARTS = (mixed_models, ordinal, reliability, spaces, choices, sensitivity, regenerating)
"""Modules with further cases of this area."""
WORST = "relative, worst of F, p, epsilon, eta squared"


def cases(quick: bool) -> Iterator[Case]:
    """Yield every figure of this area; without `quick` also the largest table."""
    yield from _cases("ANOVA against R", reference_inputs(), (*ORDINARY, EXACT), f"{WORST}; against R")
    yield from _cases(
        "ANOVA, extreme tables", edge_inputs(), ORDINARY, "relative, worst of F and epsilon; exact answer"
    )
    yield from _cases("p to report", [wide_input()], REPORTED, "relative; exact Greenhouse-Geisser p")
    yield from _cases("one-way ANOVA, NIST sets", nist_inputs(), BETWEEN, "relative, F; exact F of the doubles")
    # AnovaRM makes a matrix of all values by all values: 16 GB at 500 x 90.
    large = [method for method in ORDINARY if not method.name.startswith("statsmodels")]
    yield from _cases("ANOVA, large tables", big_inputs(quick), large, f"{WORST}; against extended precision")
    title = "ANOVA, types of labels"
    yield from _cases(title, label_inputs(quick), large, f"{WORST}; against extended precision")
    yield from family_cases(quick)
    for part in PARTS:
        yield from part.cases(quick)


def _cases(title: str, inputs: Iterable[Input], methods: Iterable[Method], error_kind: str) -> Iterator[Case]:
    usable = [method for method in methods if method.installed]
    for table in inputs:
        for method in usable:
            yield Case(AREA, title, method.name, table.name, len(table.table), error_kind, *_bound(method, table))


def _bound(method: Method, table: Input) -> tuple[Callable[[], Any], Callable[[Any], float | None]]:
    return (lambda: method.run(table)), (lambda result: worst_error(method.read(result), table.answer()))


def worst_error(numbers: Numbers, answer: Answer) -> float | None:
    """Return the largest relative error over the numbers that both give; None for a refusal (no numbers at all).

    Infinite where a method gives a number for something that has none; NaN where it gives NaN for something that has
    a number, or none of the numbers at all. A number that a method does not report is not counted against it.
    """
    if not numbers:
        return None
    errors = [_error(numbers[key], expected) for key, expected in answer.items() if key in numbers]
    return math.nan if not errors or any(map(math.isnan, errors)) else max(errors)


def _error(number: float, expected: float | None) -> float:
    if expected is None:
        return math.nan if math.isnan(number) else math.inf
    return abs(number - expected) / (abs(expected) or 1.0)
