"""A process that records synthetic sensors into a real ledger, and prints the results as JSON.

python -m benchmarks.streams.run LEDGER STREAM_SECONDS TIMES_AS_FAST WRITER
"""

from __future__ import annotations

import json
import os
import sys
import time
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.streams.recordings import KINDS, SyntheticSensor
from palpate.devices.desk import Desk, Pages, Prompt
from palpate.devices.device import Block, NowNs, Records
from palpate.devices.streams.capture import Capture
from palpate.devices.streams.recording import CHUNK_S, ROOM_S, Recording
from palpate.protocols.events import NS, Aside, Chunk, Event, Present, Reply, Samples, Sense, WorldEvent
from palpate.protocols.plan import Plan, compile_plan
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.console.headless import Windowless
from palpate.studies.live.world import LiveWorld, Station, clock_from
from palpate.studies.sessions.rig import Rig, RigPlan
from palpate.studies.sessions.session import start

TURN_S = 0.01
"""The interval at which the writer checks for samples, as a window does at every frame."""


@dataclass
class Nobody:
    """A desk without an experimenter; each poll notes the memory in use."""

    memory_MB: list[float] = field(default_factory=list)

    def poll(self) -> Aside | None:
        """Return None: the experimenter does nothing."""
        self.memory_MB.append(memory_MB())
        return None

    def demand(self, prompt: Prompt | None) -> None:
        """Do nothing: there is no experimenter."""

    def answer(self) -> bool:
        """Return True at once."""
        return True

    def tell(self, state: Mapping[str, Any]) -> None:
        """Do nothing: there is no experimenter."""


