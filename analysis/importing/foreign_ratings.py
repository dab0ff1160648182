"""The ratings in foreign tables, each with participant, attribute, factors and value; duplicates are resolved."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from palpate.analysis.importing.dialects import MOST_SHOWN, Sheet, SheetRow, TableRefused
from palpate.analysis.importing.map_file import ColumnMap, Source
from palpate.analysis.importing.number_texts import Decimal, NoNumber, decimal_mark, number
from palpate.analysis.ratings.dataset import Exclusion
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count, some, some_lines

Cell = tuple[str, ...]


@dataclass(frozen=True)
class ForeignRating:
    """One rating and its place, `where`, such as 'FILE: line N'."""

    where: str
    participant: str
    attribute: str
    value: float
    within: Mapping[str, str]
    between: Mapping[str, str]
    stimulus: str
    extra: Mapping[str, str]


def ratings_of(column_map: ColumnMap, sheets: Sequence[Sheet]) -> tuple[list[ForeignRating], list[Exclusion]]:
    """Return all ratings in the order of the files, and an exclusion for the rows that the map leaves out.

    Raises TableRefused as `palpate.analysis.importing.tables.import_table` says.
    """
    lines = [line for sheet in sheets for line in lines_of(column_map, sheet)]
    chosen, exclusions = choose_lines(column_map, lines)
    demand_one_file_each(column_map, chosen)
    groups = _Groups(column_map, lines)
    # The missing values of each participant are refused or dropped, as the map says.
    column = column_map.columns.value
    missing = [line for line in chosen if line[column] in column_map.missing]
    if missing and column_map.missing_value == "refuse":
        examples = some((f"{line.where} {line[column]!r}" for line in missing), MOST_SHOWN)
        raise TableRefused(
            f"{count(len(missing), 'missing value')} in {column!r}: {examples};"
            " complete the table, or say missing_value: drop to leave these rows out"
        )
    dropped_rows: dict[str, int] = {}
    for line in missing:
        person = _label(column_map, line, column_map.columns.participant)
        dropped_rows[person] = dropped_rows.get(person, 0) + 1
    present = [line for line in chosen if line[column] not in column_map.missing]
    dropped = [Exclusion("rows", person, "no value", rows) for person, rows in dropped_rows.items()]
    values = _values(column_map, present)
    ratings = [_rating(column_map, line, value, groups) for line, value in zip(present, values, strict=True)]
    return ratings, [*exclusions, *dropped]


def _values(column_map: ColumnMap, lines: Sequence[Line]) -> list[float]:
    # Each file has its own decimal mark: a folder may have been written on several computers.
    texts: dict[str, list[str]] = {}
    delimiters = {line.sheet.name: line.sheet.delimiter for line in lines}
    for line in lines:
        texts.setdefault(line.sheet.name, []).append(line[column_map.columns.value])
    marks: dict[str, Decimal] = {}
    for name, own in texts.items():
        try:
            marks[name] = column_map.decimal or decimal_mark(own, delimiters[name])
        except NoNumber as error:
            raise TableRefused(f"{name}: {column_map.columns.value!r}: {error}") from None
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
    if column_map.scale is not None:
        scale = column_map.scale.scale()
        pairs = zip(lines, values, strict=True)
        off = [f"{line.where} {value:g}" for line, value in pairs if not (scale.holds(value) and scale.on_step(value))]
        if off:
            step = "" if scale.step is None else f" in steps of {scale.step:g}"
            raise TableRefused(
                f"{count(len(off), 'value is', 'values are')} not on the scale from {scale.low:g} to {scale.high:g}"
                f"{step}: {some(off, MOST_SHOWN)}; correct the table or the scale in the map"
            )
    return values


def _rating(column_map: ColumnMap, line: Line, value: float, groups: _Groups) -> ForeignRating:
    columns = column_map.columns
    person = _label(column_map, line, columns.participant)
    attribute = columns.attribute_is or ""
    if not attribute and columns.attribute is not None:
        attribute = _level(column_map, line, "attribute", columns.attribute)
    loops: dict[str, str] = {}
    for factor, levels in column_map.loop.items():
        inside = [level for level, column in levels.items() if line[column]]
        if len(inside) != 1:
            raise TableRefused(f"{line.where}: the row belongs to {' and '.join(inside)} of {factor!r} at once")
        loops[factor] = inside[0]
    within = {factor: _level(column_map, line, factor, source) for factor, source in columns.within.items()}
    return ForeignRating(
        where=line.where,
        participant=person,
        attribute=attribute,
        value=value,
        within={**loops, **within},
        between=groups.of(person, line),
        stimulus=_label(column_map, line, columns.stimulus) if columns.stimulus else "",
        extra={column: line[column] for column in columns.keep},
    )


def _label(column_map: ColumnMap, line: Line, column: str) -> str:
    """Return the text of a cell that identifies a rating, which must not be empty."""
    text = line[column]
    if text in column_map.missing:
        raise TableRefused(
            f"{line.where}: {column!r} is {text!r}, which means missing; complete it, leave the row out with where,"
            " or take the text from missing in the map"
        )
    if text != text.strip():
        raise TableRefused(f"{line.where}: {column!r} is {text!r}: blanks around it; say trim: true")
    return text


def _level(column_map: ColumnMap, line: Line, factor: str, source: Source) -> str:
    text = _label(column_map, line, source.column)
    if source.levels is None:
        return text
    if text not in source.levels:
        raise TableRefused(f"{line.where}: {text!r} is not a level of {factor!r}; {nearest(text, source.levels)}")
    return source.levels[text]


class _Groups:
    """Each participant's levels of the between factors, which must be the same in every row."""

    def __init__(self, column_map: ColumnMap, lines: Sequence[Line]) -> None:
        self._map = column_map
        self._seen: dict[tuple[str, str], tuple[str, str]] = {}
        for line in lines:
            for factor, source in column_map.columns.between.items():
                for level, part in (source.contains or {}).items():
                    if part in line[source.column]:
                        self._note(line[column_map.columns.participant], factor, level, line)

    def of(self, person: str, line: Line) -> dict[str, str]:
        """Return the participant's levels, including those of this line."""
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
    """A row of a sheet with its cells by column name."""

    sheet: Sheet
    row: SheetRow
    places: Mapping[str, int]

    @property
    def where(self) -> str:
        """The file and the line, for messages."""
        return f"{self.sheet.name}: line {self.row.line}"

    def __getitem__(self, column: str) -> str:
        return self.row.cells[self.places[column]]


