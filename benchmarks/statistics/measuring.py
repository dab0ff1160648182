"""Comparison of several methods on the same data: their errors against the right answer, with warnings suppressed."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib.util import find_spec
from typing import Any, TypeAlias, TypeVar

import numpy as np

from palpate.analysis.statistics.doubles import Floats
from palpate.protocols.bench import Case

AREA = "statistics"
Way: TypeAlias = tuple[str, str, Callable[[Any], Any]]
"""A method's name, the package it needs, and a function of the data that returns its numbers; None for a refusal."""
Key = TypeVar("Key")


def comparison(
    title: str, name: str, n: int, ways: Iterable[Way], data: Any, error: Callable[[Any], float | None], error_kind: str
) -> Iterator[Case]:
    """Yield a case for every method whose package is installed, all on the same data; a refusal has no error."""

    def error_or_refusal(numbers: Any) -> float | None:
        return None if numbers is None else error(numbers)

    for method, package, run in ways:
        if find_spec(package) is not None:
            yield Case(AREA, title, method, name, n, error_kind, quietly(run, data), error_or_refusal)


def worst_relative_error(numbers: Mapping[Key, float], expected: Mapping[Key, float]) -> float | None:
    """Return the largest relative error over the keys that both have; NaN if one is NaN, None if they share no key."""
    errors = [abs(numbers[key] - right) / (abs(right) or 1.0) for key, right in expected.items() if key in numbers]
    if not errors:
        return None
    return math.nan if any(map(math.isnan, errors)) else max(errors)


def relative_error(right: Floats) -> Callable[[Floats], float]:
    """Return a function for the largest relative error of an array of numbers against the right ones."""

    def error(numbers: Floats) -> float:
        return float(np.max(np.abs(numbers - right) / np.abs(right)))

    return error


def quietly(run: Callable[[Any], Any], data: Any) -> Callable[[], Any]:
    """Return a run on the data with warnings suppressed: what a method warns of is measured as its error."""

    def silent() -> Any:
        with warnings.catch_warnings(record=True):
            warnings.simplefilter("always")
            return run(data)

    return silent
