"""Figures to reach for streams: nothing lost, constant memory, readers not held up by the writer; a clock's rate."""

from __future__ import annotations

import json
import math
import random
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from palpate.devices.streams.drift import ClockFit
from palpate.protocols.bench import Case
from palpate.protocols.clocks import fit_clock
from palpate.protocols.events import NS

STREAM_S, STREAM_QUICK_S = 600.0, 20.0
DELAY_S, DELAY_QUICK_S = 240.0, 20.0
FAST = 20.0
"""The factor by which streams run faster than real sensors: rates, bytes and blocks a second are multiplied by it."""
PPM, BLOCKS_HZ, CLOCKS = 50.0, 100.0, 20
Arrivals = list[tuple[int, float]]


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of streams through a real session and ledger, each in its own process; then of clocks."""
    whole, part = (STREAM_QUICK_S, DELAY_QUICK_S) if quick else (STREAM_S, DELAY_S)
    yield _recorded("to the disk", "palpate", whole, "samples lost", _lost)
    yield _recorded("memory above start", "palpate", whole, "MB", lambda recorded: _known(recorded["growth_MB"]))
    for writer in ("one thread", "palpate"):
        yield _recorded("readers held up by the writer", writer, part, "ms, p99.9", _p999("held_up_ms"))
    yield _recorded("handing a block over", "palpate", part, "ms, p99.9", _p999("handed_ms"))
    for writer in ("none", "palpate"):
        yield _recorded("readers late for any reason", writer, part, "ms, p99.9", _p999("late_ms"))
    yield from _clocks(10.0 if quick else 60.0)


def _recorded(
    case: str, writer: str, stream_s: float, kind: str, error: Callable[[dict[str, Any]], float | None]
) -> Case:
    """Return the case of a recording, with its `error` computed while its ledger exists."""
    writers = {"none": "readers alone, nothing written", "one thread": "one thread reads and writes"}
    input_name = f"17 channels, {stream_s:g} s at {FAST:g} times their pace, {_priority()}"
    return Case("streams", case, writers.get(writer, writer), input_name, round(stream_s * 14_120), kind,
                lambda: run_apart(stream_s, FAST, writer), error, 1)  # fmt: skip


def run_apart(stream_s: float, fast: float, writer: str) -> dict[str, Any]:
    """Record in a process of its own; return its results with `in_place`: how many samples of each stream are right."""
    with TemporaryDirectory() as lab:
        command = [sys.executable, "-m", "benchmarks.streams.run", lab, str(stream_s), str(fast), writer]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        recorded: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
        return {**recorded, "in_place": samples_in_place(Path(recorded["ledger"]))}


def samples_in_place(ledger: Path) -> dict[str, int]:
    """Return how many samples of each stream are in the verified ledger, in their place and with their value."""
    import numpy as np

    from benchmarks.streams.recordings import RAMP
    from palpate.studies.sessions.record import read

    right: dict[str, int] = {}
    for event in read(ledger).events:
        for block in event.samples:
            rows = np.frombuffer(block.data, "<f4").reshape(-1, len(block.channels))
            numbers = (block.first + np.arange(block.count)) % RAMP
            name = block.stream.removesuffix("_samples")
            right[name] = right.get(name, 0) + int((rows == numbers[:, None]).all(axis=1).sum())
    return right


def _lost(recorded: dict[str, Any]) -> float:
    return float(sum(abs(count - recorded["in_place"].get(name, 0)) for name, count in recorded["produced"].items()))


def _known(growth_MB: float) -> float | None:
    """Return the growth; None where the process cannot read its memory."""
    return growth_MB or None


def _p999(what: str) -> Callable[[dict[str, Any]], float]:
    return lambda recorded: float(recorded[what]["p99.9"])


def _priority() -> str:
    """Describe the scheduling of the recording process, as tried in a thread that then ends."""
    from benchmarks.streams.run import in_real_time

    allowed: list[bool] = []
    trial = threading.Thread(target=lambda: allowed.append(in_real_time()))
    trial.start()
    trial.join()
    return "real-time priority" if allowed[0] else "ordinary priority"


def _clocks(seconds: float) -> Iterator[Case]:
    """Yield the cases of a device's rate from its blocks' arrivals, by four methods; the error is the RMS over many."""
    laws: dict[str, Callable[[random.Random], float]] = {
        "exponential": lambda chance: chance.expovariate(500.0),
        "lognormal": lambda chance: 0.002 * chance.lognormvariate(0.0, 1.0),
    }
    methods: dict[str, Callable[[Arrivals], float]] = {
        "first and last arrival": _ends,
        "least squares": _least_squares,
        "under all arrivals, afterwards": lambda arrivals: fit_clock(arrivals, 100 * BLOCKS_HZ).drift_ppm,
        "earliest arrivals, on-line": _on_line,
    }
    for law, delay in laws.items():
        recorded = [_arrivals(seconds, delay, seed) for seed in range(CLOCKS)]
        input_name = f"{CLOCKS} x {seconds:g} s, {law} delays"
        for name, method in methods.items():
            count, all_of = sum(map(len, recorded)), partial(_all_rates_ppm, method, recorded)
            yield Case("streams", "a device's clock", name, input_name, count, "ppm, RMS", all_of, _rms, 3)


def _all_rates_ppm(method: Callable[[Arrivals], float], recorded: Sequence[Arrivals]) -> list[float]:
    return [method(arrivals) for arrivals in recorded]


def _arrivals(seconds: float, delay: Callable[[random.Random], float], seed: int) -> Arrivals:
    """Return (number of a block's last sample, arrival): blocks of 100 samples are late, and none overtakes another."""
    chance, arrivals, last_s = random.Random(seed), [], 0.0
    for block in range(1, round(seconds * BLOCKS_HZ) + 1):
        last_s = max(last_s, block / BLOCKS_HZ / (1 + PPM * 1e-6) + delay(chance))
        arrivals.append((100 * block - 1, last_s))
    return arrivals


def _ends(arrivals: Arrivals) -> float:
    (n0, t0), (n1, t1) = arrivals[0], arrivals[-1]
    return ((n1 - n0) / (t1 - t0) / (100 * BLOCKS_HZ) - 1) * 1e6


def _least_squares(arrivals: Arrivals) -> float:
    n0 = math.fsum(n for n, _ in arrivals) / len(arrivals)
    t0 = math.fsum(t for _, t in arrivals) / len(arrivals)
    slope = math.fsum((n - n0) * (t - t0) for n, t in arrivals) / math.fsum((n - n0) ** 2 for n, _ in arrivals)
    return (1 / slope / (100 * BLOCKS_HZ) - 1) * 1e6


def _on_line(arrivals: Arrivals) -> float:
    clock = ClockFit()
    for n, t_s in arrivals:
        clock.add(n / (100 * BLOCKS_HZ), round(t_s * NS))
    fit = clock.fit()
    return math.nan if fit is None else fit.ppm


def _rms(rates_ppm: Sequence[float]) -> float:
    return math.sqrt(math.fsum((rate_ppm - PPM) ** 2 for rate_ppm in rates_ppm) / len(rates_ppm))
