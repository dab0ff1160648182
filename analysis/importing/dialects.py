"""From the bytes of a foreign table to its header and rows with line numbers; ambiguous input is refused."""

from __future__ import annotations

import codecs
import hashlib
import io
import re
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from palpate.analysis.ratings.dataset import DataRefused
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.tables import UTF8_MARK, UTF16_MARKS, RecordError, split_records

DELIMITERS = (",", ";", "\t", "|")
OFFERED = ("utf-8", "utf-16", "utf-16-be", "cp1252", "latin-1", "mac-roman", "cp949")
_SAVE_AS = "open it in the program that wrote it and save it as CSV in UTF-8"
_FORMS = {
    b"pk\x03\x04": "a workbook (xlsx, ods) or another zip file", b"\xd0\xcf\x11\xe0": "an old workbook (xls)",
    b"\x1f\x8b": "a compressed file (gzip)", b"%pdf": "a PDF", b"sqlite format 3": "a SQLite database",
    b"par1": "a Parquet file", b"<html": "a web page", b"<!doctype": "a web page", b"<?xml": "an XML file",
    b"\x89png": "a picture", b"\xff\xd8\xff": "a picture", b"$fl2@(#)": "an SPSS file", b"$fl3@(#)": "an SPSS file",
    b"<stata_dta": "a Stata file", b"7z\xbc\xaf": "a compressed file (7z)",
    b"{\n": "a JSON file", b'{"': "a JSON file", b"[{": "a JSON file",
}  # fmt: skip
_SEP_LINE = re.compile(r"sep=(.)(?:\r\n|\r|\n)")
MOST_SHOWN = 5


class TableRefused(DataRefused):
    """A foreign table cannot be read by its map; the message names file, line and reason."""


@dataclass(frozen=True)
class SheetRow:
    """The cells of one record and the 1-based number of its first line."""

    line: int
    cells: tuple[str, ...]


@dataclass(frozen=True)
class Sheet:
    """A table as text: its header, its rows without empty ones, and how it was read."""

    name: str
    sha256: str
    header: tuple[str, ...]
    rows: tuple[SheetRow, ...]
    empty_rows: int
    delimiter: str
    encoding: str

    def place(self, column: str) -> int:
        """Return the index of a column that `read_sheet` required."""
        return self.header.index(column)


def read_sheet(
    path: Path,
    name: str,
    *,
    encodings: Sequence[str],
    delimiter: str | None,
    required: Sequence[str],
    trim: bool,
) -> Sheet:
    """Read a delimited table that must have every column of `required`.

    The first encoding that fits is used. Without a `delimiter`, it is the one under which the header has
    the required columns. Raises TableRefused on an empty file, bytes that no encoding reads, a header without a
    required column or with one name twice, a row with too few or too many cells, and unbalanced quotes.
    """
    data = path.read_bytes()
    text, encoding = _decode(data, encodings, name)
    stated, skipped = None, 0
    if match := _SEP_LINE.match(text):  # spreadsheets write a first line `sep=;`
        stated, skipped, text = match[1], 1, text[match.end() :]
    chosen = delimiter or stated or _likeliest_delimiter(text, required, trim)
    records = list(_records(text, chosen, name, trim, skipped))
    if not records:
        raise TableRefused(f"{name}: holds only blank lines; a header line is expected")
    header, rows = records[0].cells, records[1:]
    twice = sorted({column for column in header if column and header.count(column) > 1})
    if twice:
        raise TableRefused(f"{name}: the column {twice[0]!r} stands {header.count(twice[0])} times in the header")
    for column in required:
        if column not in header:
            raise TableRefused(
                f"{name}: no column {column!r} among {len(header)} (delimiter {chosen!r}); {nearest(column, header)}"
            )
    _refuse_ragged(rows, header, chosen, name)
    # Raise TableRefused where a column has values and no name: a cell too many has slipped into it. An unnamed
    # first column is let pass: it holds the row numbers that some programs write, and shifts nothing.
    for place, column in enumerate(header):
        for row in rows if not column and place > 0 else ():
            if row.cells[place]:
                raise TableRefused(
                    f"{name}: line {row.line}: {row.cells[place]!r} is in column {place + 1}, which has no name"
                )
    filled = tuple(row for row in rows if any(row.cells))
    digest = hashlib.sha256(data).hexdigest()
    return Sheet(name, digest, header, filled, len(rows) - len(filled), chosen, encoding)


