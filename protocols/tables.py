"""Read tables of delimited text: from bytes to a header, rows with their lines, and columns of numbers.

A kind of file declares its columns, the format of its tables and its own messages (`TableFormat`), and nothing else.
Numbers are stored as `array('d')`: 8 bytes each, and `numpy.asarray` takes them without a copy.
"""

from __future__ import annotations

import csv
import io
import itertools
import math
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from palpate.protocols.wording import some

NO_CELL = "float() argument must be a string or a real number, not 'NoneType'"
UTF8 = ("utf-8-sig",)
"""UTF-8 with or without a byte-order mark."""
UTF8_MARK = b"\xef\xbb\xbf"
UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
DELIMITERS = ",;\t"
BATCH = 512
"""Number of rows that `Table.numbers` reads at once."""


class TableError(ValueError):
    """A table that cannot be read; the message names file, line and column."""


@dataclass(frozen=True)
class Mistake:
    """A mistake in a table, and its place; fields that do not apply are empty.

    `place` is the column's index from 0, `cells` the number of cells in the row, `header` the columns' names as found.
    """

    path: Path
    line: int = 0
    column: str = ""
    place: int = 0
    text: str = ""
    cells: int = 0
    header: Sequence[str] = ()
    problem: Exception | None = None

    @property
    def where(self) -> str:
        """Return the file and the line, as most messages begin."""
        return f"{self.path}, line {self.line}"

    @property
    def byte(self) -> int:
        """Return the position of the first byte that the encoding cannot decode, from 0."""
        return self.problem.start if isinstance(self.problem, UnicodeDecodeError) else 0

    @property
    def reason(self) -> str:
        """Return the message of the system, the codec or the parser, without the file's name."""
        own = getattr(self.problem, "strerror", None) or getattr(self.problem, "reason", None)
        return str(own or self.problem)


Message = Callable[[Mistake], str]


def has_cells(cells: Sequence[str]) -> bool:
    """Return whether a row has cells; a blank line has none."""
    return bool(cells)


def has_text(cells: Sequence[str]) -> bool:
    """Return whether any cell of a row holds more than spaces."""
    return not "".join(cells).isspace() and any(cells)


@dataclass(frozen=True)
class TableFormat:
    """The format of a kind of table, and the messages for mistakes in it.

    The first of `encodings` that fits is used (UTF-16 only with its mark), and the most frequent of `delimiters` in the
    first line that is not blank; with any other than the comma, a comma in a number is the decimal mark. `strip`
    removes spaces around names and cells. Rows that are not `counted` are skipped; `blank_above` skips blank lines
    above the header. If a message is None, the error of the system or of the csv module is not caught; the last column
    of a name that appears twice is used; a row may be short, its missing cells empty.
    """

    error: Callable[[str], Exception] = TableError
    encodings: Sequence[str] = UTF8
    delimiters: str = ","
    strip: bool = False
    strict: bool = False
    blank_above: bool = False
    counted: Callable[[Sequence[str]], bool] = has_cells
    unreadable: Message | None = lambda wrong: f"{wrong.path}: cannot be read ({wrong.reason})"
    encoding: Message = lambda wrong: f"{wrong.path}: not a text file in UTF-8 ({wrong.reason})"
    quoting: Message | None = lambda wrong: f"{wrong.where}: {wrong.reason}"
    missing: Message = lambda wrong: (
        f"{wrong.path}: no column {wrong.column!r}; found {some(wrong.header) or 'an empty file'}"
    )
    twice: Message | None = None
    width: Message | None = lambda wrong: (
        f"{wrong.where}: {wrong.cells} cells, {len(wrong.header)} columns are expected"
    )
    number: Message = lambda wrong: f"{wrong.where}: {wrong.column} is {wrong.text!r}, a finite number is expected"
    short: Message | None = None

    def content(self, path: Path) -> bytes:
        """Read a file. Raises the format's error if it cannot be read, OSError if there is no message."""
        try:
            return path.read_bytes()
        except OSError as problem:
            if self.unreadable is None:
                raise
            raise self.error(self.unreadable(Mistake(path, problem=problem))) from None


class Record(NamedTuple):
    """The cells of a record, and the first and the last line that it takes, from 1."""

    first: int
    line: int
    cells: list[str]


