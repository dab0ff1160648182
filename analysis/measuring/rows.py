"""Measurement of error and run time of declared cases, each in one run on one input."""

from __future__ import annotations

import gc
import math
import statistics
import time
import tracemalloc
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from palpate.protocols.bench import Case
from palpate.protocols.canonical import json_text
from palpate.protocols.progress import Clock

MEASURED, REFUSED, FAILED, NO_NUMBER, UNBOUNDED = "measured", "refused", "failed", "no number", "infinite"
SLOW_S = 20.0
"""Seconds above which a case is run only twice, since five more repeats would tell little and take minutes."""
ENOUGH_S, MOST_RUNS = 0.02, 200
"""Seconds to repeat a fast case for, and the most repeats, so that a median of microseconds is meaningful."""


@dataclass(frozen=True)
class Measurement:
    """The measurement of a case; `error` is a number if `outcome` is `measured`, else None and `note` says why.

    `seconds` is the median of `runs` timed runs after a warm-up, or the time that the case itself reports of its one
    run; it is None if the method failed. `peak_MB` (10^6 bytes) is the peak allocation of Python and NumPy in one more
    run, None without such a run.
    """

    area: str
    case: str
    method: str
    input: str
    n: int
    error_kind: str
    error: float | None
    outcome: str
    seconds: float | None
    runs: int
    peak_MB: float | None
    note: str = ""


def measure(case: Case, clock: Clock = time.perf_counter) -> Measurement:
    """Measure a case: warm up, time, trace the memory in a separate run, and compute the error of the answer.

    A case that takes longer than `SLOW_S` is run only once more, with traced memory, and the shorter of its two times
    counts. A case that reports its own time is run once. A method that raises gets a row named `failed` and does not
    end the bench.
    """
    gc.collect()
    try:
        return _measure(case, clock)
    except Exception as problem:
        return _row(case, _Timed(None, FAILED, None, 0, None, f"{type(problem).__name__}: {problem}"))


def run_bench(
    areas_cases: Mapping[str, Iterable[Case]], progress: Callable[[str], None] = lambda _: None
) -> list[Measurement]:
    """Measure every case of every area in order; `progress` is called with what comes next."""
    rows = []
    for area, cases in areas_cases.items():
        for case in cases:
            progress(f"{area}: {case.case}, {case.input}: {case.method}")
            rows.append(measure(case))
    return rows


def as_json(rows: Iterable[Measurement]) -> str:
    """Return the rows as a JSON list with sorted keys; undefined numbers are null, explained by `outcome`."""
    return json_text([asdict(row) for row in rows], indent=1, sort_keys=True)


def _measure(case: Case, clock: Clock) -> Measurement:
    if case.seconds is not None:
        # A case that says itself how long its one run took.
        answer = case.run()
        error, outcome = _classify_error(case.error(answer))
        peak_MB = None if case.peak_MB is None else case.peak_MB(answer)
        seconds = case.seconds(answer)
        if not (math.isfinite(seconds) and seconds >= 0):
            raise ValueError(f"a time of {seconds} s; a number of at least 0 is expected")
        return _row(case, _Timed(error, outcome, float(seconds), 1, peak_MB))
    answer, warm_up_s = _time_call(case.run, clock)
    if warm_up_s > SLOW_S:
        (answer, traced_s), peak_MB = _trace_memory(lambda: _time_call(case.run, clock))
        times = [min(warm_up_s, traced_s)]
    else:
        times = []
        while len(times) < max(1, case.repeats) or (sum(times) < ENOUGH_S and len(times) < MOST_RUNS):
            answer, run_s = _time_call(case.run, clock)
            times.append(run_s)
        _, peak_MB = _trace_memory(case.run)
    error, outcome = _classify_error(case.error(answer))
    measurement = _Timed(error, outcome, statistics.median(times), len(times), peak_MB)
    return _row(case, measurement)


@dataclass(frozen=True)
class _Timed:
    """The measured times and memory of a case."""

    error: float | None
    outcome: str
    seconds: float | None
    runs: int
    peak_MB: float | None
    note: str = ""


def _row(case: Case, measurement: _Timed) -> Measurement:
    named = (case.area, case.case, case.method, case.input, case.n, case.error_kind)
    return Measurement(*named, **asdict(measurement))


def _time_call(run: Callable[[], Any], clock: Clock) -> tuple[Any, float]:
    start = clock()
    answer = run()
    return answer, clock() - start


def _trace_memory(run: Callable[[], Any]) -> tuple[Any, float]:
    tracemalloc.start()
    try:
        answer = run()
        return answer, tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()


def _classify_error(error: float | None) -> tuple[float | None, str]:
    """Return the error and the outcome; nan and infinity have outcomes of their own."""
    if error is None:
        return None, REFUSED
    if math.isnan(error):
        return None, NO_NUMBER
    return (None, UNBOUNDED) if math.isinf(error) else (abs(float(error)), MEASURED)
