"""The bench of runtimes: every one takes its turn, and what is counted as the limit is what the program does."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.synthesis import specimens
from benchmarks.synthesis import steps as bench_steps
from benchmarks.synthesis.rates import Rates, Work, rates, work_of
from benchmarks.synthesis.steps import Measured, cases, time_by_turns
from palpate.signals.models.fastest import fastest
from palpate.signals.models.native.library import library
from palpate.signals.models.native.opened import Native


class Ticks:
    """A clock that moves on by one second whenever it is looked at."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        self.now += 1.0
        return self.now


def test_runtimes_take_turns_in_blocks_on_the_same_windows():
    order, given = [], np.arange(6.0)[:, None]
    runtimes = {name: lambda row, name=name: order.append((name, row[0])) for name in ("a", "b")}
    answers = time_by_turns(runtimes, given, 500, Ticks())
    assert {name: values.tolist() for name, values in answers.items()} == {"a": [1.0] * 500, "b": [1.0] * 500}
    windows = {name: [window for who, window in order[500:] if who == name] for name in runtimes}
    assert windows["a"] == windows["b"] and len(windows["a"]) == 500
    names = [name for name, _ in order[500:]]
    assert names == ["a"] * 250 + ["b"] * 250 + ["a"] * 250 + ["b"] * 250


def test_every_runtime_has_a_row_with_its_error_and_the_missing_ones_are_named(monkeypatch):
    monkeypatch.setattr(bench_steps, "QUICK_STEPS", 4)
    monkeypatch.setattr(bench_steps, "WINDOWS", 3)

    def others(card, tensors):
        return {"off by one": lambda row: np.array([1.0 + row[0]])}, ("LiteRT float32",)

    listed = list(cases(True, others))
    rows = {(case.case, case.method): case for case in listed}
    assert all("LiteRT float32" in case.input for case in listed if case.input.startswith("FoTEN"))
    for share in ("one step, median", "one step, 99th percentile"):
        assert {"palpate, NumPy", "NumPy, float64 (the reference)", "off by one"} <= {m for c, m in rows if c == share}
        ours = rows[share, "palpate, NumPy"]
        assert ours.error(ours.run()) <= 1e-6
        wrong = rows[share, "off by one"]
        assert wrong.error(wrong.run()) > 0.1
        assert ours.seconds(0.0) > 0


def test_an_error_is_in_sds_of_the_acceleration():
    model = specimens.foten()
    given = specimens.windows(4)
    shifted = {"x": lambda row: model.run(row) + 2.0}
    assert Measured(model, shifted, given, 4.0, 1).error("x") == pytest.approx(0.5, rel=1e-4)


@pytest.mark.needs("compiler")
def test_the_work_of_a_step_is_counted_after_what_was_saved():
    """Thesis 4.4 at a window of 20: 2 713 728 products, less those of the first attention's embedded signal."""
    native = fastest(specimens.foten())
    assert isinstance(native, Native)
    work = work_of(native)
    dense = 1340 * 256 + 256 * 64 + 64
    layer = 20 * 64 * (3 * 64 + 64 + 2 * 128) + 2 * 20 * 20 * 64
    spectral = 20 * 16 * (3 * 16 + 16 + 2 * 128) + 2 * 20 * 20 * 16 + 2 * 20 * 16
    whole = dense + 3 * layer + 2 * spectral + 20 * 64 + 2 * 40 * 20
    saved = 20 * 63 * 3 * 64 + 2 * 20 * 15 * 3 * 16
    assert work.flop == 2 * (whole - saved)
    assert 4 * 471_235 * 0.95 < work.bytes < 4 * 471_235 * 1.05


@pytest.mark.needs("compiler")
def test_the_limit_is_what_the_rates_make_of_the_work():
    assert Rates(2e9, 4e9).seconds(Work(2000, 8000)) == (1e-6, 2e-6)
    kernel = library()
    for instructions in kernel.sets:
        by_runtime = rates(kernel, instructions, 4096, Ticks())
        assert by_runtime.flop_s == 2 * 20_000 * {16: 320, 8: 80, 4: 40}[instructions.lanes]
        assert by_runtime.bytes_s == 20 * 4096