class RecordError(ValueError):
    """An error in delimited text; `first` is the line where the record begins, `line` the last line read."""

    def __init__(self, problem: csv.Error, first: int, line: int) -> None:
        super().__init__(str(problem))
        self.first, self.line = first, line


def split_records(lines: Iterable[str], delimiter: str = ",", *, strict: bool = False) -> Iterator[Record]:
    """Split lines into records, including blank ones. Raises RecordError."""
    reader = csv.reader(lines, delimiter=delimiter, strict=strict)
    first = 1
    try:
        for cells in reader:
            yield Record(first, reader.line_num, cells)
            first = reader.line_num + 1
    except csv.Error as problem:
        raise RecordError(problem, first, reader.line_num) from None


def split_line(line: str) -> list[str]:
    """Split one line at its commas."""
    return next(csv.reader([line]), [])


def commonest_delimiter(line: str, delimiters: str = DELIMITERS) -> str:
    """Return the most frequent delimiter of a line, the first of `delimiters` if there is none."""
    return max(delimiters, key=line.count)


@dataclass(slots=True)
class Row:
    """A row of a table: its line in the file and its cells by the names of their columns."""

    table: Table
    line: int
    cells: Mapping[str, str]

    @property
    def where(self) -> str:
        """Return the file and the line, as most messages begin."""
        return f"{self.table.path}, line {self.line}"

    def __getitem__(self, column: str) -> str:
        return self.cells[column]

    def number(self, column: str) -> float:
        """Return the finite number in a column. Raises the format's error on numbers."""
        return self.table.finite(self.line, column, self.cells[column])


class Table:
    """A table whose header was read; its rows can be read once, by `rows` or by `numbers`."""

    def __init__(self, path: Path, lines: Iterator[str], layout: TableFormat) -> None:
        self.path, self.layout = path, layout
        self.header: list[str] = []
        first = "\n"
        above: list[str] = []
        if len(layout.delimiters) > 1:
            above = list(_up_to_text(lines))
            first = above[-1] if above else ""
        self.delimiter = commonest_delimiter(first, layout.delimiters)
        self._reader = csv.reader(itertools.chain(above, lines), delimiter=self.delimiter, strict=layout.strict)
        try:
            cells: list[str] = next(filter(any, self._reader) if self.layout.blank_above else self._reader, [])
        except csv.Error as problem:
            raise self._quoting(problem) from None
        self.header = [cell.strip() for cell in cells] if self.layout.strip else cells
        self.places = {name: place for place, name in enumerate(self.header)}
        self.lines = array("Q")
        """The line of each row, once `numbers` has read them."""

    @property
    def empty(self) -> bool:
        """Return whether the file has no lines."""
        return not self._reader.line_num

    def demand(self, columns: Iterable[str]) -> None:
        """Raise the format's error if a column is missing, or appears twice and must not."""
        for name in columns:
            if name not in self.places:
                raise self._refusal(self.layout.missing, column=name)
            if self.layout.twice is not None and self.header.count(name) > 1:
                raise self._refusal(self.layout.twice, column=name)

    def records(self) -> Iterator[list[str]]:
        """Yield the rows as lists of cells. Raises the format's error for wrong quotes."""
        try:
            yield from filter(self.layout.counted, self._reader)
        except csv.Error as problem:
            raise self._quoting(problem) from None

    def rows(self) -> Iterator[Row]:
        """Yield the rows as texts by column. Raises the format's error for a row with too few or too many cells."""
        header, count = self.header, len(self.header)
        width, strip = self.layout.width, self.layout.strip
        for cells in self.records():
            if len(cells) != count:
                if width is not None:
                    raise self._refusal(width, line=self._reader.line_num, cells=len(cells))
                cells.extend([""] * (count - len(cells)))
            texts = [cell.strip() for cell in cells] if strip else cells
            yield Row(self, self._reader.line_num, dict(zip(header, texts, strict=False)))

    def numbers(self, columns: Sequence[str], *, gaps: bool = False, finite: bool = True) -> dict[str, array[float]]:
        """Return the columns as numbers.

        With `gaps` an empty cell is NaN, and one beyond the row's end too unless the format has a message for it.
        Raises the format's error for a cell that is not a number, or not finite where `finite`.
        """
        columns = list(dict.fromkeys(columns))
        read = {name: array("d") for name in columns}
        records = self.records()
        while batch := [(self._reader.line_num, cells) for cells in itertools.islice(records, BATCH)]:
            try:
                values = [self._column(batch, self.places[name], finite) for name in columns]
            except (ValueError, IndexError):  # one row after another, to find the cell
                rows = [self._numbers(line, cells, columns, gaps, finite) for line, cells in batch]
                values = [list(column) for column in zip(*rows, strict=True)]
            self.lines.extend([line for line, _ in batch])
            for column, more in zip(read.values(), values, strict=True):
                column.extend(more)
        return read

    def finite(self, line: int, column: str, text: str) -> float:
        """Return a cell's finite number. Raises the format's error."""
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self._refusal(self.layout.number, line=line, column=column, text=text)
        return value

    def _column(self, batch: Sequence[tuple[int, Sequence[str]]], place: int, finite: bool) -> list[float]:
        """Return a column of some rows. Raises ValueError or IndexError; `_numbers` finds the cell."""
        if self.delimiter == ",":
            values = [float(cells[place]) for _, cells in batch]
        else:
            values = [float(cells[place].replace(",", ".")) for _, cells in batch]
        if finite and not all(map(math.isfinite, values)):
            raise ValueError
        return values

    def _numbers(
        self, line: int, cells: Sequence[str], columns: Sequence[str], gaps: bool, finite: bool
    ) -> list[float]:
        """Return the numbers of a row. Raises the format's error at the first cell that is not a number."""
        values = []
        for name in columns:
            place = self.places[name]
            if place >= len(cells) and self.layout.short is not None:
                raise self._refusal(self.layout.short, line=line, column=name, place=place, cells=len(cells))
            text, value = cells[place] if place < len(cells) else "", math.nan
            problem: Exception | None = None if place < len(cells) else TypeError(NO_CELL)
            try:
                value = float(text if self.delimiter == "," else text.replace(",", "."))
            except ValueError as error:
                problem = problem or error
            empty = not (text.strip() if self.layout.strip else text)
            if not math.isfinite(value) if finite else problem and not (gaps and empty):
                raise self._refusal(
                    self.layout.number, line=line, column=name, place=place, text=text.strip(), problem=problem
                ) from None
            values.append(value)
        return values

    def _quoting(self, problem: csv.Error) -> Exception:
        if self.layout.quoting is None:
            return problem
        return self._refusal(self.layout.quoting, line=self._reader.line_num, problem=problem)

    def _refusal(self, message: Message, **fields: Any) -> Exception:
        return self.layout.error(message(Mistake(self.path, header=self.header, **fields)))