def lines_of(column_map: ColumnMap, sheet: Sheet) -> Iterator[Line]:
    """Yield the rows of a sheet with the columns that the map names."""
    places = {column: sheet.place(column) for column in column_map.column_names()}
    return (Line(sheet, row, places) for row in sheet.rows)


def choose_lines(column_map: ColumnMap, lines: Sequence[Line]) -> tuple[list[Line], list[Exclusion]]:
    """Return the lines that satisfy all loops and conditions of the map, and an exclusion for what each leaves out.

    Raises TableRefused where a condition names a text that never occurs, and where no line is left.
    """
    chosen, exclusions = list(lines), []
    for columns in column_map.loop.values():
        inside = [line for line in chosen if any(line[column] for column in columns.values())]
        empty = f"{' and '.join(columns.values())} {'are' if len(columns) > 1 else 'is'} empty"
        exclusions += _left_out(chosen, inside, empty)
        chosen = inside
    for column, condition in column_map.where.items():
        occurring = {line[column] for line in lines}
        for text in condition.is_ or ():
            if text not in occurring:
                raise TableRefused(f"where: no row has {text!r} in {column!r}; {nearest(text, sorted(occurring))}")
        if condition.is_ is None:
            inside, unmet = [line for line in chosen if line[column]], f"{column} is empty"
        else:
            inside = [line for line in chosen if line[column] in condition.is_]
            unmet = f"{column} is not {either(condition.is_)}"
        exclusions += _left_out(chosen, inside, unmet)
        chosen = inside
    if not chosen:
        reasons = "".join(
            f" {count(exclusion.rows, 'row is', 'rows are')} no rating: {exclusion.why}." for exclusion in exclusions
        )
        raise TableRefused(f"{column_map.name}: no row is a rating.{reasons} Check loop and where in the map")
    return chosen, exclusions