def memory_MB() -> float:
    """Return this process' memory now, in MB (Linux; elsewhere 0, which means unknown)."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@dataclass
class Watching(Windowless):
    """A presenter without a window that notes when the writer begins and, by `kept`, when it is done."""

    busy_ns: list[tuple[int, int]] = field(default_factory=list)
    writing_from_ns: int = 0
    now_ns: NowNs = time.perf_counter_ns

    def wait_for(self, key: str, desk: Desk, ready: Callable[[], bool]) -> Aside | None:
        """Wait as without measuring; then note when the main thread begins to take and write samples."""
        aside = super().wait_for(key, desk, ready)
        self.writing_from_ns = self.now_ns()
        return aside

    def kept(self, event: Event) -> None:
        """Note that the samples of an event are on the disk."""
        if event.samples:
            self.busy_ns.append((self.writing_from_ns, self.now_ns()))


@dataclass(frozen=True)
class HandedOver:
    """A stimulus that is in place at once."""

    def perform(self, _request: Present, _window: Pages, _desk: Desk, _now_ns: NowNs) -> WorldEvent:
        """Reply at once."""
        return Reply({"presented": True})


def past(until_ns: int, now_ns: NowNs) -> Callable[[], bool]:
    """Return a function that returns whether the time is past."""
    return lambda: now_ns() >= until_ns


@dataclass
class Discarded:
    """A recorder with Capture's threads and rings that discards all samples, to measure the readers alone."""

    sensors: Mapping[str, SyntheticSensor]

    def perform(self, request: Sense, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent:
        """Record for the request's seconds."""
        recording = Recording(self.sensors, now_ns)
        recording.start()
        while now_ns() < recording.started_ns + request.seconds * NS:
            window.wait_for("", desk, past(now_ns() + round(CHUNK_S * NS), now_ns))
            for stream in recording.streams.values():
                stream.ring.get(sys.maxsize)
        recording.end()
        return Reply({"recorded": True, "seconds": request.seconds})


@dataclass
class OneThread:
    """A recorder as in a simple script: one loop reads all sensors in turn, and returns the samples twice a second."""

    sensors: Mapping[str, SyntheticSensor]
    start_ns: int | None = None

    def perform(self, request: Sense, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent:
        """Return a chunk, or the reply."""
        if self.start_ns is None:
            self.start_ns = now_ns()
            for sensor in self.sensors.values():
                sensor.start(now_ns)
        blocks_by_sensor: dict[str, list[Block]] = {name: [] for name in self.sensors}
        until_ns = now_ns() + round(CHUNK_S * NS)
        while now_ns() < until_ns:
            wait_s = 1.0  # for the first; the others are due then, too
            for name, sensor in self.sensors.items():
                blocks_by_sensor[name].extend(sensor.read(wait_s).get("samples", ()))
                wait_s = 0.0
            desk.poll()
        window.wait_for("", desk, lambda: True)
        samples = tuple(self._samples(name, blocks) for name, blocks in blocks_by_sensor.items() if blocks)
        if now_ns() >= self.start_ns + request.seconds * NS:
            return Reply({"recorded": True, "seconds": request.seconds}, samples)
        return Chunk({"streams": {}}, samples)

    def _samples(self, name: str, blocks: Sequence[Block]) -> Samples:
        like, data = self.sensors[name].signals[0], b"".join(block.data for block in blocks)
        return Samples(f"{name}_samples", like.channels, like.units, like.rate_hz, 0, data, blocks[0].first, like.clock)


def plan_of(seconds: float) -> Plan:
    """Return a plan of one recording of `seconds` seconds."""
    study = {
        "study": "streams", "task": "capture", "stimuli": [{"id": "ramp", "columns": {}}], "needs": ["tool"],
        "capture": {"device": "tool", "seconds": seconds}, "order": {"design": "as_listed"},
    }  # fmt: skip
    return compile_plan(Study.model_validate(study), ParticipantRow("P001"))


def recorder(writer: str, sensors: Mapping[str, SyntheticSensor], fast: float) -> Records:
    """Return the recorder by name: `palpate`; `none`, which discards samples; `one thread`, which also writes.

    The buffer for samples that wait to be written lasts as long as at the sensors' real pace.
    """
    if writer == "palpate":
        return Capture(sensors, room_s=ROOM_S / fast)
    return Discarded(sensors) if writer == "none" else OneThread(sensors)


def run(lab: Path, stream_s: float, fast: float, writer: str) -> dict[str, Any]:
    """Record through a real session; times in milliseconds, memory in 10^6 bytes."""
    sensors = {name: SyntheticSensor(name, channels, rate_hz, fast) for name, channels, rate_hz in KINDS}
    records = recorder(writer, sensors, fast)
    desk, before, window = Nobody(), [0.0], Watching(rest=lambda _turn_s: time.sleep(TURN_S))

    def opened(_plan: Plan, t_ns: int) -> Rig:
        before[0] = memory_MB()
        window.now_ns = clock_from(t_ns)
        world = LiveWorld(window, desk, Station(HandedOver(), {"tool": records}), window.now_ns)
        return Rig(world, lambda: None, window.kept)

    start_s = time.perf_counter()
    result = start(lab, plan_of(stream_s / fast), RigPlan({"kind": "made up"}, lambda _plan: None, opened))
    late = [time_ns for sensor in sensors.values() for time_ns in sensor.late_ns]
    return {
        "ledger": str(result.path),
        "produced": {name: sensor.produced for name, sensor in sensors.items()},
        "seconds": time.perf_counter() - start_s,
        "growth_MB": max(desk.memory_MB) - before[0],
        "late_ms": spread([woken - due for due, woken in late]),
        "held_up_ms": spread(held_up(late, window.busy_ns)),
        "handed_ms": spread([time_ns for sensor in sensors.values() for time_ns in sensor.handed_ns]),
        "writing_ms": spread([done - start_s for start_s, done in window.busy_ns]),
    }


def held_up(late: Sequence[tuple[int, int]], busy: Sequence[tuple[int, int]]) -> list[int]:
    """Return how long every read was overdue while the writer was busy: the writer's possible share."""
    starts = [start for start, _ in busy]
    overdue = []
    for due, woken in late:
        near = busy[max(0, bisect_right(starts, due) - 1) : bisect_right(starts, woken)]
        overdue.append(sum(max(0, min(woken, done) - max(due, start)) for start, done in near))
    return overdue


def spread(times_ns: Sequence[int]) -> dict[str, float]:
    """Return the median, the 99th and 99.9th percentiles and the maximum, in milliseconds."""
    if not times_ns:
        return {}
    p50, p99, p999, most = np.percentile(np.asarray(times_ns) / 1e6, [50, 99, 99.9, 100])
    return {"p50": float(p50), "p99": float(p99), "p99.9": float(p999), "max": float(most), "n": len(times_ns)}


def in_real_time() -> bool:
    """Give this thread and those that it starts real-time priority; return whether that is possible."""
    if sys.platform != "linux":
        return False
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
    except OSError:
        return False
    return True


if __name__ == "__main__":
    in_real_time()
    where, stream_seconds, times_as_fast, how = sys.argv[1:]
    sys.stdout.write(json.dumps(run(Path(where), float(stream_seconds), float(times_as_fast), how)) + "\n")
