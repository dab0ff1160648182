"""One stream of one act as it stands in a ledger: what it is, where its blocks lie, what lacks, when it came."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.protocols.clocks import Clock, ClockError, fit_clock, nominal_clock
from palpate.protocols.events import ANSWERED, CAPTURED, NS, Event
from palpate.protocols.requests import Samples
from palpate.protocols.session_state import Attempt
from palpate.signals.aligning.stamps import Stamps, stamps_of
from palpate.signals.arrays import Array
from palpate.studies.record import Record

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


@dataclass(frozen=True)
class RecordedAttempt:
    """An attempt at a trial, and the events that hold its samples, request by request."""

    attempt: Attempt
    acts: tuple[tuple[Event, ...], ...]

    @property
    def trial(self) -> int:
        """The trial's number."""
        return self.attempt.trial

    @property
    def number(self) -> int:
        """Which attempt at the trial it is, from 1."""
        return self.attempt.number

    @property
    def stimulus(self) -> str:
        """The stimulus of the trial."""
        return self.attempt.stimulus

    @property
    def kept(self) -> bool:
        """Whether it ended well, was not withdrawn since, and holds streams."""
        return self.attempt.valid and bool(self.acts)

    @property
    def told(self) -> str:
        """How it ended, in a word or two."""
        ended_as = self.attempt.ended_as
        again = self.attempt.withdrawn and ended_as in (ANSWERED, CAPTURED)
        return f"{ended_as or 'not ended'}{', then wished again' if again else ''}"


def attempts_of(record: Record) -> tuple[RecordedAttempt, ...]:
    """Every attempt of every trial, in the order in which they were met."""
    return tuple(RecordedAttempt(attempt, tuple(_acts(record, attempt))) for attempt in record.state.attempts)


def _acts(record: Record, attempt: Attempt) -> Iterator[tuple[Event, ...]]:
    """What came of each request of the attempt, where samples did."""
    acts: list[list[Event]] = []
    for event in record.events_of(attempt):
        if event.kind == "request":
            acts.append([])
        elif event.kind in ("samples", "reply"):
            acts[-1].append(event)
    return (tuple(act) for act in acts if any(event.samples for event in act))


def counting(attempts: Iterable[RecordedAttempt]) -> dict[int, RecordedAttempt]:
    """The attempt that counts of each trial that has one: the last that was kept."""
    return {each.trial: each for each in attempts if each.kept}


def streams_of(record: Record, trial: int, attempt: int | None = None) -> tuple[Stream, ...]:
    """The streams of a trial, of the attempt that counts or of the one that is named, whatever became of that one.

    Raises StreamError where there are none, and where blocks overlap or differ in what they are.
    """
    met = [each for each in attempts_of(record) if each.trial == trial]
    chosen = counting(met).get(trial) if attempt is None else next((e for e in met if e.number == attempt), None)
    if chosen is None or not chosen.acts:
        raise StreamError(f"{record.path}: {_nothing(trial, attempt, met)}")
    try:
        return streams_in(chosen)
    except StreamError as error:
        raise StreamError(f"{record.path}: {error}") from error


def streams_in(attempt: RecordedAttempt) -> tuple[Stream, ...]:
    """The streams of an attempt, act by act."""
    return tuple(
        _joined(attempt, number, act, name)
        for number, act in enumerate(attempt.acts, start=1)
        for name in dict.fromkeys(block.stream for event in act for block in event.samples)
    )


def _nothing(trial: int, attempt: int | None, met: Sequence[RecordedAttempt]) -> str:
    if not met:
        return f"trial {trial} was not met in this session"
    how = ", ".join(f"attempt {each.number} {each.told}{'' if each.acts else ', no streams'}" for each in met)
    wanted = "no attempt that counts holds streams" if attempt is None else f"attempt {attempt} holds no streams"
    return f"trial {trial}: {wanted} ({how})"


def _joined(attempt: RecordedAttempt, number: int, act: Sequence[Event], name: str) -> Stream:
    """The blocks of one stream as they follow each other."""
    where = f"trial {attempt.trial}, attempt {attempt.number}: stream {name}"
    blocks = tuple(block for event in act for block in event.samples if block.stream == name and block.count)
    if not blocks:
        raise StreamError(f"{where}: its blocks are empty")
    like = blocks[0]
    _demand_alike(blocks, where)
    gaps = tuple(_gaps(act, blocks, name, where)) if like.rate_hz else ()
    return Stream(
        attempt.trial, attempt.number, number, name, like.channels, like.units, float(like.rate_hz), like.clock,
        _calibration(act, name), blocks, gaps, _arrived(act, name), _stamped(act, name),
    )  # fmt: skip


def _told(event: Event, name: str) -> Mapping[str, Any]:
    """What the event says of a stream beside its samples; replies of before chunks say nothing."""
    streams = event.value.get("streams", {})
    told = streams.get(name) if isinstance(streams, Mapping) else None
    return told if isinstance(told, Mapping) else {}


def _demand_alike(blocks: Sequence[Samples], where: str) -> None:
    for one, other in pairwise(blocks):
        for what in ("channels", "units", "rate_hz", "clock"):
            if getattr(one, what) != getattr(other, what):
                raise StreamError(f"{where}: {what} change from {getattr(one, what)} to {getattr(other, what)}")


def _gaps(act: Sequence[Event], blocks: Sequence[Samples], name: str, where: str) -> Iterator[Gap]:
    """What the numbering of the blocks lacks, from number 0 on, and what was told as missing after the last."""
    told = [gap for event in act for gap in _told_gaps(event, name)]
    expected = 0
    for block in blocks:
        if block.first < expected:
            raise StreamError(f"{where}: sample {block.first} stands twice, or the blocks are out of order")
        yield from _missing(expected, block.first, told)
        expected = block.first + block.count
    yield from (gap for gap in told if gap.first >= expected)


def _missing(first: int, end: int, told: Iterable[Gap]) -> Iterator[Gap]:
    """Samples from `first` up to `end`: the gaps that were told there, and whatever they leave over."""
    for gap in told:
        if first <= gap.first and gap.first + gap.lost <= end:
            yield from _untold(first, gap.first)
            yield gap
            first = gap.first + gap.lost
    yield from _untold(first, end)


def _untold(first: int, end: int) -> Iterator[Gap]:
    if end > first:
        yield Gap(first, end - first, "not told")


def _told_gaps(event: Event, name: str) -> Iterator[Gap]:
    """Each gap that an event of samples names; that of a reply is their number."""
    if event.kind == "samples":
        yield from (Gap(int(first), int(lost), str(why)) for first, lost, why in _told(event, name).get("gaps", ()))


def _arrived(act: Sequence[Event], name: str) -> tuple[tuple[int, int], ...]:
    return tuple((int(n), int(t_ns)) for event in act for n, t_ns, *_ in _told(event, name).get("arrived", ()))


def _stamped(act: Sequence[Event], name: str) -> tuple[tuple[int, int, float], ...]:
    """(n, t_ns, device's own time in s) of the chunks that tell it."""
    told = [_told(event, name) for event in act]
    return tuple(
        (int(n), int(t_ns), float(stamp_s))
        for each in told
        for (n, t_ns, *_), stamp_s in zip(each.get("arrived", ()), each.get("device_s", ()), strict=False)
    )


def _calibration(act: Sequence[Event], name: str) -> str | None:
    """The last that was said of what turned readings into units."""
    said = [_told(event, name).get("calibration") for event in act]
    return next((str(each) for each in reversed(said) if each is not None), None)
