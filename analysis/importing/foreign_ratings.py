"""The rows of foreign tables that are ratings, each with its participant, attribute, factors and value; duplicates
settled.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from palpate.analysis.importing.dialects import MOST_SHOWN, Row, Sheet, TableRefused
from palpate.analysis.importing.map_file import ColumnMap, Condition, Source
from palpate.analysis.importing.number_texts import Decimal, NoNumber, decimal_mark, number
from palpate.analysis.ratings.dataset import Exclusion
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count, some, some_lines
from palpate.protocols.wording import count as counted

Cell = tuple[str, ...]


@dataclass(frozen=True)
class ForeignRating:
    """One rating and where it stood, `where` being 'FILE: line N'."""

    where: str
    participant: str
    attribute: str
    value: float
    within: Mapping[str, str]
    between: Mapping[str, str]
    stimulus: str
    kept: Mapping[str, str]


def ratings_of(column_map: ColumnMap, sheets: Sequence[Sheet]) -> tuple[list[ForeignRating], list[Exclusion]]:
    """Return all ratings in the order of the files, and a line for all rows that the map leaves out.

    Raises TableRefused as `palpate.analysis.importing.tables.import_table` says.
    """
    lines = [line for sheet in sheets for line in lines_of(column_map, sheet)]
    chosen, exclusions = choose_lines(column_map, lines)
    demand_one_file_each(column_map, chosen)
    groups = _Groups(column_map, lines)
    present, dropped = _rows_with_value(column_map, chosen)
    values = _values(column_map, present)
    ratings = [_rating(column_map, line, value, groups) for line, value in zip(present, values, strict=True)]
    return ratings, [*exclusions, *dropped]


def _rows_with_value(column_map: ColumnMap, lines: Sequence[Line]) -> tuple[list[Line], list[Exclusion]]:
    """Return the rows with a value, and the missing ones of each participant as the map says: refused or dropped."""
    column = column_map.columns.value
    missing = [line for line in lines if line[column] in column_map.missing]
    if missing and column_map.missing_value == "refuse":
        examples = some((f"{line.where} {line[column]!r}" for line in missing), MOST_SHOWN)
        raise TableRefused(
            f"{counted(len(missing), 'missing value')} in {column!r}: {examples};"
            " complete the table, or say missing_value: drop to leave these rows out"
        )
    dropped: dict[str, int] = {}
    for line in missing:
        person = _label(column_map, line, column_map.columns.participant)
        dropped[person] = dropped.get(person, 0) + 1
    present = [line for line in lines if line[column] not in column_map.missing]
    return present, [Exclusion("rows", person, "no value", count) for person, count in dropped.items()]


def _values(column_map: ColumnMap, lines: Sequence[Line]) -> list[float]:
    marks = _decimal_marks(column_map, lines)
    values: list[float] = []
    wrong: list[str] = []
    for line in lines:
        text = line[column_map.columns.value]
        try:
            values.append(number(text, marks[line.sheet.name]))
        except NoNumber as error:
            wrong.append(f"{line.where}: {column_map.columns.value!r} is {text!r}: {error}")
    if wrong:
        raise TableRefused("\n".join(some_lines(wrong, MOST_SHOWN)))
    _check_scale(column_map, lines, values)
    return values


def _decimal_marks(column_map: ColumnMap, lines: Sequence[Line]) -> dict[str, Decimal]:
    """Return the decimal mark of each file: a folder may have been written on several computers."""
    texts: dict[str, list[str]] = {}
    delimiters = {line.sheet.name: line.sheet.delimiter for line in lines}
    for line in lines:
        texts.setdefault(line.sheet.name, []).append(line[column_map.columns.value])
    if column_map.decimal is not None:
        return dict.fromkeys(texts, column_map.decimal)
    marks: dict[str, Decimal] = {}
    for name, values in texts.items():
        try:
            marks[name] = decimal_mark(values, delimiters[name])
        except NoNumber as error:
            raise TableRefused(f"{name}: {column_map.columns.value!r}: {error}") from None
    return marks


def _check_scale(column_map: ColumnMap, lines: Sequence[Line], values: Sequence[float]) -> None:
    if column_map.scale is None:
        return
    scale = column_map.scale.scale()
    off = [
        f"{line.where} {value:g}"
        for line, value in zip(lines, values, strict=True)
        if not (scale.holds(value) and scale.on_step(value))
    ]
    if off:
        step = "" if scale.step is None else f" in steps of {scale.step:g}"
        raise TableRefused(
            f"{counted(len(off), 'value is', 'values are')} not on the scale from {scale.low:g} to {scale.high:g}"
            f"{step}: {some(off, MOST_SHOWN)}; correct the table or the scale in the map"
        )


def _rating(column_map: ColumnMap, line: Line, value: float, groups: _Groups) -> ForeignRating:
    columns = column_map.columns
    person = _label(column_map, line, columns.participant)
    loops = {factor: _loop_level(line, factor, levels) for factor, levels in column_map.loop.items()}
    within = {factor: _level(column_map, line, factor, source) for factor, source in columns.within.items()}
    return ForeignRating(
        where=line.where,
        participant=person,
        attribute=columns.attribute_is or _attribute(column_map, line),
        value=value,
        within={**loops, **within},
        between=groups.of(person, line),
        stimulus=_label(column_map, line, columns.stimulus) if columns.stimulus else "",
        kept={column: line[column] for column in columns.keep},
    )


def _label(column_map: ColumnMap, line: Line, column: str) -> str:
    """Return the text of a cell that says whose or which rating it is: without it the rating has no place."""
    text = line[column]
    if text in column_map.missing:
        raise TableRefused(
            f"{line.where}: {column!r} is {text!r}, which means missing; complete it, leave the row out with where,"
            " or take the text from missing in the map"
        )
    if text != text.strip():
        raise TableRefused(f"{line.where}: {column!r} is {text!r}: blanks around it; say trim: true")
    return text


def _loop_level(line: Line, factor: str, levels: Mapping[str, str]) -> str:
    inside = [level for level, column in levels.items() if line[column]]
    if len(inside) != 1:
        raise TableRefused(f"{line.where}: the row belongs to {' and '.join(inside)} of {factor!r} at once")
    return inside[0]


def _level(column_map: ColumnMap, line: Line, factor: str, source: Source) -> str:
    text = _label(column_map, line, source.column)
    if source.levels is None:
        return text
    if text not in source.levels:
        raise TableRefused(f"{line.where}: {text!r} is no level of {factor!r}; {nearest(text, source.levels)}")
    return source.levels[text]


def _attribute(column_map: ColumnMap, line: Line) -> str:
    source = column_map.columns.attribute
    return _level(column_map, line, "attribute", source) if source is not None else ""


class _Groups:
    """Each participant's levels of the between factors; one level each, whatever row says it."""

    def __init__(self, column_map: ColumnMap, lines: Sequence[Line]) -> None:
        self._map = column_map
        self._seen: dict[tuple[str, str], tuple[str, str]] = {}
        for line in lines:
            for factor, source in column_map.columns.between.items():
                for level, part in (source.contains or {}).items():
                    if part in line[source.column]:
                        self._note(line[column_map.columns.participant], factor, level, line)

    def of(self, person: str, line: Line) -> dict[str, str]:
        """Return the participant's levels, those of this line included."""
        for factor, source in self._map.columns.between.items():
            if source.contains is None:
                self._note(person, factor, _level(self._map, line, factor, source), line)
            elif (person, factor) not in self._seen:
                raise TableRefused(
                    f"{line.where}: participant {person!r} has no {factor!r}: no row of {source.column!r}"
                    f" contains {either(source.contains.values())}"
                )
        return {factor: self._seen[person, factor][0] for factor in self._map.columns.between}

    def _note(self, person: str, factor: str, level: str, line: Line) -> None:
        first, where = self._seen.setdefault((person, factor), (level, line.where))
        if first != level:
            raise TableRefused(
                f"{line.where}: participant {person!r} is {level!r} in {factor!r}, but {first!r} at {where};"
                " a between factor has one level for each participant"
            )