def demand_one_file_each(column_map: ColumnMap, lines: Sequence[Line]) -> None:
    """Raise TableRefused for a participant in two PsychoPy files: each file is one session."""
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
    """Return the texts as alternatives for a message."""
    return " or ".join(map(repr, texts))


def _left_out(before: Sequence[Line], after: Sequence[Line], why: str) -> list[Exclusion]:
    if len(before) == len(after):
        return []
    names = list(dict.fromkeys(line.sheet.name for line in before))
    who = names[0] if len(names) == 1 else count(len(names), "file")
    return [Exclusion("rows", who, why, len(before) - len(after))]


def settle_duplicates(
    column_map: ColumnMap, ratings: Sequence[ForeignRating]
) -> tuple[list[ForeignRating], bool, list[Exclusion]]:
    """Return one rating per cell in the order of the file, whether any is a mean, and the exclusions by participant.

    A cell is a participant, an attribute, the within levels and the stimulus. Raises TableRefused on a duplicate that
    the map does not resolve, and where a kept column differs within a cell that is averaged.
    """
    cells: dict[Cell, list[ForeignRating]] = {}
    for rating in ratings:
        cell = (rating.participant, rating.attribute, *rating.within.values(), rating.stimulus)
        cells.setdefault(cell, []).append(rating)
    several = {cell: ratings for cell, ratings in cells.items() if len(ratings) > 1}
    if not several:
        return list(ratings), False, []
    if column_map.duplicates == "refuse":
        cells_text = []
        for own in several.values():
            levels = [f"{factor} {level}" for factor, level in own[0].within.items()]
            stimulus = [f"stimulus {own[0].stimulus}"] if own[0].stimulus else []
            cell_text = ", ".join([f"participant {own[0].participant}", own[0].attribute, *levels, *stimulus])
            places = ", ".join(f"{rating.where} ({rating.value:g})" for rating in own[:MOST_SHOWN])
            cells_text.append(f"{cell_text}: {places}{', ...' if len(own) > MOST_SHOWN else ''}")
        advice = "set duplicates: mean or first, or name the column that distinguishes them under within or stimulus"
        held = f"{count(len(several), 'cell')} {'holds' if len(several) == 1 else 'hold'} several ratings"
        lines = (f"  {line}" for line in some_lines(cells_text, MOST_SHOWN))
        raise TableRefused("\n".join([f"{column_map.name}: {held}; {advice}:", *lines]))
    averaged = column_map.duplicates == "mean"
    settled = [_mean(ratings) if averaged else ratings[0] for ratings in cells.values()]
    return settled, averaged, _exclusions(several, averaged)


def _mean(ratings: Sequence[ForeignRating]) -> ForeignRating:
    first = ratings[0]
    for rating in ratings[1:]:
        for column, text in rating.extra.items():
            if text != first.extra[column]:
                raise TableRefused(
                    f"{rating.where}: {column!r} is {text!r}, but {first.extra[column]!r} at {first.where}, with which"
                    f" it is averaged; leave {column!r} out of keep"
                )
    return first if len(ratings) == 1 else replace(first, value=statistics.mean(r.value for r in ratings))


def _exclusions(several: dict[Cell, list[ForeignRating]], averaged: bool) -> list[Exclusion]:
    people: dict[str, list[int]] = {}
    for cell, ratings in several.items():
        people.setdefault(cell[0], []).append(len(ratings))
    if averaged:
        # One line for each participant, or one for all where their numbers of ratings and cells are alike.
        sums = {person: (sum(counts), len(counts)) for person, counts in people.items()}
        alike = set(sums.values())
        if len(sums) > 1 and len(alike) == 1:
            rated, filled = alike.pop()
            why = f"{count(rated, 'rating')} of each averaged into {count(filled, 'cell')}"
            who = count(len(sums), "participant")
            return [Exclusion("averaged", who, why, len(sums) * rated, len(sums) * filled)]
        return [
            Exclusion("averaged", person, f"{rated} ratings averaged into {count(filled, 'cell')}", rated, filled)
            for person, (rated, filled) in sums.items()
        ]
    return [
        Exclusion(
            "repeated",
            person,
            f"not the first rating of its cell ({count(len(counts), 'cell')})",
            sum(counts) - len(counts),
        )
        for person, counts in people.items()
    ]
