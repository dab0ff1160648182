"""Every figure that the bench declares for us is reached, and extreme tables are among them."""

from __future__ import annotations

from benchmarks.statistics.reliability import cases


def test_ours_reaches_every_answer_of_the_quick_bench() -> None:
    errors = {(case.case, case.input): case.error(case.run()) for case in cases(True) if case.method[:7] == "palpate"}
    assert ("ICC, extreme and large tables", "raters 1e9 apart") in errors
    assert len(errors) >= 25
    assert max(error for error in errors.values() if error is not None) < 1e-12
    assert None not in errors.values()
