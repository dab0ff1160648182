"""The declared figures run, and their errors are what their methods promise."""

from __future__ import annotations

from benchmarks.sensors import cases


def test_blocks_in_float32_are_as_right_as_float32_and_plain_python_is_exact() -> None:
    errors = {(case.case, case.method, case.input): case.error(case.run()) for case in cases(quick=True)}
    assert len(errors) == 6
    for (_, method, _), error in errors.items():
        limit = {"checked, in blocks, float32": 1e-6, "plain Python": 1e-12, "noise and 16 bits": 1e-3}[method]
        assert error < limit
