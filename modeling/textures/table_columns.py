"""The columns of a CSV table as numbers, by the names and units in its header."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from modeling.textures.recording import Array, TextureDataError
from modeling.textures.units import PLAIN, UNITS, scale_of_unit

NAMES = {
    "time": "time", "t": "time", "acceleration": "acceleration", "acc": "acceleration", "accel": "acceleration",
    "ax": "acceleration", "ay": "acceleration", "az": "acceleration", "speed": "speed", "velocity": "speed",
    "x": "position", "y": "position", "z": "position", "force": "force", "fx": "force", "fy": "force", "fz": "force",
}  # fmt: skip
"""What a column of that name is; small and capital letters are the same."""
ONE = {"t": "time", "acc": "acceleration", "accel": "acceleration", "velocity": "speed"}
"""Names that mean another."""
HEADER = re.compile(r"\s*(?P<name>[A-Za-z]+)\s*(?:[\[(](?P<within>[^\])]*)[\])]|_(?P<after>[A-Za-z0-9_/^²]+))?\s*")
SEPARATORS = ",;\t"
DECIMALS = 1000
"""So many rows tell how finely times are written."""


@dataclass(frozen=True)
class Column:
    """Values as they stand, what turns them into our units, which cells are empty, and how finely they are written."""

    values: Array
    scale: float
    empty: NDArray[np.bool_]
    written: float = 0.0


@dataclass(frozen=True)
class Table:
    """The columns that are known, by name; `first_line` is that of the first row."""

    where: str
    columns: dict[str, Column]
    rows: int
    first_line: int
    notes: tuple[str, ...]


def read_columns(file: Path) -> Table:
    """The columns of a table: UTF-8, separated by commas, semicolons or tabs, decimal points, one header.

    A cell that is empty is not a sample; "nan" is one that a sensor failed at, and is not finite. Raises
    TextureDataError with file and line.
    """
    lines = _lines(file)
    header, *rows = csv.reader(lines, delimiter=_separator(lines[0]))
    named, notes = _named(file, header)
    if not rows:
        raise TextureDataError(f"{file}: no row stands under the header")
    for number, row in enumerate(rows, start=2):
        if len(row) != len(header):
            raise TextureDataError(f"{file}, line {number}: {len(row)} cells found, {len(header)} are expected")
    cells = list(zip(*rows, strict=True))
    columns = {name: _column(file, name, cells[place], scale) for name, (place, scale) in named.items()}
    return Table(str(file), columns, len(rows), 2, notes)


def _lines(file: Path) -> list[str]:
    try:
        text = file.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise TextureDataError(f"{file}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError as error:
        raise TextureDataError(f"{file}: byte {error.start} is not UTF-8; save the table as UTF-8") from None
    lines = text.rstrip().splitlines()
    if not lines or not lines[0].strip():
        raise TextureDataError(f"{file}: empty; a header and rows are expected")
    return lines


def _separator(header: str) -> str:
    return max(SEPARATORS, key=header.count)


def _named(file: Path, header: Sequence[str]) -> tuple[dict[str, tuple[int, float]], tuple[str, ...]]:
    """Place and scale of each known column, and notes on units that are taken as given."""
    found: dict[str, tuple[int, float]] = {}
    plain = []
    for place, text in enumerate(header):
        read = _known(text)
        if read is None:
            continue
        name, what, unit = read
        if name in found:
            raise TextureDataError(f"{file}, line 1: the column {name!r} stands there twice")
        if unit is None:
            plain.append(f"{name} in {PLAIN[what]}")
        found[name] = place, scale_of_unit(what, unit or PLAIN[what], f"{file}, line 1, column {text.strip()!r}")
    notes = (f"units that the table does not say: {', '.join(plain)}",) if plain else ()
    return found, notes


def _known(text: str) -> tuple[str, str, str | None] | None:
    """Name, kind and unit of a header's cell; None where it is no column of ours."""
    match = HEADER.fullmatch(text)
    if match is None:
        return None
    name = match["name"].lower()
    what = NAMES.get(name)
    after = match["after"]
    if what is None or (after is not None and after not in UNITS[what]):
        return None
    return ONE.get(name, name), what, match["within"] if match["within"] is not None else after


def _column(file: Path, name: str, cells: Sequence[str], scale: float) -> Column:
    empty = np.array([not cell or cell.isspace() for cell in cells])
    try:
        values = np.array([cell if cell.strip() else "nan" for cell in cells], dtype=object).astype(np.float64)
    except ValueError:
        raise TextureDataError(_no_number(file, name, cells)) from None
    bad = np.flatnonzero(~np.isfinite(values) & ~empty)
    if bad.size:
        line = int(bad[0]) + 2
        raise TextureDataError(
            f"{file}, line {line}: {name} is {cells[bad[0]].strip()!r}, a finite number is expected; leave the cell"
            " empty where nothing was sampled"
        )
    return Column(values, scale, empty, _written(cells[:DECIMALS]))


def _no_number(file: Path, name: str, cells: Sequence[str]) -> str:
    for line, cell in enumerate(cells, start=2):
        try:
            float(cell or "0")
        except ValueError:
            comma = "; decimal commas are not read" if "," in cell else ""
            return f"{file}, line {line}: {name} is {cell!r}, a number is expected{comma}"
    return f"{file}: {name}: a number is expected"


def _written(cells: Sequence[str]) -> float:
    """The last place that numbers are written to; 0 where an exponent hides it."""
    if any("e" in cell.lower() for cell in cells):
        return 0.0
    places: Iterator[int] = (len(cell.strip().partition(".")[2]) for cell in cells)
    return float(10.0 ** -max(places, default=0))
