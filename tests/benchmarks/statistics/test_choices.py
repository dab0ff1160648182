"""The declared figures of choices run, ours stay within their bounds, and a step is refused."""

from __future__ import annotations

import math

import pytest

from benchmarks.statistics.choices import cases
from palpate.protocols.bench import Case


@pytest.fixture(scope="module")
def every_case() -> list[Case]:
    """Made when the first test asks: some are fitted."""
    return list(cases(quick=True))


def test_ours_is_right_or_refuses(every_case: list[Case]) -> None:
    ours = [case for case in every_case if case.method == "palpate"]
    errors = {(case.case, case.input): case.error(case.run()) for case in ours}
    assert len(errors) == len(ours)
    steps = {error for (name, _), error in errors.items() if "step" in name}
    others = {key: error for key, error in errors.items() if "step" not in key[0]}
    assert steps == {None}
    assert {key: error for key, error in others.items() if error is None or not error < 1e-8} == {}


def test_statsmodels_gives_a_slope_where_there_is_none(every_case: list[Case]) -> None:
    (other,) = [case for case in every_case if "step" in case.case and case.method != "palpate"]
    assert other.error(other.run()) == math.inf


def test_the_intervals_agree(every_case: list[Case]) -> None:
    for case in every_case:
        if case.case.startswith("interval"):
            assert (case.error(case.run()) or 0) < 0.1
