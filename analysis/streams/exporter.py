"""Which streams of a ledger are exported, and into which files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from palpate.analysis.streams.alignment import Wanted, align_streams
from palpate.analysis.streams.exporting import ledger_account, write_aligned, write_raw
from palpate.analysis.streams.reading import RecordedAttempt, attempts_of, counting, streams_in, streams_of
from palpate.analysis.streams.recorded import Stream, StreamError
from palpate.protocols.files import staged_files
from palpate.protocols.wording import count
from palpate.studies.record import Record


@dataclass(frozen=True)
class Chosen:
    """What is exported: a trial or all, its attempt that counts or another, one act of it or all; a door's hinge.

    Streams in `by_stamps` are timed by their device's stamps instead of by their arrivals.
    """

    trial: int | None = None
    attempt: int | None = None
    act: int | None = None
    hinge: str | None = None
    by_stamps: tuple[str, ...] = ()

    @property
    def single(self) -> bool:
        """Whether one recording is meant."""
        return self.trial is not None


@dataclass(frozen=True)
class _Act:
    """Streams that were recorded together, and the name of their files."""

    stem: str
    attempt: RecordedAttempt
    streams: tuple[Stream, ...]

    def about(self, of_ledger: dict[str, Any]) -> dict[str, Any]:
        return {
            **of_ledger, "trial": self.attempt.trial, "attempt": self.attempt.number, "counts": self.attempt.kept,
            "act": self.streams[0].act, "stimulus": self.attempt.stimulus,
        }  # fmt: skip


def export(record: Record, chosen: Chosen, out: Path, wanted: Wanted | None) -> list[Path]:
    """Write the chosen streams, aligned as `wanted` or, without it, raw; the files that were written.

    `out` is a CSV file for one aligned recording, else a folder, in which files are named LEDGER_tNNN. Recordings of
    nothing but things noted (a form's marker) are not aligned: they are left out where there are others.

    Raises:
        StreamError: nothing to export, several recordings for one file, streams that cannot be aligned.
    """
    if (chosen.attempt is not None or chosen.act is not None) and not chosen.single:
        raise StreamError("--attempt and --act choose among the recordings of one trial: name it with --trial")
    acts = list(_acts(record, chosen))
    if wanted is not None and chosen.act is None:
        acts = [act for act in acts if any(not stream.noted for stream in act.streams)] or acts
    into_file = out.suffix.lower() == ".csv" and not out.is_dir()
    if into_file and (wanted is None or len(acts) > 1):
        raise StreamError(f"{out}: one file holds one aligned recording; {_several(acts, chosen, wanted)}")
    of_ledger = ledger_account(record, attempts_of(record))
    folder = out.parent if into_file else out
    with staged_files(folder) as draft:
        files: list[Path] = []
        for act in acts:
            path = draft / (out.name if into_file else f"{act.stem}.csv")
            files += _written(record, act, path, wanted, chosen, of_ledger)
    return [folder / file.name for file in files]


def _several(acts: Sequence[_Act], chosen: Chosen, wanted: Wanted | None) -> str:
    if wanted is None:
        return "raw streams have a file each: give a folder"
    which = "--act" if chosen.single else "--trial"
    return f"there are {len(acts)}: choose one with {which}, or give a folder"


def _written(
    record: Record, act: _Act, path: Path, wanted: Wanted | None, chosen: Chosen, of_ledger: dict[str, Any]
) -> list[Path]:
    about = act.about(of_ledger)
    try:
        streams = _timed(act.streams, chosen.by_stamps)
        if wanted is None:
            return write_raw(path.parent, act.stem, streams, about)
        return write_aligned(path, align_streams(streams, wanted, chosen.hinge), about)
    except StreamError as error:
        raise StreamError(f"{record.path}: {error}") from error


def _timed(streams: Sequence[Stream], by_stamps: Sequence[str]) -> tuple[Stream, ...]:
    """The streams, those that are named timed by their stamps. Raises StreamError where one cannot be."""
    names = [stream.name for stream in streams]
    for name in by_stamps:
        if name not in names:
            raise StreamError(
                f"{streams[0].where}: there is no stream {name!r} beside it; there are: {', '.join(names)}"
            )
    timed = tuple(replace(stream, by_stamps=stream.name in by_stamps) for stream in streams)
    for stream in timed:
        if stream.by_stamps:
            _ = stream.timing  # refuses it before anything is written
    return timed


def _acts(record: Record, chosen: Chosen) -> Iterator[_Act]:
    met = attempts_of(record)
    if chosen.trial is not None:
        streams_of(record, chosen.trial, chosen.attempt)  # refuses what is not there
        met = tuple(each for each in met if each.trial == chosen.trial and chosen.attempt in (None, each.number))
    used = list(counting(met).values()) if chosen.attempt is None else list(met)
    if not used:
        raise StreamError(f"{record.path}: no attempt that counts holds streams")
    found = [act for attempt in used for act in _acts_of(record, attempt, chosen.act)]
    if not found:
        raise StreamError(
            f"{record.path}: trial {chosen.trial} has {count(len(used[0].acts), 'recording')}, none is {chosen.act}"
        )
    yield from found


def _acts_of(record: Record, attempt: RecordedAttempt, act: int | None) -> Iterator[_Act]:
    by_act: dict[int, list[Stream]] = {}
    for stream in streams_in(attempt):
        by_act.setdefault(stream.act, []).append(stream)
    for number, streams in by_act.items():
        if act in (None, number):
            again = f"_act{number}" if len(by_act) > 1 else ""
            yield _Act(f"{record.path.stem}_t{attempt.trial:03d}{again}", attempt, tuple(streams))
