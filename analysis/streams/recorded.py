"""One stream of one act as it stands in a ledger: what it is, where its blocks lie, what lacks, when it came."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from palpate.protocols.clocks import Clock, ClockError, fit_clock, nominal_clock
from palpate.protocols.events import NS
from palpate.protocols.requests import Samples
from palpate.signals.aligning.stamps import Stamps, stamps_of
from palpate.signals.arrays import Array

Numbers = NDArray[np.int64]


class StreamError(ValueError):
    """Streams that are not there, or whose blocks do not fit together; the message says where."""


@dataclass(frozen=True)
class Gap:
    """`lost` samples are missing from number `first` on, because of `why`."""

    first: int
    lost: int
    why: str


@dataclass(frozen=True)
class Stream:
    """A stream of one trial; its samples stay in the ledger until `values` is asked for.

    `act` is the how-manieth recording of the attempt it belongs to: streams of one act were recorded together.
    `arrived` are (n, t_ns): sample n, the last of its block, was there at t_ns of session time. `rate_hz` is nominal;
    0 where things were noted as they happened. `stamped` are those arrivals that have a stamp of the device: (n, t_ns,
    the stamp in seconds of `clock`). Times are by the arrivals, unless `by_stamps`.
    """

    trial: int
    attempt: int
    act: int
    name: str
    channels: tuple[str, ...]
    units: tuple[str, ...]
    rate_hz: float
    clock: str
    calibration: str | None
    blocks: tuple[Samples, ...]
    gaps: tuple[Gap, ...]
    arrived: tuple[tuple[int, int], ...]
    stamped: tuple[tuple[int, int, float], ...] = ()
    by_stamps: bool = False

    @property
    def where(self) -> str:
        """The stream's place, for messages."""
        again = f", act {self.act}" if self.act > 1 else ""
        return f"trial {self.trial}, attempt {self.attempt}{again}: stream {self.name}"

    @property
    def count(self) -> int:
        """Samples that are there."""
        return sum(block.count for block in self.blocks)

    @property
    def lost(self) -> int:
        """Samples that are not."""
        return sum(gap.lost for gap in self.gaps)

    @property
    def noted(self) -> bool:
        """Whether it has no rate: a channel holds the times."""
        return self.rate_hz == 0

    @cached_property
    def timing(self) -> Clock:
        """The stream's clock in seconds of session time: from its arrivals, or as declared where it has none.

        Raises StreamError for arrivals that no clock can be fitted to, for a stream without a rate, and where it is to
        be timed by stamps that cannot do it.
        """
        if not self.by_stamps:
            return self._by_arrivals
        stamps = self.stamps
        problem = "its device did not stamp its samples" if stamps is None else stamps.problem
        if stamps is None or stamps.line is None or problem is not None:
            raise StreamError(f"{self.where} cannot be timed by its stamps: {problem}")
        return stamps.line

    @cached_property
    def stamps(self) -> Stamps | None:
        """What its device's own stamps tell of it; None where there are none. Raises StreamError as `timing` does."""
        if not self.stamped or self.noted:
            return None
        in_seconds = [(n, t_ns / NS, stamp_s) for n, t_ns, stamp_s in self.stamped]
        return stamps_of(in_seconds, self.rate_hz, self.clock, self._by_arrivals)

    @cached_property
    def _by_arrivals(self) -> Clock:
        try:
            if self.arrived:
                return fit_clock([(n, t_ns / NS) for n, t_ns in self.arrived], self.rate_hz)
            return nominal_clock(self.rate_hz, self.blocks[0].first, self.blocks[0].t0_ns / NS)
        except ClockError as error:
            raise StreamError(f"{self.where}: {error}") from error

    def values(self) -> Array:
        """Samples, shape (count, channels), in the stream's units. Read from the ledger at every call."""
        found = np.empty((self.count, len(self.channels)))
        place = 0
        for block in self.blocks:
            found[place : place + block.count] = _rows(block)
            place += block.count
        return found

    def pieces(self) -> Iterator[tuple[Numbers, Array]]:
        """Block after block: the samples' numbers, shape (n,), and the samples, shape (n, channels)."""
        for block in self.blocks:
            yield np.arange(block.first, block.first + block.count), _rows(block).astype(np.float64)

    def numbers(self) -> Numbers:
        """The number of each sample, lost ones counted; shape (count,)."""
        return np.concatenate([np.arange(block.first, block.first + block.count) for block in self.blocks])


def _rows(block: Samples) -> NDArray[np.float32]:
    return np.frombuffer(block.data, dtype="<f4").reshape(-1, len(block.channels))
