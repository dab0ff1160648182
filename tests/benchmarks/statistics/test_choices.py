"""The declared figures of choices run, ours stay within their bounds, and a step is refused."""

from __future__ import annotations

import math

import pytest

from benchmarks.statistics.choices import cases
from palpate.protocols.bench import Case

CASES = list(cases(quick=True))
OURS = [case for case in CASES if case.method == "palpate"]


@pytest.mark.parametrize("case", OURS, ids=lambda case: f"{case.case}: {case.input}")
def test_ours_is_right_or_refuses(case: Case) -> None:
    error = case.error(case.run())
    if "step" in case.case:
        assert error is None
    else:
        assert error is not None
        assert error < 1e-8


def test_statsmodels_gives_a_slope_where_there_is_none() -> None:
    (other,) = [case for case in CASES if "step" in case.case and case.method != "palpate"]
    assert other.error(other.run()) == math.inf


def test_the_intervals_agree() -> None:
    for case in CASES:
        if case.case.startswith("interval"):
            assert (case.error(case.run()) or 0) < 0.1
