"""Foreign tables made clean and then dirtied, and the maps that read them."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from palpate.analysis.importing.tables import import_table
from palpate.analysis.ratings.dataset import Ratings

COLUMNS = {
    "participant": "who",
    "value": "score",
    "attribute": "item",
    "within": {"car": "car"},
}
Record = tuple[str, str, str, str]


@dataclass(frozen=True)
class Foreign:
    """A long table as text, and every way in which a program may have written it."""

    records: tuple[Record, ...]
    header: tuple[str, ...] = ("who", "item", "car", "score")
    delimiter: str = ","
    decimal: str = "."
    line_end: str = "\n"
    encoding: str = "utf-8"
    note: str | None = None
    trailing: bool = False
    row_numbers: bool = False
    blank_lines: bool = False
    empty_rows: int = 0
    sep_line: bool = False
    quoted: bool = False
    map_keys: dict[str, Any] = field(default_factory=dict)

    def data(self) -> bytes:
        """The bytes of the file."""
        rows = [self.header, *((*labels, self._value(value)) for *labels, value in self.records)]
        if self.note is not None:
            rows = [(row[0], "note" if i == 0 else self.note, *row[1:]) for i, row in enumerate(rows)]
        if self.row_numbers:
            rows = [("" if i == 0 else str(i), *row) for i, row in enumerate(rows)]
        if self.trailing:
            rows = [(*row, "") for row in rows]
        rows += [("",) * len(rows[0])] * self.empty_rows
        text = self._text(rows)
        if self.blank_lines:
            text = text.replace(self.line_end, self.line_end * 2) if self.note is None else text + self.line_end * 3
        if self.sep_line:
            text = f"sep={self.delimiter}{self.line_end}{text}"
        return text.encode(self.encoding)

    def _value(self, value: str) -> str:
        return value.replace(".", self.decimal)

    def _text(self, rows: list[tuple[str, ...]]) -> str:
        text = io.StringIO(newline="")
        # CRLF while writing, so that a lone CR or LF inside a cell is quoted as well.
        style: Literal[0, 1] = csv.QUOTE_ALL if self.quoted else csv.QUOTE_MINIMAL
        csv.writer(text, delimiter=self.delimiter, quoting=style, lineterminator="\r\n").writerows(rows)
        return text.getvalue().replace("\r\n", self.line_end)

    def also(self, **changes: Any) -> Foreign:
        """The same table with changes."""
        return replace(self, **changes)


def write_map(folder: Path, **keys: Any) -> Path:
    """A column map in YAML (JSON is YAML); keys given as None are left out."""
    whole = {"name": "foreign", "files": "table.csv", "columns": COLUMNS, **keys}
    path = folder / "map.yaml"
    path.write_text(json.dumps({k: v for k, v in whole.items() if v is not None}, ensure_ascii=False), encoding="utf-8")
    return path


def imported(folder: Path, table: Foreign | bytes | str, **keys: Any) -> Ratings:
    """The table written to `folder` and imported."""
    folder.mkdir(parents=True, exist_ok=True)
    own = table.map_keys if isinstance(table, Foreign) else {}
    data = table.data() if isinstance(table, Foreign) else table.encode() if isinstance(table, str) else table
    (folder / "table.csv").write_bytes(data)
    return import_table(write_map(folder, **{**own, **keys}))
