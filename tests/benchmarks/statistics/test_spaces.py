"""The declared figures of the spaces run, and ours stay within their bounds."""

from __future__ import annotations

import pytest

from benchmarks.statistics.spaces import cases
from palpate.protocols.bench import Case

OURS = [case for case in cases(quick=True) if case.method.startswith("palpate")]


@pytest.mark.parametrize("case", OURS, ids=lambda case: f"{case.case}: {case.input}")
def test_ours_is_right(case: Case) -> None:
    error = case.error(case.run())
    assert error is not None
    # An offset of 1e9 costs coordinates with decimals 7 of their 16 digits before anyone computes.
    assert error < (1e-11 if "offset" in case.input else 1e-12)


def test_each_figure_has_another_implementation_beside_ours() -> None:
    result = {(case.case, case.input) for case in cases(quick=True) if not case.method.startswith("palpate")}
    assert {(case.case, case.input) for case in OURS} == result
