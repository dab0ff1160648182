"""The columns of a text table as numbers in m/s^2, mm/s, mm, N and s, by the names and units in its header."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.textures.recording import TextureDataError
from palpate.protocols.tables import RecordError, TableFormat, commonest_delimiter, read_lines, split_records
from palpate.signals.arrays import Array

NAMES = (
    (re.compile("t|time|timestamp"), "time", "time"),
    (re.compile("acc|accel|acceleration"), "acceleration", "acceleration"),
    (re.compile("(?:a|acc|accel|acceleration)([xyz])"), "acceleration", "a"),
    (re.compile("speed|velocity|vel"), "speed", "speed"),
    (re.compile("(?:pos|position)?([xyz])"), "position", ""),
    (re.compile("force|normalforce|forcenormal|fn|forcen"), "force", "force"),
    (re.compile("(?:f|force)([xyz])"), "force", "f"),
)
"""The names of a column without case, spaces and underscores, its kind, and its own name without the axis."""
BRACKETS = re.compile(r"(?P<name>[^\[(]+)[\[(](?P<unit>.*)[\])]\s*")
BETWEEN = re.compile(r"[\s_/]+(?:in\s+)?")
"""The separators between a name and a unit without brackets."""
COMMENT = "#%"
"""Characters that begin a comment; the last comment above a table without a header is its header."""
SPACED = re.compile(r"[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?")
"""A cell of a header that is separated by spaces: a name, and a unit in brackets."""
DECIMALS = 1000
"""The number of rows that determine the rounding of times."""
FORMAT = TableFormat(
    error=TextureDataError,
    encoding=lambda wrong: f"{wrong.path}: byte {wrong.byte} is not UTF-8; save the table as UTF-8",
)
G_M_S2 = 9.80665
UNITS: dict[str, dict[str, float]] = {
    "acceleration": {"m/s^2": 1.0, "g": G_M_S2, "mg": 1e-3 * G_M_S2, "mm/s^2": 1e-3},
    "speed": {"mm/s": 1.0, "cm/s": 10.0, "m/s": 1000.0},
    "position": {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 1e-3},
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
}
PLAIN = {"acceleration": "m/s^2", "speed": "mm/s", "position": "mm", "force": "N", "time": "s"}
"""The unit of numbers without a unit."""
OTHERWISE = {"²": "2", "⁻": "-", "¹": "1", "µ": "u", "μ": "u", "_": "/", "per": "/"}
ALSO = {"m/s/s": "m/s2", "m/s/2": "m/s2", "sec": "s", "seconds": "s"}


@dataclass(frozen=True)
class Heading:
    """A known column: index, name and kind, the factor of its numbers, and whether the header gives its unit."""

    place: int
    name: str
    what: str
    scale: float
    unit_given: bool


@dataclass(frozen=True)
class Column:
    """The values of a column as written, their factor, which cells are empty, and the rounding of the numbers.

    `unit_given`: whether the table gives its unit.
    """

    values: Array
    scale: float
    empty: NDArray[np.bool_]
    written: float = 0.0
    unit_given: bool = True


@dataclass(frozen=True)
class Table:
    """The known columns by name, the header as written, and the line of each row."""

    where: str
    columns: dict[str, Column]
    header: tuple[str, ...]
    lines: Sequence[int]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Lines:
    """The header's line and number, the rows' lines and numbers, and the separator of their cells, "" for spaces."""

    header: str
    at: int
    rows: list[str]
    numbers: list[int]
    separator: str


def read_columns(file: Path) -> Table:
    """Return the columns of a table: UTF-8, separated by commas, semicolons, tabs or spaces, one header.

    Empty lines and those that begin with # or % are ignored, but a header may follow a #. Where commas are no
    separators, they may be decimal. An empty cell is no sample; "nan" is a failed sample, which is not finite. Raises
    TextureDataError with file and line.
    """
    lines = _lines(file)
    header = [cell.strip() for cell in _split(file, [lines.header], lines.separator, SPACED.findall)[0]]
    named = headings(f"{file}, line {lines.at}", header)
    plain = [f"{name} in {PLAIN[heading.what]}" for name, heading in named.items() if not heading.unit_given]
    notes = (f"units that the table does not say: {', '.join(plain)}",) if plain else ()
    whole = _of_numbers(lines, len(header))
    if whole is not None:
        first = _cells(file, lines, len(header), DECIMALS)
        known = np.zeros(len(whole), dtype=np.bool_)
        columns = {
            name: Column(
                whole[:, heading.place], heading.scale, known, _written(first[heading.place]), heading.unit_given
            )
            for name, heading in named.items()
        }
        return Table(str(file), columns, tuple(header), lines.numbers, notes)
    every = _cells(file, lines, len(header))
    cells = {name: every[heading.place] for name, heading in named.items()}
    if lines.separator != "," and any("," in cell for column in cells.values() for cell in column):
        if any("." in cell for column in cells.values() for cell in column):
            raise TextureDataError(
                f"{file}: points and commas in its numbers: which of them is the decimal sign is not clear"
            )
        cells = {name: tuple(cell.replace(",", ".") for cell in column) for name, column in cells.items()}
        notes = (*notes, "decimal commas")
    columns = {name: _column(file, heading, cells[name], lines.numbers) for name, heading in named.items()}
    return Table(str(file), columns, tuple(header), lines.numbers, notes)


def _of_numbers(lines: _Lines, count: int) -> Array | None:
    """Return the array (rows, count) of a table of finite numbers only, read at once; None for another table."""
    try:
        numbers = np.loadtxt(lines.rows, delimiter=lines.separator or None, comments=None, quotechar='"', ndmin=2)
    except ValueError:
        return None
    return numbers if numbers.shape == (len(lines.rows), count) and np.isfinite(numbers).all() else None


def _lines(file: Path) -> _Lines:
    above: list[tuple[int, str]] = []
    numbered: list[tuple[int, str]] = []
    for number, line in enumerate(read_lines(file, FORMAT), start=1):
        if line.lstrip()[:1] in COMMENT and line.strip():
            above += [] if numbered else [(number, line.lstrip(COMMENT + " "))]
        elif line.strip():
            numbered.append((number, line))
    if above and numbered and _numbers(numbered[0][1]):
        numbered.insert(0, above[-1])
    if not numbered:
        raise TextureDataError(f"{file}: empty; a header and rows are expected")
    (at, header), *rows = numbered
    if _numbers(header):
        raise TextureDataError(
            f"{file}, line {at}: numbers, where a header with the columns' names is expected, as in"
            " 'time,acceleration,speed,force'"
        )
    if not rows:
        raise TextureDataError(f"{file}: no row under the header")
    separator = commonest_delimiter(header)
    return _Lines(
        header, at, [line for _, line in rows], [number for number, _ in rows], separator if separator in header else ""
    )


def _numbers(line: str) -> bool:
    """Return whether a line holds only numbers."""
    try:
        return [float(cell) for cell in re.split(r"[,;\s]+", line.strip(" ,;\t"))] != []
    except ValueError:
        return False


def _cells(file: Path, lines: _Lines, count: int, most: int | None = None) -> list[tuple[str, ...]]:
    """Return the cells of each column in the first `most` rows, without empty ones beyond the header's columns."""
    rows = _split(file, lines.rows[:most], lines.separator, str.split)
    for place, row in enumerate(rows):
        while len(row) > count and not row[-1].strip():
            row.pop()
        if len(row) != count:
            raise TextureDataError(
                f"{file}, line {lines.numbers[place]}: {len(row)} cells found, {count} are expected, as in the header"
            )
    return list(zip(*rows, strict=True))


