"""Measuring: what was wrong, how long it took, and that a refusal, a crash and a nan each keep their own name."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from palpate.analysis.measuring.rows import MOST_RUNS, Measurement, as_json, measure, run_bench
from palpate.analysis.measuring.work_precision import error_text, print_table, ratio_to_ours, time_text
from palpate.analysis.measuring.work_precision_plot import save_plots
from palpate.protocols.bench import Case


class FakeClock:
    """A clock that only the measured code moves."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def case(run: Callable[[], Any], error: Callable[[Any], float | None] = lambda _: 0.0, **change: Any) -> Case:
    named = {"area": "sums", "case": "sum", "method": "palpate", "input": "3 numbers", "n": 3, "error_kind": "relative"}
    return Case(**{**named, "run": run, "error": error, **change})


def taking(clock: FakeClock, times: list[float]) -> tuple[Callable[[], int], list[int]]:
    """A run that takes the next of `times` each time, and the list of runs so far."""
    runs: list[int] = []

    def run() -> int:
        clock.now += times[min(len(runs), len(times) - 1)]
        runs.append(len(runs))
        return runs[-1]

    return run, runs


def test_the_time_is_the_median_after_a_warm_up_and_memory_has_a_run_of_its_own() -> None:
    clock = FakeClock()
    run, runs = taking(clock, [9.0, 1.0, 5.0, 2.0, 4.0, 3.0, 100.0])
    row = measure(case(run, repeats=5), clock)
    assert row.seconds == pytest.approx(3.0)
    assert row.runs == 5
    assert len(runs) == 7  # warm-up, five timed, one traced


def test_a_slow_case_runs_twice_and_its_shorter_time_counts() -> None:
    clock = FakeClock()
    run, runs = taking(clock, [30.0, 42.0])
    row = measure(case(run), clock)
    assert (row.seconds, row.runs, len(runs)) == (30.0, 1, 2)
    assert row.peak_MB is not None


def test_a_case_that_says_itself_how_long_it_took_is_run_once() -> None:
    clock = FakeClock()
    run, runs = taking(clock, [5.0])
    row = measure(case(run, lambda answer: 0.5 + answer, repeats=5, seconds=lambda answer: 1000.0 + answer), clock)
    assert (row.seconds, row.error, row.runs, row.peak_MB, len(runs)) == (1000.0, 0.5, 1, None, 1)


@pytest.mark.parametrize("seconds", [math.nan, math.inf, -1.0])
def test_a_time_that_is_none_is_a_failure_and_never_a_number(seconds: float) -> None:
    row = measure(case(lambda: 1, seconds=lambda _: seconds), FakeClock())
    assert (row.outcome, row.seconds) == ("failed", None)
    assert "a time of" in row.note


def test_a_fast_case_is_repeated_until_enough_time_was_seen() -> None:
    clock = FakeClock()
    run, _ = taking(clock, [1e-3])
    row = measure(case(run, repeats=5), clock)
    assert 20 <= row.runs <= 21
    run, _ = taking(clock, [1e-7])
    assert measure(case(run), clock).runs == MOST_RUNS


def test_the_peak_is_what_the_run_allocates() -> None:
    row = measure(case(lambda: len(bytearray(8_000_000))), FakeClock())
    assert row.peak_MB == pytest.approx(8.0, rel=0.05)


def test_the_error_is_of_the_measured_answer() -> None:
    row = measure(case(lambda: 1.5, lambda answer: abs(answer - 1.0)), FakeClock())
    assert (row.error, row.outcome, row.error_kind) == (0.5, "measured", "relative")


@pytest.mark.parametrize(
    ("error", "outcome"), [(None, "refused"), (math.nan, "no number"), (math.inf, "infinite"), (0.0, "measured")]
)
def test_every_way_of_not_answering_has_its_own_name(error: float | None, outcome: str) -> None:
    row = measure(case(lambda: None, lambda _: error), FakeClock())
    assert row.outcome == outcome
    assert row.error == (0.0 if outcome == "measured" else None)
    assert row.seconds is not None


def test_a_method_that_raises_is_a_row_and_does_not_end_the_bench() -> None:
    def broken() -> None:
        raise MemoryError("9 GB needed")

    lines: list[str] = []
    rows = run_bench({"sums": iter([case(broken, method="other"), case(lambda: 1)])}, lines.append)
    assert [row.outcome for row in rows] == ["failed", "measured"]
    assert rows[0].note == "MemoryError: 9 GB needed"
    assert (rows[0].error, rows[0].seconds, rows[0].peak_MB) == (None, None, None)
    assert lines == ["sums: sum, 3 numbers: other", "sums: sum, 3 numbers: palpate"]


def test_an_interrupt_ends_the_bench() -> None:
    def stopped() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        measure(case(stopped), FakeClock())


def row(
    method: str, seconds: float | None, error: float | None = 1e-15, outcome: str = "measured", **change: Any
) -> Measurement:
    base = Measurement("sums", "sum", method, "3 numbers", 3, "relative", error, outcome, seconds, 5, 0.25)
    return Measurement(**{**base.__dict__, **change})


def rows() -> Iterator[Measurement]:
    yield row("palpate", 2e-4)
    yield row("palpate, exact", 4e-3, 0.0)
    yield row("pingouin", 8e-3, None, "infinite")
    yield row("other [lib]", None, None, "failed", note="ValueError: [red]no[/red]")
    yield row("pingouin", 1.0, input="another input")
    yield row("palpate", 2.0, None, "refused", area="other area")


def test_the_ratio_is_to_our_first_method_on_the_same_input() -> None:
    ratios = [ratio_to_ours(row, list(rows())) for row in rows()]
    assert ratios == [1.0, pytest.approx(20.0), pytest.approx(40.0), None, None, 1.0]


def test_the_table_shows_error_and_time_side_by_side() -> None:
    console = Console(file=io.StringIO(), width=90)
    print_table(list(rows()), console)
    text = console.file.getvalue()  # type: ignore[attr-defined]
    line = next(line for line in text.splitlines() if "palpate, exact" in line)
    assert line.split()[2:] == ["0", "4", "ms", "20", "0.25"]
    assert "ValueError: [red]no[/red]" in text and "other [lib]" in text
    assert "nan" not in text


def test_json_is_stable_and_has_null_where_there_is_no_number() -> None:
    text = as_json(rows())
    assert text == as_json(rows())
    content = json.loads(text)
    assert content[2]["error"] is None and content[2]["outcome"] == "infinite"
    assert content[0]["seconds"] == 2e-4


def test_each_area_has_a_plot_that_is_equal_twice(tmp_path: Path) -> None:
    first = save_plots(list(rows()), tmp_path / "a")
    assert [p.name for p in first] == [
        "work_precision_sums.svg", "work_precision_sums.png",
        "work_precision_other_area.svg", "work_precision_other_area.png",
    ]  # fmt: skip
    second = save_plots(list(rows()), tmp_path / "b")
    assert [p.read_bytes() for p in first] == [p.read_bytes() for p in second]


def test_numbers_as_a_person_reads_them() -> None:
    assert [time_text(t) for t in (2.0, 0.0123, 4.5e-5, None)] == ["2 s", "12.3 ms", "45 µs", ""]
    assert [time_text(t) for t in (1000.0, 12345.6, 0.9999, 0.0)] == ["1000 s", "12346 s", "1000 ms", "0 µs"]
    assert error_text(row("palpate", 1.0, 2.34e-15)) == "2.3e-15"
    assert error_text(row("palpate", 1.0, None, "refused")) == "refused"
