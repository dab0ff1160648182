"""Recordings in BIDS: positions as motion data, other streams as continuous recordings; lost samples are n/a.

A stream is written piece by piece, so that an hour of it needs no more memory than a second.
"""

from __future__ import annotations

import gzip
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from palpate.analysis.exporting.description import json_for_people
from palpate.analysis.exporting.guard import Guard
from palpate.analysis.exporting.source import SharedSession, Source
from palpate.analysis.exporting.tabular import NOT_AVAILABLE, ExportRefused, cell_text
from palpate.analysis.streams.recorded_streams import (
    Gap,
    RecordedAttempt,
    Stream,
    attempts_of,
    counting_attempts,
    streams_in,
)
from palpate.protocols.files import open_bytes, write_text
from palpate.protocols.wording import count
from palpate.signals.arrays import Array
from palpate.studies.sessions.record import read

EVENTS = {
    "onset": {"Description": "Since the recording began.", "Units": "s"},
    "duration": {"Description": "How long it lasts.", "Units": "s"},
    "trial_type": {"Description": "What it is.", "Levels": {"recording": "the recording as a whole",
                                                            "gap": "samples were lost: they read n/a"}},
    "session_onset": {"Description": "Since the session began, as onset in the table of its trials.", "Units": "s"},
    "trial": {"Description": "Number of the trial in the session, from 1."},
    "attempt": {"Description": "Which attempt at the trial."},
    "reason": {"Description": "Why samples were lost, or how many values of the recording were not finite."},
}  # fmt: skip
LENGTHS = frozenset({"m", "cm", "mm", "um"})
AXES = ("x", "y", "z")
MANY_GAPS = 200
ROWS = 4096


@dataclass(frozen=True)
class RecordingCounts:
    """The numbers of recordings that were written, that have gaps, that could not be written, and that do not count."""

    files: int = 0
    gappy: int = 0
    lost: int = 0
    noted: int = 0
    unused: int = 0

    def __add__(self, other: RecordingCounts) -> RecordingCounts:
        mine, theirs = vars(self), vars(other)
        return RecordingCounts(**{name: mine[name] + theirs[name] for name in mine})

    def notes(self) -> list[str]:
        """Return lines for the README."""
        if not self.files + self.noted + self.unused:
            return []
        lines = [
            f"`*_physio.tsv.gz`, `*_motion.tsv`: {count(self.files, 'recording')}; `run-` is the number of the trial,"
            " `acq-act02` the second recording of a trial. Times (StartTime; session_onset in motion events) count"
            " from the start of the session, as onset does."
        ]
        if self.gappy:
            lines.append(
                f"{count(self.lost, 'sample')} lost, with gaps in {count(self.gappy, 'recording')}; each reads n/a"
                " in its place, so that times hold. The gaps stand in the recording's JSON file, or its event table."
            )
        if self.noted:
            lines.append(
                f"{count(self.noted, 'stream')} of things that were noted as they happened: not here, since a recording"
                " has a fixed rate in BIDS. `palpate streams export --raw` writes them."
            )
        if self.unused:
            lines.append(
                f"Attempts at trials that were repeated, left or faulted: {self.unused}; their recordings are not here."
            )
        return lines


@dataclass(frozen=True)
class _Place:
    """The place of a session's recordings, and the metadata that they share."""

    draft: Path
    session: SharedSession
    task: str
    attempt: RecordedAttempt

    def path(self, stream: Stream, folder: str, before: str, after: str) -> Path:
        act = f"_acq-act{stream.act:02d}" if len(self.attempt.acts) > 1 else ""
        run = f"_run-{stream.trial:03d}"
        return (
            self.draft
            / session_folder(self.session)
            / folder
            / f"{file_stem(self.session)}_task-{self.task}{before}{act}{run}{after}"
        )

    def about(self, stream: Stream, not_finite: int) -> dict[str, Any]:
        """Return the metadata in a recording's JSON file; gaps are named by the number of the row, from 0."""
        entries = {
            "StreamName": stream.name, "Trial": stream.trial, "Attempt": stream.attempt, "Recording": stream.act,
            "Stimulus": self.attempt.stimulus_of(stream.act), "NominalRate": stream.rate_hz,
            "SamplesLost": stream.lost,
        }  # fmt: skip
        gaps = [{"FirstRow": gap.first, "Rows": gap.lost, "Reason": gap.why} for gap in stream.gaps[:MANY_GAPS]]
        return entries | ({"Gaps": gaps} if gaps else {}) | ({"NotFinite": not_finite} if not_finite else {})


