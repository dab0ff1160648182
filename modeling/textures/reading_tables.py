"""Textures from text tables: time, acceleration, speed and force at any rate, one file for each texture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from palpate.modeling.textures.preparing import UP, Touched, prepared
from palpate.modeling.textures.rates import Sampled
from palpate.modeling.textures.recording import Recording, TextureDataError
from palpate.modeling.textures.table_columns import Column, Table, read_columns
from palpate.protocols.files import file_sha256
from palpate.signals.arrays import Array

KINDS = (".csv", ".tsv", ".txt")
CHANNELS = {
    "acceleration": (
        ("acceleration",), ("ax", "ay", "az"), ("ax", "ay"), ("ax", "az"), ("ay", "az"), ("ax",), ("ay",), ("az",),
    ),
    "speed": (("speed",),),
    "position": (("x", "y", "z"), ("x", "y")),
    "force": (("force",), ("fx", "fy", "fz"), ("fz",)),
}  # fmt: skip
"""The sets of columns of each signal; the first complete set counts."""
COARSE = 0.01
"""The share of neighbours with equal times above which times are too coarse for single steps."""
SLOWEST_MM_S = 1.0
"""The peak speed below which a speed without a unit is in m/s."""


@dataclass(frozen=True)
class Held:
    """Values that a table does not have and its reader knows: a rate without times, a constant speed and force."""

    rate_hz: float | None = None
    speed_mm_s: float | None = None
    force_N: float | None = None


def read_tables(
    paths: Path | Sequence[Path], *, held: Held | None = None, normal: tuple[float, float, float] = UP,
    remove_hum: bool = True,
) -> tuple[Recording, ...]:  # fmt: skip
    """Return the textures in tables, or in all of a folder, named as the files are; by name.

    Columns: `time` (or t, t_s); `acceleration`, or any of ax, ay, az; `speed`, or positions x, y (, z); `force`, or fz,
    or fx, fy, fz; others are ignored. The header may give a unit, as in `force (mN)`, `ax [g]` or `time_ms`; otherwise
    numbers are in s, m/s^2, mm/s, mm and N. An empty cell is no sample, so that signals of different rates share a
    table. `held` replaces missing columns. Raises TextureDataError, with file and line, on an unreadable table, and on
    signals that no texture can be learned from.
    """
    return tuple(
        prepared(file.stem, file.stem.replace("_", " "), [touched(file, held or Held(), normal)], remove_hum)
        for file in files_in([paths] if isinstance(paths, Path) else paths)
    )


def files_in(paths: Sequence[Path]) -> list[Path]:
    """Return the tables, and those in folders. Raises TextureDataError for none, or for two of one name."""
    files = list(_tables_in(paths))
    names = [file.stem for file in files]
    for name in names:
        if names.count(name) > 1:
            raise TextureDataError(f"two files are named {name!r}: a texture has the name of its file, and one file")
    return files


def _tables_in(paths: Sequence[Path]) -> Iterator[Path]:
    for path in paths:
        if path.is_dir():
            tables = sorted(
                entry
                for entry in path.iterdir()
                if entry.suffix.lower() in KINDS and (entry.name[0] != "." and not entry.is_dir())
            )
            if not tables:
                raise TextureDataError(f"{path}: no table in it; files named {', '.join(KINDS)} are expected")
            yield from tables
        elif path.is_file():
            yield path
        else:
            raise TextureDataError(f"{path}: no such file or folder; tables of textures are expected")


def touched(file: Path, held: Held, normal: tuple[float, float, float] = UP) -> Touched:
    """Return the recorded signals of one texture, in m/s^2, N, and mm/s or mm. Raises TextureDataError."""
    table = read_columns(file)
    times_s, written_s = _times(table, held)
    signals = {what: _signal(what, sets, table, times_s, written_s) for what, sets in CHANNELS.items()}
    # speed and force that the table lacks and that the reader knows to have been held
    like = signals["acceleration"]
    given: dict[str, Sampled] = {}
    notes = []
    for what, value, unit in (("speed", held.speed_mm_s, "mm/s"), ("force", held.force_N, "N")):
        is_missing = signals[what] is None and not (what == "speed" and signals["position"] is not None)
        if value is not None and is_missing and like is not None:
            if not (np.isfinite(value) and value >= 0):
                raise TextureDataError(f"{file}: a {what} of {value} {unit}: a finite number of 0 or more is expected")
            given[what] = replace(like, what=what, values=np.full((len(like.times_s), 1), float(value)))
            notes.append(f"{what} was not recorded: it is given as {value:g} {unit} throughout")
    every = {**signals, **given}
    acceleration, force = every["acceleration"], every["force"]
    if acceleration is None or force is None or (every["speed"] is None and every["position"] is None):
        missing = [name for name in ("acceleration", "force") if every[name] is None]
        missing += ["speed"] if every["speed"] is None and every["position"] is None else []
        raise TextureDataError(
            f"{file}: no column for {' and '.join(missing)} among {_column_names(table)}; expected are time,"
            " acceleration (or ax, ay, az), speed (or x, y, z) and force (or fx, fy, fz); a speed or force that was"
            " constant and not recorded can be given instead (--speed-mm-s, --force-n)"
        )
    position = None if every["speed"] is not None else every["position"]
    return Touched(
        str(file), acceleration, force, every["speed"], position, normal,
        (f"{file.name} {file_sha256(file)}",), (*table.notes, *notes),
    )  # fmt: skip


def _times(table: Table, held: Held) -> tuple[Array, float]:
    """Return the time of each row in s, (n,), and the rounding of the written times."""
    time = table.columns.get("time")
    if time is not None:
        if not np.isfinite(time.values).all():
            line = table.lines[int(np.flatnonzero(~np.isfinite(time.values))[0])]
            raise TextureDataError(f"{table.where}, line {line}: the time is empty or not finite")
        # From the first row on: times since 1970 have too few digits left to tell one sample's place from another's.
        return (time.values - time.values[0]) * time.scale, time.written * time.scale
    if held.rate_hz is None:
        raise TextureDataError(
            f"{table.where}: no column of times (time, t or t_s) among {_column_names(table)}; without one the rate"
            " must be said (--rate-hz)"
        )
    if not (np.isfinite(held.rate_hz) and held.rate_hz > 0):
        raise TextureDataError(f"a rate of {held.rate_hz} Hz: a number above 0 is expected")
    return np.arange(len(table.lines)) / held.rate_hz, 0.0


def _signal(what: str, sets: Sequence[Sequence[str]], table: Table, times_s: Array, written_s: float) -> Sampled | None:
    """Return the samples of a signal, from the rows that have them; None without columns of it."""
    names = next((name_set for name_set in sets if all(name in table.columns for name in name_set)), None)
    if names is None:
        return None
    columns: list[Column] = [table.columns[name] for name in names]
    values = np.stack([column.values * column.scale for column in columns], axis=1)
    there = ~np.logical_or.reduce([column.empty for column in columns])
    values, times_s = values[there], times_s[there]
    where = f"{table.where}: column {names[0]}"
    if len(values) < 2:
        raise TextureDataError(f"{where}: {len(values)} samples; two or more are needed")
    column = columns[0]
    fastest = float(np.nanmax(np.abs(values), initial=0.0))
    if what == "speed" and not column.unit_given and 0 < fastest < SLOWEST_MM_S:
        raise TextureDataError(
            f"{where}: never above {fastest:.3g}, and no unit is given; is it in m/s? Write it in the header, as in"
            " 'speed (m/s)' or 'speed (mm/s)'"
        )
    # the step of the clock, from all samples, whatever is missing between them
    apart = np.diff(times_s)
    step_s = float(np.median(apart))
    coarse = step_s < 0.999 * written_s or float((apart <= 0).mean()) > COARSE
    steps = np.ones(len(apart)) if coarse else np.maximum(np.rint(apart / step_s), 1.0)
    step_s = float((times_s[-1] - times_s[0]) / steps.sum())
    if not step_s > 0:
        raise TextureDataError(f"{where}: its times do not rise: every sample needs its own")
    return Sampled(what, times_s, values, 1 / step_s, where, written_s)


def _column_names(table: Table) -> str:
    return ", ".join(repr(name) for name in table.header)
