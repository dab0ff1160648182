"""A signal being recorded: its blocks joined to samples, its gaps, its clock, and its level."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.devices.device import Block, DeviceFault, Signal
from palpate.devices.streams.drift import ClockFit
from palpate.devices.streams.reader import NO_ROOM, Ring
from palpate.protocols.events import NS, Samples

PIECE_BYTES = 256 * 1024
"""Samples are joined in pieces of this size: a longer copy would hold the interpreter, and delay the readers."""
TAKE_BYTES = 4 * PIECE_BYTES
"""Greatest size of a stream in one chunk; the rest goes into the next."""
ARRIVALS = 16
"""Arrivals per chunk and stream that are recorded: the earliest of each of so many equal parts."""
SILENT_S, SILENT_SAMPLES = 1.0, 20
"""A signal is silent without samples for this long, and for as long as so many samples take."""
WINDOW_S = 3.0
"""Time within which samples have arrived even if the reading was delayed."""
MOST_DEVICE_PPM = 100_000.0
"""A device's own clock that deviates more was set meanwhile."""
SHOWN = 2048
"""Number of the last rows that a level covers: it is shown, not recorded."""


@dataclass(frozen=True)
class Gap:
    """Missing samples: the number of the first of them, how many, and why."""

    first: int
    lost: int
    why: str


@dataclass
class Standstill:
    """A check for a sensor that stood still while the host's clock went on, and then numbered on without a gap.

    After such a pause all samples come later than before, by as long as it stood still: the least delay in a window of
    time rises. If only the reading was delayed, some samples come as promptly as before within a window. `last_ns` is
    when the last block came, `stood_s` how long the sensor stood still.
    """

    limit_s: float
    last_ns: int | None = None
    stood_s: float = 0.0
    _ends_ns: int = 0
    _paused: bool = False
    _least_s: float = math.inf
    _before_s: float = math.inf

    def add(self, late_s: float, at_ns: int, lasts_s: float) -> bool:
        """Add a block with its lateness, time and duration; return whether nothing came for too long before it."""
        pause = self.last_ns is not None and (at_ns - self.last_ns) / NS - lasts_s > self.limit_s
        if at_ns >= self._ends_ns or pause:
            self.check()
            self._before_s, self._paused = self._least_s, pause
            self._least_s, self._ends_ns = math.inf, at_ns + round(WINDOW_S * NS)
        self._least_s, self.last_ns = min(self._least_s, late_s), at_ns
        return pause

    def check(self) -> None:
        """Compare the current window with the one before, if there was a pause between them."""
        if self._paused and self._least_s - self._before_s > self.limit_s:
            self.stood_s = self._least_s - self._before_s