def _split(file: Path, lines: list[str], separator: str, spaced: Callable[[str], list[str]]) -> list[list[str]]:
    """Return the cells of lines; `spaced` splits lines that are separated by spaces."""
    if not separator:
        return [spaced(line) for line in lines]
    try:
        return [record.cells for record in split_records(lines, separator)]
    except RecordError as error:
        raise TextureDataError(f"{file}: {error}; is this a table?") from None


def _column(file: Path, heading: Heading, cells: Sequence[str], numbers: Sequence[int]) -> Column:
    empty = np.array([not cell or cell.isspace() for cell in cells])
    try:
        values = np.array([cell if cell.strip() else "nan" for cell in cells], dtype=object).astype(np.float64)
    except ValueError:
        line, cell = next(
            (number, cell.strip())
            for number, cell in zip(numbers, cells, strict=True)
            if cell.strip() and not is_number(cell)
        )
        unit = "; units stand in the header, as in 'time (ms)'" if line == numbers[0] else ""
        raise TextureDataError(f"{file}, line {line}: {heading.name} is {cell!r}, a number is expected{unit}") from None
    bad = np.flatnonzero(~np.isfinite(values) & ~empty)
    if bad.size:
        raise TextureDataError(
            f"{file}, line {numbers[bad[0]]}: {heading.name} is {cells[bad[0]].strip()!r}, a finite number is expected;"
            " leave the cell empty where nothing was sampled"
        )
    return Column(values, heading.scale, empty, _written(cells[:DECIMALS]), heading.unit_given)


