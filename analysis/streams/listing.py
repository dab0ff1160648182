"""The streams of a session as rows and as a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from palpate.analysis.streams.alignment import describe_stream
from palpate.analysis.streams.recorded_streams import (
    StreamError,
    attempts_of,
    counting_attempts,
    streams_in,
)
from palpate.studies.sessions.record import Record
from palpate.studies.sessions.tables import session_name_of

Row = dict[str, Any]
TEXTS = ("stimulus", "stream", "unit", "clock", "calibration")
SILENT = ("-", "host")


def list_streams(record: Record, trial: int | None = None) -> Row:
    """Return the streams of the attempt of each trial that counts, and a line for each other attempt.

    Raises StreamError for a trial that the session does not have.
    """
    attempts = [attempt for attempt in attempts_of(record) if trial in (None, attempt.trial)]
    if trial is not None and not attempts:
        raise StreamError(f"{record.path}: trial {trial} was not presented in this session")
    used = counting_attempts(attempts)
    streams: list[Row] = []
    for attempt in used.values():
        try:
            streams += [
                {
                    "trial": stream.trial, "attempt": stream.attempt, "act": stream.act,
                    "stimulus": attempt.stimulus_of(stream.act), "stream": stream.name, **describe_stream(stream),
                }
                for stream in streams_in(attempt)
            ]  # fmt: skip
        except StreamError as error:
            raise StreamError(f"{record.path}: {error}") from error
    not_used = []
    for attempt in attempts:
        if attempt.acts and attempt not in used.values():
            reason = "a later one counts" if attempt.usable else attempt.ending
            not_used.append(f"trial {attempt.trial}, attempt {attempt.number}: {reason}; its streams are not used")
    return {
        "ledger": str(record.path),
        "session": session_name_of(record.header),
        "streams": streams,
        "not_used": not_used,
    }


def format_lines(rows: Sequence[Row]) -> list[str]:
    """Return the rows as lines of text with a heading, without columns that are empty for every stream."""
    if not rows:
        return []
    cells = []
    for row in rows:
        timing = row["timing"] or {}
        measured = timing.get("drift_ppm") is not None
        error, stamps = timing.get("drift_error_ppm"), row["stamps"] or {}
        # By how much even the promptest samples came after their own stamps, where those are by the host's clock.
        late_s = stamps.get("late_s")
        cells.append(
            {
                "trial": f"{row['trial']}" + (f".{row['act']}" if row["act"] > 1 else ""),
                "stimulus": row["stimulus"],
                "stream": row["stream"],
                "unit": ", ".join(dict.fromkeys(row["units"])),
                "samples": f"{row['samples']:,}",
                "Hz": f"{row['rate_hz']:g}" if timing else "noted",
                "measured Hz": f"{timing['rate_hz']:.4f}" if measured else "-",
                "drift ppm": f"{timing['drift_ppm']:+.2f}" + (f" +-{error:.2f}" if error is not None else "")
                if measured
                else "-",
                "late ms": "-" if late_s is None else f"{1e3 * late_s:.3f} +-{1e3 * stamps['late_error_s']:.3f}",
                "lost": f"{row['lost']:,}",
                "gaps": f"{row['gap_count']:,}",
                "seconds": f"{row['seconds']:.2f}" if timing else "-",
                "clock": row["clock"],
                "calibration": row["calibration"] or "-",
            }
        )
    columns = [name for name in cells[0] if any(row_cells[name] not in SILENT for row_cells in cells)]
    widths = {name: max(len(name), *(len(row_cells[name]) for row_cells in cells)) for name in columns}
    return [
        "  ".join(
            (str.ljust if name in TEXTS else str.rjust)(row_cells[name], widths[name]) for name in columns
        ).rstrip()
        for row_cells in [{name: name for name in columns}, *cells]
    ]