@dataclass
class Stream:
    """The writer's state of a stream; only the ring is shared with the thread that reads the sensor.

    `next` is the number of the next expected sample, counting lost ones. `broken` is set if the sensor's own numbering
    of its samples cannot be right.
    """

    name: str
    device: str
    signal: Signal
    ring: Ring
    next: int = 0
    samples: int = 0
    lost: int = 0
    gaps: int = 0
    bad: int = 0
    bad_run: int = 0
    level: Level | None = None
    by_number: ClockFit = field(default_factory=ClockFit)
    by_device: ClockFit = field(default_factory=ClockFit)
    broken: DeviceFault | None = None
    standstill: Standstill = field(init=False)

    def __post_init__(self) -> None:
        rate_hz = self.signal.rate_hz
        self.standstill = Standstill(max(SILENT_S, SILENT_SAMPLES / rate_hz) if rate_hz else math.inf)

    @property
    def most(self) -> int:
        """Return the greatest size of a chunk in bytes: at most half the room."""
        return min(TAKE_BYTES, self.ring.room // 2)

    @property
    def width(self) -> int:
        """Return the number of channels of a row."""
        return len(self.signal.channels)

    def take(self, last: bool = False) -> tuple[tuple[Samples, ...], dict[str, Any] | None]:
        """Return the samples that have arrived, in pieces without a gap, and their metadata; None if there are none.

        `last` is set once the reading thread has ended, so that samples dropped at the very end are reported.
        """
        blocks = self._good(self.ring.get(self.most))
        gaps: list[Gap] = []
        runs = self._runs(blocks, gaps)
        if last and not self.ring.held and self.ring.dropped:
            gaps.append(self._miss(self.ring.dropped, NO_ROOM))
            self.ring.dropped = 0
        if last and not self.ring.held:
            self.standstill.check()
        if not blocks and not gaps:
            return (), None
        pieces = tuple(piece for run in runs for piece in self._pieces(run))
        # Look at the samples: the level of the last piece, and how many rows are not numbers.
        bad = 0
        for piece in pieces:
            seen = level(piece.data, self.width)
            self.bad_run = seen.bad_at_end + (self.bad_run if seen.bad_at_end == piece.count else 0)
            self.level, bad = seen, bad + seen.bad
        self.bad += bad
        return pieces, self._metadata(blocks, gaps, bad)

    def summary(self) -> dict[str, Any]:
        """Return a summary of the whole stream as JSON data; null where the arrivals do not give a value."""
        counted, own, rate_hz = self.by_number.fit(), self.by_device.fit(), self.signal.rate_hz
        own = own if own and abs(own.ppm) <= MOST_DEVICE_PPM else None
        return {
            "samples": self.samples,
            "lost": self.lost,
            "gaps": self.gaps,
            "not_a_number": self.bad,
            "seconds": round(self.next / rate_hz, 6) if rate_hz else None,
            "nominal_hz": float(rate_hz),
            "rate_hz": round(counted.pace * rate_hz, 6) if counted and rate_hz else None,
            "drift_ppm": round(counted.ppm, 3) if counted else None,
            "drift_se_ppm": round(counted.se_ppm, 3) if counted else None,
            **({"device_ppm": round(own.ppm, 3), "device_se_ppm": round(own.se_ppm, 3)} if own else {}),
            "clock": self.signal.clock,
            "units": list(self.signal.units),
            "calibration": self.signal.calibration,
        }

    def _good(self, blocks: list[Block]) -> list[Block]:
        """Return the blocks up to the first impossible one."""
        expected, before_ns = self.next, self.standstill.last_ns
        for place, block in enumerate(blocks):
            rows, rest = divmod(len(block.data), 4 * self.width)
            if rest or block.first < expected + block.lost or self._too_many(block.first - expected, block, before_ns):
                message = f"sample {block.first} came, {block.lost} lost before it, where {expected} was the next"
                if rest:
                    message = (
                        f"a block of {len(block.data)} bytes came, which is no whole number of {self.width} channels"
                    )
                self.broken = DeviceFault(self.device, "firmware", f"{self.name}: {message}")
                return blocks[:place]
            expected, before_ns = block.first + rows, block.at_ns
        return blocks

    def _too_many(self, missing: int, block: Block, before_ns: int | None) -> bool:
        """Return whether more samples are reported missing than there was time for since the block before."""
        if before_ns is None or not self.signal.rate_hz:
            return False
        return missing / self.signal.rate_hz > 2 * (block.at_ns - before_ns) / NS + SILENT_S

    def _runs(self, blocks: Sequence[Block], gaps: list[Gap]) -> list[list[Block]]:
        """Return runs of blocks without a gap, adding the gaps between them to `gaps`."""
        runs: list[list[Block]] = []
        for block in blocks:
            if block.first > self.next:
                why = block.why or "the sensor's numbering jumps"
                gaps.append(self._miss(block.first - self.next, why))
                runs.append([])
            rows = len(block.data) // (4 * self.width)
            if rows:
                if self.signal.rate_hz:
                    self.by_number.add((block.first + rows - 1) / self.signal.rate_hz, block.at_ns)
                if block.device_s is not None:
                    self.by_device.add(block.device_s, block.at_ns)
                late_s = self._lateness(block) / NS
                lasts_s = rows / self.signal.rate_hz if self.signal.rate_hz else 0.0
                if self.standstill.add(late_s, block.at_ns, lasts_s) or not runs:
                    runs.append([])
                runs[-1].append(block)
            self.next, self.samples = self.next + rows, self.samples + rows
        return [run for run in runs if run]

    def _miss(self, lost: int, why: str) -> Gap:
        gap = Gap(self.next, lost, why)
        self.next, self.lost, self.gaps = self.next + lost, self.lost + lost, self.gaps + 1
        return gap

    def _pieces(self, run: Sequence[Block]) -> list[Samples]:
        """Return a run of blocks as samples, none larger than a piece unless a single block is."""
        # The run's first sample was taken at the earliest time that the arrivals allow at the nominal rate.
        start_ns, start, rate_hz = run[0].at_ns, run[0].first, self.signal.rate_hz
        if rate_hz:
            start_ns = min(block.at_ns - round((self._last(block) - start) * NS / rate_hz) for block in run)
        pieces: list[Samples] = []
        data: list[bytes] = []
        size, first = 0, start
        for block in run:
            if data and size + len(block.data) > PIECE_BYTES:
                pieces.append(self._samples(first, start, start_ns, b"".join(data)))
                data, size, first = [], 0, block.first
            data.append(block.data)
            size += len(block.data)
        return [*pieces, self._samples(first, start, start_ns, b"".join(data))]

    def _samples(self, first: int, start: int, start_ns: int, data: bytes) -> Samples:
        signal = self.signal
        later_ns = round((first - start) * NS / signal.rate_hz) if signal.rate_hz else 0
        return Samples(
            self.name, signal.channels, signal.units, signal.rate_hz, start_ns + later_ns, data, first, signal.clock
        )

    def _metadata(self, blocks: Sequence[Block], gaps: Sequence[Gap], bad: int) -> dict[str, Any]:
        count = sum(len(block.data) for block in blocks) // (4 * self.width)
        lost = sum(gap.lost for gap in gaps)
        return {
            "first": self.next - count - lost,
            "count": count,
            "lost": lost,
            "why": "; ".join(dict.fromkeys(gap.why for gap in gaps)),
            **self._arrivals([block for block in blocks if block.data]),
            **({"gaps": [[gap.first, gap.lost, gap.why] for gap in gaps]} if gaps else {}),
            **({"not_a_number": bad} if bad else {}),
        }

    def _arrivals(self, blocks: Sequence[Block]) -> dict[str, Any]:
        """Return the earliest arrivals: [number of a block's last sample, arrival time], and the device's own times.

        Earliest by the nominal rate, which errs by microseconds within a sixteenth of a chunk.
        """
        share = max(1, -(-len(blocks) // ARRIVALS))
        parts = (blocks[start : start + share] for start in range(0, len(blocks), share))
        kept = [min(part, key=self._lateness) for part in parts]
        arrived = {"arrived": [[self._last(block), block.at_ns] for block in kept]}
        if not kept or any(block.device_s is None for block in kept):
            return arrived
        return {**arrived, "device_s": [float(block.device_s or 0.0) for block in kept]}

    def _last(self, block: Block) -> int:
        return block.first + len(block.data) // (4 * self.width) - 1

    def _lateness(self, block: Block) -> float:
        rate_hz = self.signal.rate_hz
        return block.at_ns - self._last(block) * NS / rate_hz if rate_hz else 0.0


@dataclass(frozen=True)
class Level:
    """The root mean square about the mean per channel; the number of rows that are not finite, in all and at the
    end.
    """

    rms: tuple[float, ...]
    bad: int
    bad_at_end: int


def level(data: bytes, channels: int) -> Level:
    """Return the level of rows of little-endian float32; rows with a value that is not finite only count as bad."""
    rows = np.frombuffer(data, "<f4").reshape(-1, channels)
    finite = np.isfinite(rows)
    if finite.all():
        return Level(_spread(rows), 0, 0)
    bad = ~finite.all(axis=1)
    good = np.flatnonzero(~bad)
    at_end = len(bad) - 1 - int(good[-1]) if len(good) else len(bad)
    return Level(_spread(rows[good[-SHOWN:]]), int(bad.sum()), at_end)


def _spread(rows: NDArray[np.float32]) -> tuple[float, ...]:
    if not len(rows):
        return (0.0,) * int(rows.shape[1])
    return tuple(float(spread) for spread in rows[-SHOWN:].std(axis=0, dtype=np.float64))