@dataclass(frozen=True)
class Line:
    """A row of a sheet, its cells by the names of their columns."""

    sheet: Sheet
    row: Row
    places: Mapping[str, int]

    @property
    def where(self) -> str:
        """Return the file and the line, as a message begins."""
        return f"{self.sheet.name}: line {self.row.line}"

    def __getitem__(self, column: str) -> str:
        return self.row.cells[self.places[column]]


def lines_of(column_map: ColumnMap, sheet: Sheet) -> Iterator[Line]:
    """Return the rows of a sheet with the columns that the map names."""
    places = {column: sheet.place(column) for column in column_map.column_names()}
    return (Line(sheet, row, places) for row in sheet.rows)


def choose_lines(column_map: ColumnMap, lines: Sequence[Line]) -> tuple[list[Line], list[Exclusion]]:
    """Return the lines inside every loop and condition of the map, and one exclusion for all that each of them leaves
    out.

    Raises TableRefused where a condition asks for a text that never occurs, and where no line is left.
    """
    chosen, exclusions = list(lines), []
    for columns in column_map.loop.values():
        inside = [line for line in chosen if any(line[column] for column in columns.values())]
        exclusions += _left_out(chosen, inside, _outside(list(columns.values())))
        chosen = inside
    for column, condition in column_map.where.items():
        _check_texts_occur(column, condition, lines)
        inside = [line for line in chosen if _meets(line[column], condition)]
        unmet = f"{column} is empty" if condition.is_ is None else f"{column} is not {either(condition.is_)}"
        exclusions += _left_out(chosen, inside, unmet)
        chosen = inside
    if not chosen:
        reasons = "".join(
            f" {count(exclusion.rows, 'row is', 'rows are')} no rating: {exclusion.why}." for exclusion in exclusions
        )
        raise TableRefused(f"{column_map.name}: no row is a rating.{reasons} Check loop and where in the map")
    return chosen, exclusions


def demand_one_file_each(column_map: ColumnMap, lines: Sequence[Line]) -> None:
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
    """Return the texts as a message offers them."""
    return " or ".join(map(repr, texts))


