"""Measurement of the statistics' cases: errors against a right answer, warnings kept silent."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.analysis.statistics.doubles import Floats


def relative_error(right: Floats) -> Callable[[Floats], float]:
    """Return what measures an answer against the right one: the largest relative error of its numbers."""

    def error(found: Floats) -> float:
        return float(np.max(np.abs(found - right) / np.abs(right)))

    return error


def quietly(run: Callable[[Any], Any], given: Any) -> Callable[[], Any]:
    """Return the run of what is given, its warnings kept silent: what others warn of is measured as an error."""

    def silent() -> Any:
        with warnings.catch_warnings(record=True):
            warnings.simplefilter("always")
            return run(given)

    return silent
