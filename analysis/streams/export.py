"""The selection of streams of a ledger for export, and the files that are written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.analysis.streams.alignment import AlignedStreams, AlignmentOptions, align_streams, describe_stream
from palpate.analysis.streams.recorded_streams import (
    RecordedAttempt,
    Stream,
    StreamError,
    attempts_of,
    counting_attempts,
    streams_in,
    streams_of,
)
from palpate.protocols.canonical import json_text
from palpate.protocols.extras import installed_version
from palpate.protocols.files import file_sha256, open_text, staged_files, write_text
from palpate.protocols.wording import count
from palpate.signals.arrays import Array
from palpate.studies.sessions.record import Record

DIGITS = 9
"""The number of digits that restore a float32."""
ROWS = 4096
"""The number of rows that are converted to text at a time."""


@dataclass(frozen=True)
class ExportSelection:
    """The selection: a trial or all, its attempt that counts or another, one act of it or all; a door's hinge.

    Streams in `by_stamps` are timed by their device's stamps instead of by their arrivals.
    """

    trial: int | None = None
    attempt: int | None = None
    act: int | None = None
    hinge: str | None = None
    by_stamps: tuple[str, ...] = ()

    @property
    def single(self) -> bool:
        """Whether a single recording is selected."""
        return self.trial is not None


@dataclass(frozen=True)
class _Act:
    """Streams that were recorded together, and the base name of their files."""

    stem: str
    attempt: RecordedAttempt
    streams: tuple[Stream, ...]

    def about(self, of_ledger: dict[str, Any]) -> dict[str, Any]:
        return {
            **of_ledger, "trial": self.attempt.trial, "attempt": self.attempt.number, "counts": self.attempt.usable,
            "act": self.streams[0].act, "stimulus": self.attempt.stimulus_of(self.streams[0].act),
        }  # fmt: skip


def export(record: Record, selection: ExportSelection, out: Path, options: AlignmentOptions | None) -> list[Path]:
    """Write the selected streams, aligned by `options` or raw without them; return the paths.

    `out` is a CSV file for one aligned recording, else a folder, in which files are named LEDGER_tNNN. Recordings with
    only events (a form's marker) are not aligned; they are left out if there are others.

    Raises:
        StreamError: nothing to export, several recordings for one file, streams that cannot be aligned.
    """
    if (selection.attempt is not None or selection.act is not None) and not selection.single:
        raise StreamError("--attempt and --act choose among the recordings of one trial: name it with --trial")
    acts = _chosen_acts(record, selection)
    if options is not None and selection.act is None:
        acts = [act for act in acts if any(not stream.noted for stream in act.streams)] or acts
    into_file = out.suffix.lower() == ".csv" and not out.is_dir()
    if into_file and (options is None or len(acts) > 1):
        which = "--act" if selection.single else "--trial"
        several = f"there are {len(acts)}: choose one with {which}, or give a folder"
        advice = "raw streams have a file each: give a folder" if options is None else several
        raise StreamError(f"{out}: one file holds one aligned recording; {advice}")
    of_ledger = ledger_account(record, attempts_of(record))
    folder = out.parent if into_file else out
    with staged_files(folder) as draft:
        files: list[Path] = []
        for act in acts:
            path = draft / (out.name if into_file else f"{act.stem}.csv")
            files += _write_act(record, act, path, options, selection, of_ledger)
    return [folder / file.name for file in files]


def _write_act(
    record: Record,
    act: _Act,
    path: Path,
    options: AlignmentOptions | None,
    selection: ExportSelection,
    of_ledger: dict[str, Any],
) -> list[Path]:
    about = act.about(of_ledger)
    try:
        names = [stream.name for stream in act.streams]
        for name in selection.by_stamps:
            if name not in names:
                raise StreamError(
                    f"{act.streams[0].where}: there is no stream {name!r} beside it; there are: {', '.join(names)}"
                )
        streams = tuple(replace(stream, by_stamps=stream.name in selection.by_stamps) for stream in act.streams)
        for stream in streams:
            if stream.by_stamps:
                _ = stream.timing  # refuses it before anything is written
        if options is None:
            return write_raw(path.parent, act.stem, streams, about)
        return write_aligned(path, align_streams(streams, options, selection.hinge), about)
    except StreamError as error:
        raise StreamError(f"{record.path}: {error}") from error


def _chosen_acts(record: Record, selection: ExportSelection) -> list[_Act]:
    attempts = attempts_of(record)
    if selection.trial is not None:
        streams_of(record, selection.trial, selection.attempt)  # refuses what is not there
        attempts = tuple(
            attempt
            for attempt in attempts
            if attempt.trial == selection.trial and selection.attempt in (None, attempt.number)
        )
    used = list(counting_attempts(attempts).values()) if selection.attempt is None else list(attempts)
    if not used:
        raise StreamError(f"{record.path}: no attempt that counts holds streams")
    acts: list[_Act] = []
    for attempt in used:
        by_act: dict[int, list[Stream]] = {}
        for stream in streams_in(attempt):
            by_act.setdefault(stream.act, []).append(stream)
        for number, streams in by_act.items():
            if selection.act in (None, number):
                again = f"_act{number}" if len(by_act) > 1 else ""
                acts.append(_Act(f"{record.path.stem}_t{attempt.trial:03d}{again}", attempt, tuple(streams)))
    if not acts:
        raise StreamError(
            f"{record.path}: trial {selection.trial} has {count(len(used[0].acts), 'recording')},"
            f" none is {selection.act}"
        )
    return acts


def ledger_account(record: Record, attempts: Sequence[RecordedAttempt]) -> dict[str, Any]:
    """Return the identity of the ledger, to trace an export to it, and the outcome of every attempt."""
    header = record.header
    return {
        "ledger": record.path.name,
        "ledger_sha256": file_sha256(record.path),
        "ledger_head": record.head,
        "study": header["study"]["study"],
        "participant": header["participant"],
        "session": header["session"],
        "simulated": header["rig"].get("kind") == "simulated" or bool(header["rig"].get("twins")),
        "palpate": installed_version("palpate") or "not installed",
        "attempts": [
            {"trial": a.trial, "attempt": a.number, "ended": a.ending, "recordings": len(a.acts)} for a in attempts
        ],
    }  # fmt: skip


def write_aligned(path: Path, together: AlignedStreams, about: Mapping[str, Any]) -> list[Path]:
    """Write the CSV (time_s in seconds of session time, STREAM_CHANNEL columns; empty if unknown) and its JSON file."""
    columns = together.columns()
    table = np.column_stack(list(columns.values()))
    grid_hz = together.options.grid_hz
    grid = {"rate_hz": grid_hz, "first_s": float(table[0, 0]), "last_s": float(table[-1, 0]), "rows": len(table)}
    account = {**about, "grid": grid, "time_s": "seconds since the session began", "streams": together.account()}
    account |= {"hinge": together.hinge.account()} if together.hinge else {}
    times = "%.6f" if (1e6 / grid_hz).is_integer() else "%.9f"  # microseconds where the grid's steps are whole ones
    _write(path, list(columns), (table[at : at + ROWS] for at in range(0, len(table), ROWS)), times)
    return [path, _write_json(path.with_suffix(".json"), account)]


def write_raw(folder: Path, stem: str, streams: Sequence[Stream], about: Mapping[str, Any]) -> list[Path]:
    """Write each stream's samples unchanged, numbered, with times by its clock, and one JSON file for all."""
    files, accounts = [], {}
    for stream in streams:
        path = folder / f"{stem}_{stream.name}.csv"
        names = ["sample"] if stream.noted else ["sample", "time_s"]
        _write(path, [*names, *stream.channels], _raw_rows(stream), "%d" if stream.noted else "%d,%.9f")
        files.append(path)
        accounts[stream.name] = {**describe_stream(stream), "file": path.name}
    return [*files, _write_json(folder / f"{stem}.json", {**about, "raw": True, "streams": accounts})]


def _raw_rows(stream: Stream) -> Iterable[Array]:
    for numbers, values in stream.pieces():
        times = [] if stream.noted else [stream.timing.t0_s + numbers / stream.timing.rate_hz]
        yield np.column_stack([numbers, *times, values])


def _write(path: Path, header: Sequence[str], tables: Iterable[Array], leading: str) -> None:
    """Write rows of numbers atomically; `leading` formats the first columns."""
    columns = len(header) - leading.count("%")
    form = ",".join([leading, *[f"%.{DIGITS}g"] * columns]) + "\n"
    with open_text(path) as file:
        file.write(",".join(header) + "\n")
        for table in tables:
            file.write("".join(form % tuple(row) for row in table.tolist()).replace("nan", ""))


def _write_json(path: Path, account: Mapping[str, Any]) -> Path:
    return write_text(path, json_text(account, indent=1))