def _left_out(before: Sequence[Line], after: Sequence[Line], why: str) -> list[Exclusion]:
    if len(before) == len(after):
        return []
    names = list(dict.fromkeys(line.sheet.name for line in before))
    who = names[0] if len(names) == 1 else count(len(names), "file")
    return [Exclusion("rows", who, why, len(before) - len(after))]


def _outside(columns: Sequence[str]) -> str:
    return f"{' and '.join(columns)} {'are' if len(columns) > 1 else 'is'} empty"


def _meets(text: str, condition: Condition) -> bool:
    return bool(text) if condition.is_ is None else text in condition.is_


def _check_texts_occur(column: str, condition: Condition, lines: Sequence[Line]) -> None:
    occurring = {line[column] for line in lines}
    for text in condition.is_ or ():
        if text not in occurring:
            raise TableRefused(f"where: no row has {text!r} in {column!r}; {nearest(text, sorted(occurring))}")


def settle_duplicates(
    column_map: ColumnMap, ratings: Sequence[ForeignRating]
) -> tuple[list[ForeignRating], bool, list[Exclusion]]:
    """Return one rating for each cell in the order of the file, whether any is a mean, and what was done, by
    participant.

    A cell is a participant, an attribute, the within levels and the stimulus. Raises TableRefused on a duplicate
    that the map does not settle, and where a kept column differs within a cell that is averaged.
    """
    cells: dict[Cell, list[ForeignRating]] = {}
    for rating in ratings:
        cell = (rating.participant, rating.attribute, *rating.within.values(), rating.stimulus)
        cells.setdefault(cell, []).append(rating)
    several = {cell: ratings for cell, ratings in cells.items() if len(ratings) > 1}
    if not several:
        return list(ratings), False, []
    if column_map.duplicates == "refuse":
        raise TableRefused(_duplicates_message(column_map, several))
    averaged = column_map.duplicates == "mean"
    settled = [_mean(ratings) if averaged else ratings[0] for ratings in cells.values()]
    return settled, averaged, _exclusions(several, averaged)


def _duplicates_message(column_map: ColumnMap, several: dict[Cell, list[ForeignRating]]) -> str:
    lines = some_lines([f"{_cell_text(ratings[0])}: {_places(ratings)}" for ratings in several.values()], MOST_SHOWN)
    advice = "say duplicates: mean or first, or name the column that tells them apart under within or stimulus"
    held = f"{count(len(several), 'cell')} {'holds' if len(several) == 1 else 'hold'} several ratings"
    return "\n".join([f"{column_map.name}: {held}; {advice}:", *(f"  {line}" for line in lines)])


def _cell_text(rating: ForeignRating) -> str:
    levels = [f"{factor} {level}" for factor, level in rating.within.items()]
    stimulus = [f"stimulus {rating.stimulus}"] if rating.stimulus else []
    return ", ".join([f"participant {rating.participant}", rating.attribute, *levels, *stimulus])


def _places(ratings: Sequence[ForeignRating]) -> str:
    examples = ", ".join(f"{rating.where} ({rating.value:g})" for rating in ratings[:MOST_SHOWN])
    return examples + (", ..." if len(ratings) > MOST_SHOWN else "")


def _mean(ratings: Sequence[ForeignRating]) -> ForeignRating:
    first = ratings[0]
    for rating in ratings[1:]:
        for column, text in rating.kept.items():
            if text != first.kept[column]:
                raise TableRefused(
                    f"{rating.where}: {column!r} is {text!r}, but {first.kept[column]!r} at {first.where}, with which"
                    f" it is averaged; leave {column!r} out of keep"
                )
    return first if len(ratings) == 1 else replace(first, value=statistics.mean(r.value for r in ratings))


def _exclusions(several: dict[Cell, list[ForeignRating]], averaged: bool) -> list[Exclusion]:
    people: dict[str, list[int]] = {}
    for cell, ratings in several.items():
        people.setdefault(cell[0], []).append(len(ratings))
    if averaged:
        return _averaged_lines({person: (sum(counts), len(counts)) for person, counts in people.items()})
    return [
        Exclusion(
            "repeated",
            person,
            f"not the first rating of its cell ({count(len(counts), 'cell')})",
            sum(counts) - len(counts),
        )
        for person, counts in people.items()
    ]


def _averaged_lines(people: dict[str, tuple[int, int]]) -> list[Exclusion]:
    """Return one line for each participant, given the numbers of ratings and cells, or one for all where they are
    alike.
    """
    alike = set(people.values())
    if len(people) > 1 and len(alike) == 1:
        ratings, cells = alike.pop()
        why = f"{count(ratings, 'rating')} of each averaged into {count(cells, 'cell')}"
        who = count(len(people), "participant")
        return [Exclusion("averaged", who, why, len(people) * ratings, len(people) * cells)]
    return [
        Exclusion("averaged", person, f"{ratings} ratings averaged into {count(cells, 'cell')}", ratings, cells)
        for person, (ratings, cells) in people.items()
    ]
