"""Read a lab's recording of a door: columns by name, in any encoding, with any delimiter and decimal sign."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from pathlib import Path

from palpate.protocols.tables import DELIMITERS, Mistake, TableFormat, has_text, read_table
from palpate.signals.doors.grid import DoorDataError


def _lacking(wrong: Mistake) -> str:
    problem = "appears more than once" if wrong.column in wrong.header else "is missing"
    return (
        f"{wrong.path}: column {wrong.column!r} {problem}; found: {', '.join(wrong.header) or 'an empty file'}. "
        "Name the columns with --angle-column, --force-column and --time-column."
    )


RECORDING = TableFormat(
    error=DoorDataError,
    encodings=("utf-16", "utf-8-sig", "cp1252"),
    delimiters=DELIMITERS,
    strip=True,
    blank_above=True,
    counted=has_text,
    unreadable=None,
    encoding=lambda wrong: f"{wrong.path}: not a text file; a CSV export of the recording is expected.",
    quoting=None,
    missing=_lacking,
    twice=_lacking,
    short=lambda wrong: (
        f"{wrong.where}: {wrong.cells} values, column {wrong.column!r} would be value {wrong.place + 1}."
    ),
    number=lambda wrong: (
        f"{wrong.where}: {wrong.column} is {wrong.text!r}, a finite number is needed. "
        "Remove the row or repair the recording: a value is never guessed."
    ),
)


def read_columns(path: Path | str, wanted: Sequence[str]) -> dict[str, array[float]]:
    """Read these columns of a CSV recording as finite numbers.

    Understands UTF-8 with or without a byte-order mark, UTF-16 with one, and Windows-1252; comma, semicolon or
    tab between values; and a decimal comma where the delimiter is not the comma. Blank lines are skipped.

    Raises:
        DoorDataError: naming file, line and column, for a missing column, a short row, or a value that is not a
            finite number.
    """
    return read_table(Path(path), wanted, RECORDING).numbers(wanted)