def read_table(path: Path, columns: Iterable[str] = (), layout: TableFormat = TableFormat()) -> Table:
    """Open a table that must have these columns.

    Raises the format's error, with its message, for a file that cannot be read or is not text, a missing column and, if
    the format forbids it, a column that appears twice.
    """
    return parse_table(layout.content(path), path, columns, layout)


def parse_table(content: bytes, path: Path, columns: Iterable[str] = (), layout: TableFormat = TableFormat()) -> Table:
    """Open a table that must have these columns, from the bytes of its file. Raises as `read_table` does."""
    _text, encoding = _decoded(content, path, layout)
    del _text  # decoded once more, line by line: a text in memory is larger than its file
    table = Table(path, io.TextIOWrapper(io.BytesIO(content), encoding, newline=""), layout)
    table.demand(columns)
    return table


def read_lines(path: Path, layout: TableFormat = TableFormat()) -> list[str]:
    """Return a file's lines without their ends. Raises as `read_table` does."""
    text, _encoding = _decoded(layout.content(path), path, layout)
    return text.splitlines()


def table_text(columns: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """Return a table as text: a header and rows, commas between cells, quotes where needed."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return text.getvalue()


def _decoded(content: bytes, path: Path, layout: TableFormat) -> tuple[str, str]:
    """Return the text and its encoding. Raises the format's error."""
    marked = content.startswith(UTF16_MARKS) and "utf-16" in layout.encodings
    problem: Exception = ValueError("it holds NUL characters")
    for encoding in layout.encodings:
        if marked is not (encoding == "utf-16"):
            continue
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError as refused:
            problem = refused
            continue
        if "\0" not in text or len(layout.encodings) == 1:
            return text, encoding
    raise layout.error(layout.encoding(Mistake(path, problem=problem)))


def _up_to_text(lines: Iterator[str]) -> Iterator[str]:
    """Yield lines up to and including the first one that is not blank."""
    for line in lines:
        yield line
        if line.strip():
            return
