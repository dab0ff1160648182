"""The figures of the ordinal statistics: ours are right on every input, and others' failures are measured as such."""

from __future__ import annotations

import math

from benchmarks.statistics.ordinal import cases


def test_ours_is_right_on_every_input():
    ours = [case for case in cases(quick=True) if case.method == "palpate"]
    errors = {(case.case, case.input): case.error(case.run()) for case in ours}
    assert errors.pop(("ordinal model", "separated answers")) is None
    assert all(error is not None and error <= 1e-12 for error in errors.values()), errors
    assert len(errors) >= 12


def test_others_are_measured_on_the_same_inputs():
    blurred = [case for case in cases(quick=True) if case.input.startswith("0.1 + 0.2") and case.method != "palpate"]
    assert all(case.error(case.run()) > 0.1 for case in blurred)
    separated = [case for case in cases(quick=True) if case.input == "separated answers" and case.method != "palpate"]
    assert all(case.error(case.run()) == math.inf for case in separated)


def test_a_large_table_is_measured_unless_quick():
    assert {case.input for case in cases(False)} - {case.input for case in cases(True)} == {"5000 x 90, 0 to 100"}
