"""Streams as files: aligned columns in one CSV, or each stream as recorded; beside them what they are, as JSON."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from palpate.analysis.streams.alignment import Together, described
from palpate.analysis.streams.reading import RecordedAttempt
from palpate.analysis.streams.recorded import Stream
from palpate.protocols.canonical import json_text
from palpate.protocols.extras import installed_version
from palpate.protocols.files import file_sha256, open_text, write_text
from palpate.signals.arrays import Array
from palpate.studies.record import Record

DIGITS = 9
"""A float32 comes back from so many."""
ROWS = 4096
"""Rows that are turned into text at a time."""


def ledger_account(record: Record, attempts: Sequence[RecordedAttempt]) -> dict[str, Any]:
    """Which ledger it was, so that an export can be traced to it, and what became of every attempt."""
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
            {"trial": a.trial, "attempt": a.number, "ended": a.told, "recordings": len(a.acts)} for a in attempts
        ],
    }  # fmt: skip


def write_aligned(path: Path, together: Together, about: Mapping[str, Any]) -> list[Path]:
    """The CSV (time_s in seconds of session time, STREAM_CHANNEL columns; empty where unknown), and its JSON."""
    columns = together.columns()
    table = np.column_stack(list(columns.values()))
    grid_hz = together.wanted.grid_hz
    grid = {"rate_hz": grid_hz, "first_s": float(table[0, 0]), "last_s": float(table[-1, 0]), "rows": len(table)}
    account = {**about, "grid": grid, "time_s": "seconds since the session began", "streams": together.account()}
    account |= {"hinge": together.hinge.account()} if together.hinge else {}
    _write(path, list(columns), (table[at : at + ROWS] for at in range(0, len(table), ROWS)), _time_format(grid_hz))
    return [path, _write_json(path.with_suffix(".json"), account)]


def write_raw(folder: Path, stem: str, streams: Sequence[Stream], about: Mapping[str, Any]) -> list[Path]:
    """Each stream's samples as they are, numbered, with times by its clock; one JSON for all."""
    files, accounts = [], {}
    for stream in streams:
        path = folder / f"{stem}_{stream.name}.csv"
        names = ["sample"] if stream.noted else ["sample", "time_s"]
        _write(path, [*names, *stream.channels], _raw_rows(stream), "%d" if stream.noted else "%d,%.9f")
        files.append(path)
        accounts[stream.name] = {**described(stream), "file": path.name}
    return [*files, _write_json(folder / f"{stem}.json", {**about, "raw": True, "streams": accounts})]


def _raw_rows(stream: Stream) -> Iterable[Array]:
    for numbers, values in stream.pieces():
        times = [] if stream.noted else [stream.timing.t0_s + numbers / stream.timing.rate_hz]
        yield np.column_stack([numbers, *times, values])


def _time_format(rate_hz: float) -> str:
    """Microseconds where the grid's steps are whole ones."""
    return "%.6f" if (1e6 / rate_hz).is_integer() else "%.9f"


def _write(path: Path, header: Sequence[str], tables: Iterable[Array], leading: str) -> None:
    """Rows of numbers; `leading` formats the first columns. The file stands under its name when it is whole."""
    columns = len(header) - leading.count("%")
    form = ",".join([leading, *[f"%.{DIGITS}g"] * columns]) + "\n"
    with open_text(path) as file:
        file.write(",".join(header) + "\n")
        for table in tables:
            file.write("".join(form % tuple(row) for row in table.tolist()).replace("nan", ""))


def _write_json(path: Path, account: Mapping[str, Any]) -> Path:
    return write_text(path, json_text(account, indent=1))
