"""From a verified ledger to the streams of a trial: the attempt that counts, its blocks joined, its gaps named."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from palpate.analysis.streams.recorded import Gap, Stream, StreamError
from palpate.protocols.events import Event
from palpate.protocols.requests import Samples
from palpate.studies.record import Record

KEPT = ("captured", "answered")
"""How a trial ends whose recordings count; one that was repeated, left or faulted is listed and not used."""


@dataclass(frozen=True)
class Attempt:
    """A trial that was met once: how it ended (None: not yet), and which events hold its samples, by request."""

    trial: int
    number: int
    stimulus: str
    ended_as: str | None
    withdrawn: bool
    acts: tuple[tuple[Event, ...], ...]

    @property
    def kept(self) -> bool:
        """Whether it ended well, was not withdrawn since, and holds streams."""
        return self.ended_as in KEPT and not self.withdrawn and bool(self.acts)

    @property
    def told(self) -> str:
        """How it ended, in a word or two."""
        withdrawn = ", then wished again" if self.withdrawn and self.ended_as in KEPT else ""
        return f"{self.ended_as or 'not ended'}{withdrawn}"


def attempts_of(record: Record) -> tuple[Attempt, ...]:
    """Every attempt of every trial, in the order in which they were met."""
    walk = _Walk()
    for event in record.events:
        walk.take(event)
    return tuple(met.attempt(walk.withdrawn) for met in walk.met)


def counting(attempts: Iterable[Attempt]) -> dict[int, Attempt]:
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


def streams_in(attempt: Attempt) -> tuple[Stream, ...]:
    """The streams of an attempt, act by act."""
    return tuple(
        _joined(attempt, number, act, name)
        for number, act in enumerate(attempt.acts, start=1)
        for name in dict.fromkeys(block.stream for event in act for block in event.samples)
    )


def _nothing(trial: int, attempt: int | None, met: Sequence[Attempt]) -> str:
    if not met:
        return f"trial {trial} was not met in this session"
    how = ", ".join(f"attempt {each.number} {each.told}{'' if each.acts else ', no streams'}" for each in met)
    wanted = "no attempt that counts holds streams" if attempt is None else f"attempt {attempt} holds no streams"
    return f"trial {trial}: {wanted} ({how})"


@dataclass
class _Met:
    trial: int
    number: int
    stimulus: str
    ended_as: str | None = None
    acts: list[list[Event]] = field(default_factory=list)
    """What came of each request."""

    def attempt(self, withdrawn: set[tuple[int, int]]) -> Attempt:
        """What became of it."""
        acts = tuple(tuple(act) for act in self.acts if any(event.samples for event in act))
        gone = (self.trial, self.number) in withdrawn
        return Attempt(self.trial, self.number, self.stimulus, self.ended_as, gone, acts)


@dataclass
class _Walk:
    """One pass over the events."""

    met: list[_Met] = field(default_factory=list)
    withdrawn: set[tuple[int, int]] = field(default_factory=set)

    def take(self, event: Event) -> None:
        if event.trial is None:
            return
        match event.kind:
            case "trial_started":
                self.met.append(_Met(event.trial, event.attempt or 0, str(event.value["stimulus"])))
            case "request":
                self.met[-1].acts.append([])
            case "samples" | "reply":
                self.met[-1].acts[-1].append(event)
            case "trial_ended":
                self._end(event)
            case "experimenter" if event.value.get("which") == "last":
                self._withdraw(event.trial - 1)

    def _end(self, event: Event) -> None:
        self.met[-1].ended_as = str(event.value["as"])
        if self.met[-1].ended_as == "repeated":
            self._withdraw(self.met[-1].trial)

    def _withdraw(self, trial: int) -> None:
        """What was recorded of the trial so far is to be recorded anew."""
        self.withdrawn |= {(each.trial, each.number) for each in self.met if each.trial == trial}


def _joined(attempt: Attempt, number: int, act: Sequence[Event], name: str) -> Stream:
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
