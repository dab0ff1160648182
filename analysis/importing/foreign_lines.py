"""Which lines of foreign tables are ratings: those inside the map's loops and conditions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from palpate.analysis.importing.dialects import Row, Sheet, TableRefused
from palpate.analysis.importing.map_file import ColumnMap, Condition
from palpate.analysis.ratings.dataset import Exclusion
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count


@dataclass(frozen=True)
class Line:
    """A row of a sheet, its cells by the names of their columns."""

    sheet: Sheet
    row: Row
    places: Mapping[str, int]

    @property
    def where(self) -> str:
        """The file and the line, as a message begins."""
        return f"{self.sheet.name}: line {self.row.line}"

    def __getitem__(self, column: str) -> str:
        return self.row.cells[self.places[column]]


def lines_of(column_map: ColumnMap, sheet: Sheet) -> Iterator[Line]:
    """The rows of a sheet with the columns that the map names."""
    places = {column: sheet.place(column) for column in column_map.wanted()}
    return (Line(sheet, row, places) for row in sheet.rows)


def choose_lines(column_map: ColumnMap, lines: Sequence[Line]) -> tuple[list[Line], list[Exclusion]]:
    """The lines inside every loop and condition of the map, and one exclusion for all that each of them leaves out.

    Raises TableRefused where a condition asks for a text that never occurs, and where no line is left.
    """
    kept, exclusions = list(lines), []
    for columns in column_map.loop.values():
        inside = [line for line in kept if any(line[column] for column in columns.values())]
        exclusions += _left_out(kept, inside, _outside(list(columns.values())))
        kept = inside
    for column, condition in column_map.where.items():
        _check_texts_occur(column, condition, lines)
        inside = [line for line in kept if _meets(line[column], condition)]
        exclusions += _left_out(kept, inside, _unmet(column, condition))
        kept = inside
    if not kept:
        reasons = "".join(f" {count(each.rows, 'row is', 'rows are')} no rating: {each.why}." for each in exclusions)
        raise TableRefused(f"{column_map.name}: no row is a rating.{reasons} Check loop and where in the map")
    return kept, exclusions


def one_file_each(column_map: ColumnMap, lines: Sequence[Line]) -> None:
    """Refuse a participant in two PsychoPy files: it writes one file a session, so one was met twice."""
    files: dict[str, str] = {}
    for line in lines if column_map.format == "psychopy" else ():
        person = line[column_map.columns.participant]
        first = files.setdefault(person, line.sheet.name)
        if first != line.sheet.name:
            raise TableRefused(
                f"{line.where}: participant {person!r} stands in {first}, too;"
                " leave one of the files out, or give the participants different names"
            )


def either(texts: Iterable[str]) -> str:
    """The texts as a message offers them."""
    return " or ".join(map(repr, texts))


def _left_out(before: Sequence[Line], after: Sequence[Line], why: str) -> list[Exclusion]:
    if len(before) == len(after):
        return []
    names = list(dict.fromkeys(line.sheet.name for line in before))
    who = names[0] if len(names) == 1 else count(len(names), "file")
    return [Exclusion("rows", who, why, len(before) - len(after))]


def _outside(columns: Sequence[str]) -> str:
    return f"{' and '.join(columns)} {'are' if len(columns) > 1 else 'is'} empty"


def _unmet(column: str, condition: Condition) -> str:
    return f"{column} is empty" if condition.is_ is None else f"{column} is not {either(condition.is_)}"


def _meets(text: str, condition: Condition) -> bool:
    return bool(text) if condition.is_ is None else text in condition.is_


def _check_texts_occur(column: str, condition: Condition, lines: Sequence[Line]) -> None:
    occurring = {line[column] for line in lines}
    for text in condition.is_ or ():
        if text not in occurring:
            raise TableRefused(f"where: no row has {text!r} in {column!r}; {nearest(text, sorted(occurring))}")