def is_number(cell: str) -> bool:
    """Return whether a cell is a number, including nan and infinity."""
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _written(cells: Sequence[str]) -> float:
    """Return the last decimal place of written numbers; 0 for numbers with an exponent."""
    if any("e" in cell.lower() for cell in cells):
        return 0.0
    places: Iterator[int] = (len(cell.strip().partition(".")[2]) for cell in cells)
    return float(10.0 ** -max(places, default=0))


def headings(where: str, header: Sequence[str]) -> dict[str, Heading]:
    """Return the known columns by name. Raises TextureDataError on a name that appears twice, and an unknown unit."""
    result: dict[str, Heading] = {}
    for place, text in enumerate(header):
        read = _read(text)
        if read is None:
            continue
        name, what, unit = read
        if name in result:
            raise TextureDataError(f"{where}: the column {name!r} appears there twice")
        scale = scale_of_unit(what, unit or PLAIN[what], f"{where}, column {text.strip()!r}")
        result[name] = Heading(place, name, what, scale, bool(unit))
    return result


def _read(text: str) -> tuple[str, str, str] | None:
    """Return name, kind and unit ("" without a unit) of a header's cell; None for an unknown column."""
    bracketed = BRACKETS.fullmatch(text)
    if bracketed:
        known = _named(bracketed["name"])
        return (*known, bracketed["unit"].strip()) if known else None
    for cut in BETWEEN.finditer(text):
        known, unit = _named(text[: cut.start()]), text[cut.end() :]
        if known and known_scale(known[1], unit) is not None:
            return *known, unit
    known = _named(text)
    return (*known, "") if known else None


def _named(text: str) -> tuple[str, str] | None:
    """Return name and kind of a column, None for an unknown one."""
    squeezed = re.sub(r"[\s_/]", "", text).lower()
    for pattern, what, name in NAMES:
        match = pattern.fullmatch(squeezed)
        if match:
            return name + "".join(match.groups()), what
    return None


def scale_of_unit(what: str, unit: str, where: str) -> float:
    """Return the factor of numbers in this unit. Raises TextureDataError on an unknown unit."""
    result = known_scale(what, unit)
    if result is None:
        raise TextureDataError(f"{where}: {what} in {unit!r}; known are {', '.join(UNITS[what])}")
    return result


def known_scale(what: str, unit: str) -> float | None:
    """Return the factor of `scale_of_unit`, None for an unknown unit.

    m/s^2 may be written m/s², ms^-2, m s-2, m/s/s or m_s2.
    """
    return {_squeezed(name): scale for name, scale in UNITS[what].items()}.get(_squeezed(unit))


def _squeezed(unit: str) -> str:
    for written, meant in OTHERWISE.items():
        unit = unit.replace(written, meant)
    bare = re.sub(r"[\s^*·.]", "", unit)
    return ALSO.get(bare) or re.sub(
        r"^(c?m|mm)s-([12])$", lambda unit_match: f"{unit_match[1]}/s{unit_match[2].strip('1')}", bare
    )
