"""Reading a lab's recording of a door: columns by name, whatever the encoding, the delimiter or the decimal sign."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from palpate.signals.doors.grid import DoorDataError

DELIMITERS = ",;\t"


@dataclass(frozen=True)
class Columns:
    """Finite numbers of the wanted columns, all of one length, and the file's line of each row."""

    values: dict[str, list[float]]
    lines: list[int]


def read_columns(path: Path | str, wanted: Sequence[str]) -> Columns:
    """Read the wanted columns of a CSV recording.

    Understands UTF-8 with or without a byte-order mark, UTF-16 with one, and Windows-1252; comma, semicolon or
    tab between values; and a decimal comma where the delimiter is not the comma. Blank lines are skipped.

    Raises:
        DoorDataError: naming file, line and column, for a missing column, a short row, or a value that is not a
            finite number.
    """
    path = Path(path)
    text = _decode(path.read_bytes(), path)
    first_line = next((line for line in text.splitlines() if line.strip()), "")
    delimiter = max(DELIMITERS, key=first_line.count)
    rows = csv.reader(text.splitlines(), delimiter=delimiter)
    header = [name.strip() for name in next((row for row in rows if any(row)), [])]
    places = _places(path, header, wanted)
    columns = Columns({name: [] for name in wanted}, [])
    for row in rows:
        if not any(cell.strip() for cell in row):
            continue
        columns.lines.append(rows.line_num)
        for name, place in places.items():
            columns.values[name].append(_cell(path, rows.line_num, name, row, place, delimiter != ","))
    return columns


def _decode(content: bytes, path: Path) -> str:
    wide = content[:2] in (b"\xff\xfe", b"\xfe\xff")
    for encoding in ["utf-16"] if wide else ["utf-8-sig", "cp1252"]:
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise DoorDataError(f"{path}: not a text file; a CSV export of the recording is expected.")


def _places(path: Path, header: list[str], wanted: Sequence[str]) -> dict[str, int]:
    for name in wanted:
        if header.count(name) != 1:
            found = ", ".join(header) or "an empty file"
            problem = "stands more than once" if name in header else "is missing"
            raise DoorDataError(
                f"{path}: column {name!r} {problem}; found: {found}. "
                "Name the columns with --angle-column, --force-column and --time-column."
            )
    return {name: header.index(name) for name in wanted}


def _cell(path: Path, line: int, name: str, row: list[str], place: int, decimal_comma: bool) -> float:
    if place >= len(row):
        raise DoorDataError(f"{path}, line {line}: {len(row)} values, column {name!r} would be value {place + 1}.")
    text = row[place].strip()
    try:
        value = float(text.replace(",", ".") if decimal_comma else text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise DoorDataError(
            f"{path}, line {line}: {name} is {text!r}, a finite number is needed. "
            "Remove the row or repair the recording: a value is never guessed."
        )
    return value
