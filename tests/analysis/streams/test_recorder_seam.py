"""What the recorder of streams puts on record is what the analysis reads: samples, gaps, clock, calibration."""

from __future__ import annotations

import random
import threading
from dataclasses import dataclass, field

import numpy as np
import pytest

from analysis.streams.reading import streams_of
from devices.signals import Block, Signal
from devices.streams.recording import Recording
from protocols.events import NS
from tests.analysis.streams.ledgers import Written

RATE_HZ, TRUE_HZ, BLOCK, COUNT = 1000.0, 1000.08, 10, 20_000
SIGNAL = Signal("wrench", ("fx", "fz"), ("N", "N"), RATE_HZ, "daq", "FT123 of 2026-01-05")


def blocks():
    """Twenty seconds that drift by 80 ppm and arrive late by chance; 30 samples are overrun in the middle."""
    rng, came = random.Random(8), 0
    for first in range(0, COUNT, BLOCK):
        if 10_000 <= first < 10_030:
            continue
        rows = np.arange(first, first + BLOCK)
        came = max(came, round((3 + (first + BLOCK - 1) / TRUE_HZ + rng.expovariate(2000)) * NS))
        data = np.column_stack([rows, -rows]).astype("<f4").tobytes()
        lost, why = (30, "overrun") if first == 10_030 else (0, "")
        yield Block(first, data, came, None, lost, why)


@dataclass
class Scripted:
    """A sensor that gives all its blocks at once, then nothing; `given` tells that they are taken."""

    name: str = "force"
    signals: tuple[Signal, ...] = (SIGNAL,)
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
        found = list(blocks())
        self.given.set()
        return {"wrench": found}

    def stop(self):
        self.stopped.set()


def test_a_recording_reads_back_as_it_was_sampled(tmp_path):
    sensor = Scripted()
    recording = Recording({"tool": sensor}, now_ns=lambda: 0, room_s=60.0)
    written = Written(tmp_path / "s.sqlite")
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
    [stream] = streams_of(written.record(), 1)
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
    assert clock.drift_ppm == pytest.approx(summary[stream.name]["drift_ppm"], abs=3)
