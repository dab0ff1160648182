"""From foreign tables to ratings by a column map: the whole table, or a refusal that names the line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd

from palpate.analysis.importing.dialects import Sheet, TableRefused, read_sheet
from palpate.analysis.importing.foreign_ratings import ForeignRating, ratings_of, settle_duplicates
from palpate.analysis.importing.map_file import ColumnMap, MapRefused, read_map
from palpate.analysis.ratings.dataset import Crossing, Exclusion, Input, Ratings, natural
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.files import file_sha256
from palpate.protocols.wording import count, some

__all__ = ["MapRefused", "TableRefused", "import_table"]


def import_table(map_path: Path, data_path: Path | None = None) -> Ratings:
    """Return the ratings that the map at `map_path` defines in its files, or in `data_path` (a file, or their folder).

    Nothing is guessed: an ambiguous delimiter or decimal mark, a value that is not finite or off the scale, a missing
    level, a cell filled twice are refused (TableRefused) unless the map says what to do; everything left out or
    averaged then has a line in `exclusions`. Raises MapRefused on a mistake in the map, OSError on a file that cannot
    be read.
    """
    column_map = read_map(map_path)
    sheets = _sheets(column_map, map_path, data_path)
    ratings, exclusions = ratings_of(column_map, sheets)
    settled, averaged, more = settle_duplicates(column_map, ratings)
    empty = "empty: delimiters only"
    blank = [Exclusion("rows", sheet.name, empty, sheet.empty_rows) for sheet in sheets if sheet.empty_rows]
    exclusions = [*blank, *exclusions, *more]
    table = _rating_table(column_map, settled)
    scale = column_map.scale.scale() if column_map.scale else None
    declared = column_map.columns.attribute.declared if column_map.columns.attribute else ()
    attributes = tuple(dict.fromkeys((*declared, *table["attribute"].tolist())))
    for key in ("antonyms", "categories"):
        for attribute in getattr(column_map, key):
            if attribute not in attributes:
                raise MapRefused(
                    f"{key}: {attribute!r} is not an attribute of the table; {nearest(attribute, attributes)}"
                )
    notes = [f"{count(len(sheet.rows), 'row')}, {sheet.encoding}, delimiter {sheet.delimiter!r}" for sheet in sheets]
    return Ratings(
        name=column_map.name,
        table=table,
        within=column_map.within,
        between=tuple(column_map.columns.between),
        attributes=attributes,
        # A mean of several ratings stands between the steps.
        scale=replace(scale, step=None) if scale and averaged else scale,
        inputs=(
            Input(map_path.name, file_sha256(map_path), "the column map"),
            *(Input(sheet.name, sheet.sha256, note) for sheet, note in zip(sheets, notes, strict=True)),
        ),
        exclusions=tuple(exclusions),
        antonyms=column_map.antonyms,
        categories=column_map.categories,
        crossings=_crossings(column_map, table),
        source=column_map.source,
        licence=column_map.licence,
    )


def _rating_table(column_map: ColumnMap, ratings: Sequence[ForeignRating]) -> pd.DataFrame:
    """Return the ratings in long form, one per row, with the columns that the map names."""
    stimulus = {"stimulus": [r.stimulus for r in ratings]} if column_map.columns.stimulus else {}
    return pd.DataFrame(
        {
            "participant": [r.participant for r in ratings],
            "attribute": [r.attribute for r in ratings],
            "value": pd.Series([r.value for r in ratings], dtype="float64"),
            **{factor: [r.within[factor] for r in ratings] for factor in column_map.within},
            **{factor: [r.between[factor] for r in ratings] for factor in column_map.columns.between},
            **stimulus,
            **{column: [r.extra[column] for r in ratings] for column in column_map.columns.keep},
        }
    )


def _sheets(column_map: ColumnMap, map_path: Path, data_path: Path | None) -> list[Sheet]:
    folder = map_path.parent if data_path is None else data_path
    if folder.is_file():
        paths = [folder]
    elif not folder.is_dir():
        raise TableRefused(f"{folder}: no such file or folder; name the table or its folder")
    else:
        matches: dict[Path, None] = {}
        for pattern in column_map.files:
            matched = {str(path): path for path in folder.glob(pattern) if path.is_file()}
            if not matched:
                there = sorted(path.name for path in folder.iterdir())
                raise TableRefused(
                    f"{folder}: no file matches {pattern!r}; the folder holds: {some(there) or 'nothing'}"
                )
            matches.update(dict.fromkeys(matched[name] for name in natural(matched)))
        paths = list(matches)
    names = [path.name for path in paths]
    if len(set(names)) < len(names):  # with their folders where two files share a name
        names = [path.relative_to(folder).as_posix() for path in paths]
    return [
        read_sheet(
            path,
            name,
            encodings=column_map.encoding,
            delimiter=column_map.delimiter,
            required=column_map.column_names(),
            trim=column_map.trim,
        )
        for path, name in zip(paths, names, strict=True)
    ]


def _crossings(column_map: ColumnMap, table: pd.DataFrame) -> tuple[Crossing, ...]:
    """Return the declared cells: if the map lists the levels of some factor, the others have those that occur."""
    declared = {factor: tuple(levels) for factor, levels in column_map.loop.items()}
    declared |= {factor: source.declared for factor, source in column_map.columns.within.items() if source.declared}
    if not declared:
        return ()
    crossings = []
    groups: list[tuple[dict[str, str], pd.DataFrame]] = [({}, table)]
    if names := tuple(column_map.columns.between):
        labels = list(zip(*(table[name].tolist() for name in names), strict=True))
        groups = [
            (dict(zip(names, group, strict=True)), table[[label == group for label in labels]])
            for group in sorted(set(labels))
        ]
    for between, rows in groups:
        observed = {factor: natural(rows[factor].tolist()) for factor in column_map.within}
        crossings.append(Crossing(between, {**observed, **declared}))
    return tuple(crossings)