def _refuse_ragged(rows: Sequence[SheetRow], header: Sequence[str], delimiter: str, name: str) -> None:
    """Raise TableRefused where a row has more or fewer cells than the header, with the most likely reason."""
    if ragged := [row for row in rows if len(row.cells) != len(header)]:
        examples = ", ".join(f"line {row.line} has {len(row.cells)}" for row in ragged[:MOST_SHOWN])
        more = f" and {len(ragged) - MOST_SHOWN} more rows" if len(ragged) > MOST_SHOWN else ""
        hint = ""
        if all(len(row.cells) == len(header) + 1 and not row.cells[-1] for row in rows):
            hint = f" all rows end with a {delimiter!r} that the header has not;"
        elif delimiter == "," and any(len(row.cells) > len(header) for row in rows):
            hint = " an unquoted decimal comma?"
        raise TableRefused(
            f"{name}: {len(header)} columns in the header, but {examples}{more};{hint}"
            " every row needs as many cells as the header"
        )


def _decode(data: bytes, encodings: Sequence[str], name: str) -> tuple[str, str]:
    """Return the text and the first encoding that reads it.

    Raises TableRefused for an empty file, a file that is no text, and bytes that no encoding reads.
    """
    if not data:
        raise TableRefused(f"{name}: the file is empty; leave it out or replace it")
    for begin, form in _FORMS.items():
        if data.lstrip().lower().startswith(begin):
            raise TableRefused(f"{name}: is {form}, whatever its name says; {_SAVE_AS}")
    failed = 0  # the byte that the last encoding cannot read
    for encoding in encodings:
        try:
            text = data.decode(encoding)
        except UnicodeError as error:
            failed = getattr(error, "start", 0)
        else:
            known = codecs.lookup(encoding).name
            if data.startswith(UTF8_MARK) and not known.startswith("utf-8"):
                raise TableRefused(f"{name}: begins with the mark of UTF-8, not of {encoding}; say encoding: utf-8-sig")
            if data.startswith(UTF16_MARKS) and not known.startswith(("utf-16", "utf-32")):
                raise TableRefused(f"{name}: begins with the mark of UTF-16, not of {encoding}; say encoding: utf-16")
            if "\0" in text:
                raise TableRefused(f"{name}: holds NUL characters as {encoding}; {_advice(data, [encoding])}")
            return text.removeprefix("\ufeff"), encoding
    line = data[:failed].count(b"\n") + 1
    raise TableRefused(
        f"{name}: line {line}: byte 0x{data[failed]:02x} (byte {failed + 1} of the file) is not"
        f" {' or '.join(encodings)}; {_advice(data, encodings)}"
    )


def _advice(data: bytes, tried: Sequence[str]) -> str:
    """Return the encodings that read the file without control characters, except those that were tried."""
    known = {codecs.lookup(encoding).name for encoding in tried}
    others = [name for name in OFFERED if codecs.lookup(name).name not in known and _reads(data, name)]
    if not others:
        return f"no other encoding reads it either: {_SAVE_AS}"
    return f"say in the map which encoding it is; what reads it: encoding: {' or '.join(others)}"


def _reads(data: bytes, encoding: str) -> bool:
    try:
        text = data.decode(encoding)
    except UnicodeError:
        return False
    return not any(
        unicodedata.category(letter) in {"Cc", "Cn", "Co", "Cs"} for letter in set(text) - set("\t\r\n\ufeff")
    )


def _likeliest_delimiter(text: str, required: Sequence[str], trim: bool) -> str:
    """Return the delimiter with which most required columns are in the header, then the one with most columns."""

    def score(delimiter: str) -> tuple[int, int]:
        try:
            header = next(_records(text, delimiter, "", trim, 0)).cells
        except (TableRefused, StopIteration):
            return 0, 0
        return sum(column in header for column in required), len(header)

    return max(DELIMITERS, key=score)


def _records(text: str, delimiter: str, name: str, trim: bool, skipped: int) -> Iterator[SheetRow]:
    """Yield the records except blank lines; `skipped` is the number of lines before the text."""
    try:
        for record in split_records(io.StringIO(text, newline=""), delimiter, strict=True):
            if record.cells:
                yield SheetRow(record.first + skipped, tuple(cell.strip() if trim else cell for cell in record.cells))
    except RecordError as error:
        raise TableRefused(
            f"{name}: line {error.first + skipped}: {error}: is a quote not closed, or the delimiter another one?"
        ) from None