def write_recordings(source: Source, session: SharedSession, task: str, draft: Path, guard: Guard) -> RecordingCounts:
    """Write every stream of the attempts that count.

    Raises ExportRefused where the ledger is missing or another one, StreamError on streams whose blocks do not fit
    together.
    """
    path = source.lab / "sessions" / session.row["file"]
    if not path.is_file():
        raise ExportRefused(
            f"{path}: the recordings of session {session.name} lie in this file, which is not there; name its lab with"
            " --lab, or leave recordings out with --no-recordings"
        )
    record = read(path)
    if record.head != session.row["head_hash"]:
        raise ExportRefused(f"{path}: is not the session that was collected as {session.name}; collect again")
    attempts = attempts_of(record)
    used = list(counting_attempts(attempts).values())
    unused = sum(1 for attempt in attempts if attempt.acts and attempt not in used)
    counts = RecordingCounts(unused=unused)
    for attempt in used:
        streams = streams_in(attempt)
        labels = [(stream.act, label(stream.name)) for stream in streams]
        for place, (stream, name) in enumerate(zip(streams, labels, strict=True)):
            if name in labels[:place]:
                raise ExportRefused(
                    f"{stream.where}: another one has the same name in BIDS ({name[1]}); use --no-recordings"
                )
        for stream in streams:
            guard.demand_columns(f"stream {stream.name}", [stream.name, *stream.channels])
            if stream.noted:
                counts += RecordingCounts(noted=1)
                continue
            is_motion = tuple(stream.channels) == AXES and set(stream.units) <= LENGTHS
            write = _write_motion if is_motion else _write_physio
            write(_Place(draft, session, task, attempt), stream)
            counts += RecordingCounts(files=1, gappy=bool(stream.gaps), lost=stream.lost)
    return counts


def _write_physio(place: _Place, stream: Stream) -> None:
    path = place.path(stream, "beh", "", f"_recording-{label(stream.name)}_physio.tsv.gz")
    with _open_gzip(path) as file:
        not_finite = sum(_write_rows(file, piece) for _, piece in _pieces(stream)) - _lost_cells(stream)
    columns = {name: {"Description": f"Channel {name} of the stream {stream.name}.", "Units": unit}
               for name, unit in zip(stream.channels, stream.units, strict=True)}  # fmt: skip
    write_text(path.with_name(path.name.replace(".tsv.gz", ".json")), json_for_people({
        "SamplingFrequency": stream.timing.rate_hz, "StartTime": stream.timing.t0_s, "Columns": list(stream.channels),
        "PhysioType": "generic", **place.about(stream, not_finite), **columns,
    }))  # fmt: skip


def _write_motion(place: _Place, stream: Stream) -> None:
    """Write a motion file, and beside it a table of events with the start and the gaps, which the file cannot hold."""
    before = f"_tracksys-{label(stream.name)}"
    path = place.path(stream, "motion", before, "_motion.tsv")
    rate = stream.timing.rate_hz
    with open_bytes(path) as file:
        not_finite = sum(
            _write_rows(file, np.column_stack([piece, (first + np.arange(len(piece))) / rate]))
            for first, piece in _pieces(stream)
        ) - _lost_cells(stream)
    write_text(place.path(stream, "motion", before, "_channels.tsv"), _channels(stream))
    write_text(place.path(stream, "motion", before, "_events.tsv"), _events(stream, not_finite))
    write_text(place.draft / f"task-{place.task}{before}_events.json", json_for_people(EVENTS))
    write_text(path.with_suffix(".json"), json_for_people({
        "TaskName": place.session.row["study"], "SamplingFrequency": stream.rate_hz, "SamplingFrequencyEffective": rate,
        "TrackingSystemName": stream.name, "TrackedPointsCount": 1, "MotionChannelCount": 4, "POSChannelCount": 3,
        "LATENCYChannelCount": 1, "MissingValues": NOT_AVAILABLE,
    }))  # fmt: skip


