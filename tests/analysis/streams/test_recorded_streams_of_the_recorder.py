"""What the recorder of streams puts on record is what the analysis reads: samples, gaps, clock, calibration."""

from __future__ import annotations

import random
import threading
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from palpate.analysis.streams.recorded_streams import streams_of
from palpate.devices.device import Block, Signal
from palpate.devices.streams.recording import Recording
from palpate.protocols.events import NS
from tests.analysis.streams.ledgers import Written

RATE_HZ, TRUE_HZ, BLOCK, COUNT = 1000.0, 1000.08, 10, 20_000
SIGNAL = Signal("wrench", ("fx", "fz"), ("N", "N"), RATE_HZ, "daq", "FT123 of 2026-01-05")


def blocks():
    """Twenty seconds that drift by 80 ppm and arrive late by chance; 30 samples are overrun in the middle."""
    rng, arrived_ns = random.Random(8), 0
    for first in range(0, COUNT, BLOCK):
        if 10_000 <= first < 10_030:
            continue
        rows = np.arange(first, first + BLOCK)
        arrived_ns = max(arrived_ns, round((3 + (first + BLOCK - 1) / TRUE_HZ + rng.expovariate(2000)) * NS))
        data = np.column_stack([rows, -rows]).astype("<f4").tobytes()
        lost, why = (30, "overrun") if first == 10_030 else (0, "")
        yield Block(first, data, arrived_ns, None, lost, why)


def taken_s(block):
    """When its last sample was taken."""
    return 3 + (block.first + BLOCK - 1) / TRUE_HZ


@dataclass
class Scripted:
    """A sensor that gives all its blocks at once, then nothing; `given` tells that they are taken."""

    name: str = "force"
    signals: tuple[Signal, ...] = (SIGNAL,)
    stamped: bool = False
    given: threading.Event = field(default_factory=threading.Event)
    stopped: threading.Event = field(default_factory=threading.Event)

    def expect(self, scene):
        pass

    def start(self, now_ns):
        pass

    def read(self, timeout_s):
        if self.given.is_set():
            self.stopped.wait(timeout_s)
            return {}
        taken = [replace(block, device_s=taken_s(block) if self.stamped else None) for block in blocks()]
        self.given.set()
        return {"wrench": taken}

    def stop(self):
        self.stopped.set()


def recorded(path, sensor):
    """The ledger of a recording, and what its reply says."""
    recording = Recording({"tool": sensor}, now_ns=lambda: 0, room_s=60.0)
    written = Written(path)
    written.begin(1)
    recording.start()
    assert sensor.given.wait(10)
    summary = recording.stop()
    assert recording.fault() is None
    while recording.due():
        chunk = recording.take()
        written.note("samples", chunk.value, chunk.samples)
    written.note("reply", {"recorded": True, "seconds": 20.0, "streams": summary})
    written.end()
    return written.record(), summary


def test_a_recording_reads_back_as_it_was_sampled(tmp_path):
    ledger, summary = recorded(tmp_path / "s.sqlite", Scripted())
    [stream] = streams_of(ledger, 1)
    values = stream.values()
    assert (values[:, 0] == stream.numbers()).all() and (values[:, 1] == -stream.numbers()).all()
    assert stream.count == COUNT - 30
    assert [(gap.first, gap.lost, gap.why) for gap in stream.gaps] == [(10_000, 30, "overrun")]
    assert (stream.channels, stream.units, stream.clock, stream.calibration) == (
        ("fx", "fz"), ("N", "N"), "daq", "FT123 of 2026-01-05",
    )  # fmt: skip
    clock = stream.timing
    assert clock.drift_ppm == pytest.approx(80, abs=4 * clock.drift_error_ppm)
    assert clock.time_s(0) == pytest.approx(3, abs=5e-5)
    assert clock.drift_ppm == pytest.approx(summary[stream.name]["drift_ppm"], abs=0.2)
    assert stream.stamps is None


def test_stamps_of_the_hosts_clock_are_read_back_and_tell_how_late_samples_came(tmp_path):
    """Arrivals are late by 0.5 ms on average and by nothing at the least."""
    ledger, summary = recorded(tmp_path / "s.sqlite", Scripted(signals=(replace(SIGNAL, clock="lsl"),), stamped=True))
    [stream] = streams_of(ledger, 1)
    assert len(stream.stamped) == len(stream.arrived)
    assert stream.stamps.problem is None and stream.stamps.scatter_s < 1e-6
    assert stream.stamps.late_s == pytest.approx(0, abs=2e-5) and 0 < stream.stamps.late_median_s < 5e-4
    timed = replace(stream, by_stamps=True).timing
    assert timed.drift_ppm == pytest.approx(80, abs=1e-3) and timed.time_s(0) == pytest.approx(3, abs=1e-7)
    assert abs(summary[stream.name]["device_ppm"]) < 4 * summary[stream.name]["device_se_ppm"]
