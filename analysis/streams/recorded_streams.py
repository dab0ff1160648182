"""One stream of one act in a ledger, and the way from a verified ledger to the streams of a trial."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.protocols.clocks import Clock, ClockError, fit_clock, nominal_clock
from palpate.protocols.events import ANSWERED, CAPTURED, NS, Event, Samples
from palpate.protocols.session_state import Attempt
from palpate.signals.aligning.stamps import Stamps, stamps_of
from palpate.signals.arrays import Array
from palpate.studies.sessions.record import Record

Numbers = NDArray[np.int64]


class StreamError(ValueError):
    """Streams that do not exist, or whose blocks do not fit together; the message says where."""


@dataclass(frozen=True)
class Gap:
    """A gap: `lost` samples are missing from number `first` on, because of `why`."""

    first: int
    lost: int
    why: str


@dataclass(frozen=True)
class Stream:
    """A stream of one trial; its samples stay in the ledger until `values` is called.

    `act` is the number of the recording within the attempt: streams of one act were recorded together. `arrived` are
    (n, t_ns): sample n, the last of its block, was there at t_ns of session time. `rate_hz` is nominal, 0 for events.
    `stamped` are those arrivals that have a stamp of the device: (n, t_ns, the stamp in seconds of `clock`). Times are
    by the arrivals, unless `by_stamps`.
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
        """The number of recorded samples."""
        return sum(block.count for block in self.blocks)

    @property
    def lost(self) -> int:
        """The number of missing samples."""
        return sum(gap.lost for gap in self.gaps)

    @property
    def noted(self) -> bool:
        """Whether it has no rate, since it records events: a channel has the times."""
        return self.rate_hz == 0

    @cached_property
    def timing(self) -> Clock:
        """The stream's clock in seconds of session time: from its arrivals, or as declared without arrivals.

        Raises StreamError for arrivals that no clock fits, for a stream without a rate, and for unusable stamps if it
        is to be timed by stamps.
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
        """The clock by the device's own stamps; None without stamps. Raises StreamError as `timing` does."""
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
        """Return the samples, (count, channels), in the stream's units, read from the ledger at every call."""
        samples = np.empty((self.count, len(self.channels)))
        place = 0
        for block in self.blocks:
            samples[place : place + block.count] = _rows(block)
            place += block.count
        return samples

    def pieces(self) -> Iterator[tuple[Numbers, Array]]:
        """Yield each block: the samples' numbers, (n,), and the samples, (n, channels)."""
        for block in self.blocks:
            yield np.arange(block.first, block.first + block.count), _rows(block).astype(np.float64)

    def numbers(self) -> Numbers:
        """Return the number of each sample, (count,), in a numbering that includes lost ones."""
        return np.concatenate([np.arange(block.first, block.first + block.count) for block in self.blocks])


def _rows(block: Samples) -> NDArray[np.float32]:
    return np.frombuffer(block.data, dtype="<f4").reshape(-1, len(block.channels))


@dataclass(frozen=True)
class RecordedAttempt:
    """An attempt at a trial, and the events with its samples by request, with the stimulus of each."""

    attempt: Attempt
    acts: tuple[tuple[Event, ...], ...]
    felt: tuple[str, ...]

    @property
    def trial(self) -> int:
        """The trial's number."""
        return self.attempt.trial

    @property
    def number(self) -> int:
        """The number of the attempt at the trial, from 1."""
        return self.attempt.number

    @property
    def stimulus(self) -> str:
        """The stimulus of the trial, of a set the first."""
        return self.attempt.stimulus

    def stimulus_of(self, act: int) -> str:
        """Return the stimulus that was presented in an act, counted from 1."""
        return self.felt[act - 1]

    @property
    def usable(self) -> bool:
        """Whether the attempt ended well, was not withdrawn since, and has streams."""
        return self.attempt.valid and bool(self.acts)

    @property
    def ending(self) -> str:
        """How the attempt ended, in a word or two."""
        ended_as = self.attempt.ended_as
        again = self.attempt.withdrawn and ended_as in (ANSWERED, CAPTURED)
        return f"{ended_as or 'not ended'}{', then wished again' if again else ''}"


def attempts_of(record: Record) -> tuple[RecordedAttempt, ...]:
    """Return every attempt of every trial in order."""
    attempts = []
    for attempt in record.state.attempts:
        stimulus = attempt.stimulus
        acts: list[tuple[str, list[Event]]] = []  # the stimulus that was felt, and what came of each request
        for event in record.events_of(attempt):
            if event.kind == "request":
                stimulus = event.value.get("stimulus", stimulus)
                acts.append((stimulus, []))
            elif event.kind in ("samples", "reply"):
                acts[-1][1].append(event)
        sampled = [(felt, tuple(act)) for felt, act in acts if any(event.samples for event in act)]
        felt_in, events = tuple(felt for felt, _ in sampled), tuple(act for _, act in sampled)
        attempts.append(RecordedAttempt(attempt, events, felt_in))
    return tuple(attempts)