def _events(stream: Stream, not_finite: int) -> str:
    """Return a table of events: the whole recording with its start in the session, then each gap."""
    rate = stream.timing.rate_hz
    rows = max(stream.blocks[-1].first + stream.blocks[-1].count, *(gap.first + gap.lost for gap in stream.gaps), 0)
    whole = f"{not_finite} values were not finite" if not_finite else NOT_AVAILABLE
    lines = [tuple(EVENTS), (0, rows / rate, "recording", stream.timing.t0_s, stream.trial, stream.attempt, whole)]
    lines += [
        (gap.first / rate, gap.lost / rate, "gap", stream.timing.t0_s + gap.first / rate, stream.trial, stream.attempt,
         " ".join(gap.why.split()) or NOT_AVAILABLE)
        for gap in stream.gaps
    ]  # fmt: skip
    return "".join("\t".join(cell_text(value) for value in line) + "\n" for line in lines)


def _channels(stream: Stream) -> str:
    """Return a table with one row for each column of the motion file."""
    lines = [("name", "component", "type", "tracked_point", "units")]
    lines += [(axis, axis, "POS", stream.name, unit) for axis, unit in zip(stream.channels, stream.units, strict=True)]
    lines += [("latency", NOT_AVAILABLE, "LATENCY", NOT_AVAILABLE, "s")]
    return "".join("\t".join(line) + "\n" for line in lines)


def _pieces(stream: Stream) -> Iterator[tuple[int, Array]]:
    """Yield the number of each piece's first row, and its rows: samples from number 0 on, NaN for lost ones."""
    expected, width = 0, len(stream.channels)
    for numbers, values in stream.pieces():
        yield from _missing_rows(expected, int(numbers[0]), width)
        yield int(numbers[0]), values
        expected = int(numbers[-1]) + 1
    after: Sequence[Gap] = [gap for gap in stream.gaps if gap.first >= expected]
    yield from _missing_rows(expected, max((gap.first + gap.lost for gap in after), default=expected), width)


def _missing_rows(first: int, end: int, width: int) -> Iterator[tuple[int, Array]]:
    for start in range(first, end, ROWS):
        yield start, np.full((min(ROWS, end - start), width), np.nan)


def _lost_cells(stream: Stream) -> int:
    """Return how many cells are n/a because their samples were lost."""
    return stream.lost * len(stream.channels)


def _write_rows(file: IO[bytes], rows: Array) -> int:
    """Write rows with nine digits, which restore a float32; return how many values are n/a since not finite."""
    not_finite = int(np.count_nonzero(~np.isfinite(rows)))
    form = "\t".join(["%.9g"] * rows.shape[1]) + "\n"
    for start in range(0, len(rows), ROWS):
        part = np.where(np.isinf(rows[start : start + ROWS]), np.nan, rows[start : start + ROWS])
        file.write("".join(form % tuple(row) for row in part.tolist()).replace("nan", NOT_AVAILABLE).encode())
    return not_finite


@contextmanager
def _open_gzip(path: Path) -> Iterator[IO[bytes]]:
    """Open a gzip file without name and time in its header, so that equal data give equal bytes."""
    with open_bytes(path) as raw, gzip.GzipFile("", "wb", compresslevel=6, fileobj=raw, mtime=0) as file:
        yield file  # type: ignore[misc]


def label(name: str) -> str:
    """Return a name in the form that BIDS allows within a file name: letters and digits."""
    return re.sub(r"[^A-Za-z0-9]", "", name)


def session_folder(session: SharedSession) -> str:
    """Return a session's folder, such as sub-P001/ses-01."""
    return f"sub-{session.participant}/ses-{session.number:02d}"


def file_stem(session: SharedSession) -> str:
    """Return the beginning of a session's file names, such as sub-P001_ses-01."""
    return session_folder(session).replace("/", "_")