def counting_attempts(attempts: Iterable[RecordedAttempt]) -> dict[int, RecordedAttempt]:
    """Return the attempt that counts of each trial, the last usable one, if any."""
    return {attempt.trial: attempt for attempt in attempts if attempt.usable}


def streams_of(record: Record, trial: int, attempt: int | None = None) -> tuple[Stream, ...]:
    """Return the streams of a trial's attempt that counts, or of the given attempt, whatever its outcome.

    Raises StreamError if there are none, and if blocks overlap or differ in kind.
    """
    attempts = [candidate for candidate in attempts_of(record) if candidate.trial == trial]
    chosen = counting_attempts(attempts).get(trial)
    if attempt is not None:
        chosen = next((candidate for candidate in attempts if candidate.number == attempt), None)
    if chosen is None or not chosen.acts:
        if not attempts:
            raise StreamError(f"{record.path}: trial {trial} was not presented in this session")
        how = ", ".join(
            f"attempt {candidate.number} {candidate.ending}{'' if candidate.acts else ', no streams'}"
            for candidate in attempts
        )
        missing = "no attempt that counts holds streams" if attempt is None else f"attempt {attempt} holds no streams"
        raise StreamError(f"{record.path}: trial {trial}: {missing} ({how})")
    try:
        return streams_in(chosen)
    except StreamError as error:
        raise StreamError(f"{record.path}: {error}") from error


def streams_in(attempt: RecordedAttempt) -> tuple[Stream, ...]:
    """Return the streams of an attempt, act by act."""
    return tuple(
        _join_blocks(attempt, number, act, name)
        for number, act in enumerate(attempt.acts, start=1)
        for name in dict.fromkeys(block.stream for event in act for block in event.samples)
    )


def _join_blocks(attempt: RecordedAttempt, number: int, act: Sequence[Event], name: str) -> Stream:
    """Return the joined blocks of one stream. Raises StreamError if they overlap or differ."""
    where = f"trial {attempt.trial}, attempt {attempt.number}: stream {name}"
    blocks = tuple(block for event in act for block in event.samples if block.stream == name and block.count)
    if not blocks:
        raise StreamError(f"{where}: its blocks are empty")
    like = blocks[0]
    for one, other in pairwise(blocks):
        for what in ("channels", "units", "rate_hz", "clock"):
            if getattr(one, what) != getattr(other, what):
                raise StreamError(f"{where}: {what} change from {getattr(one, what)} to {getattr(other, what)}")
    gaps = tuple(_gaps(act, blocks, name, where)) if like.rate_hz else ()
    arrivals = tuple(
        (int(n), int(t_ns)) for event in act for n, t_ns, *_ in _stream_metadata(event, name).get("arrived", ())
    )
    metadata = [_stream_metadata(event, name) for event in act]
    stamps = tuple(
        (int(n), int(t_ns), float(stamp_s))
        for entry in metadata
        for (n, t_ns, *_), stamp_s in zip(entry.get("arrived", ()), entry.get("device_s", ()), strict=False)
    )
    calibrations = [_stream_metadata(event, name).get("calibration") for event in act]
    calibration = next((str(calibration) for calibration in reversed(calibrations) if calibration is not None), None)
    return Stream(
        attempt.trial, attempt.number, number, name, like.channels, like.units, float(like.rate_hz), like.clock,
        calibration, blocks, gaps, arrivals, stamps,
    )  # fmt: skip


def _stream_metadata(event: Event, name: str) -> Mapping[str, Any]:
    """Return the event's metadata of a stream; replies from before chunks have none."""
    streams = event.value.get("streams", {})
    metadata = streams.get(name) if isinstance(streams, Mapping) else None
    return metadata if isinstance(metadata, Mapping) else {}


def _gaps(act: Sequence[Event], blocks: Sequence[Samples], name: str, where: str) -> Iterator[Gap]:
    """Yield the gaps in the numbering of the blocks, from number 0 on, and the losses reported after the last block."""
    named = [  # those of a reply are their number
        Gap(int(first), int(lost), str(why))
        for event in act
        if event.kind == "samples"
        for first, lost, why in _stream_metadata(event, name).get("gaps", ())
    ]
    expected = 0
    for block in blocks:
        if block.first < expected:
            raise StreamError(f"{where}: sample {block.first} appears twice, or the blocks are out of order")
        # The gaps that were named up to the block, and whatever they leave over.
        for gap in named:
            if expected <= gap.first and gap.first + gap.lost <= block.first:
                yield from _unexplained_gap(expected, gap.first)
                yield gap
                expected = gap.first + gap.lost
        yield from _unexplained_gap(expected, block.first)
        expected = block.first + block.count
    yield from (gap for gap in named if gap.first >= expected)


def _unexplained_gap(first: int, end: int) -> Iterator[Gap]:
    if end > first:
        yield Gap(first, end - first, "not told")
