"""Door profiles and mean ratings from a table: one row for each stimulus, beside the files of its profiles."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from palpate.modeling.doors.data import DoorData
from palpate.modeling.doors.rated import demand_learnable, merged_sources
from palpate.modeling.doors.reading import read_profile
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.files import file_sha256
from palpate.protocols.tables import Row, TableFormat
from palpate.protocols.tables import read_table as open_table
from palpate.protocols.wording import count, some
from palpate.signals.arrays import Array

NEEDED = ("id", "door", "variant", "file")
OPTIONAL = ("source", "group", "raters")
SD = ".sd"
MOST_RATERS = 10**9
ORIGINS = ("measured", "simulated")
"""The values of a stimulus table's column `source` that state where a profile comes from, not which stimuli are
related.
"""


RATED = TableFormat(
    error=ModelDataError,
    strict=True,
    encoding=lambda wrong: f"{wrong.path}: byte {wrong.byte} is not UTF-8; save the table as UTF-8",
    width=lambda wrong: f"{wrong.where}: {count(wrong.cells, 'cell')} found, {len(wrong.header)} columns are expected",
)


def read_table(
    table: Path, *, attributes: Mapping[str, str] | None = None, scale: tuple[float, float] = (-10.0, 10.0),
    simulated: bool = False,
) -> DoorData:  # fmt: skip
    """Return the stimuli of a CSV table with columns id, door, variant, file and one for each attribute's low word.

    An attribute's column holds the mean rating on `scale`; LOW.sd, where it is there, the SD between raters (else NaN:
    not known). `source` groups stimuli that were made from one another; `group` names who rated and `raters` says how
    many did (0: not known). A file's path is relative to the table. `attributes` maps low words to antonyms, by default
    the seven of door_ratings (thesis Table 5.2). `simulated` is for ratings of simulated people. Raises ModelDataError,
    with the line, on an unknown or missing column, a duplicate name, a cell that is not a number or off the scale, a
    profile that cannot be read, and on fewer than two different profiles or sources.
    """
    attributes = attributes or shipped_attributes()
    rows = _rows(table, attributes)
    if not rows:
        raise ModelDataError(f"{table}: no stimulus under the header; one a line is expected")
    number = np.array([[_rating(row, name, scale) for name in attributes] for row in rows])
    ids = tuple(_text(row, "id") for row in rows)
    for place, name in enumerate(ids):
        if name in ids[:place]:
            raise ModelDataError(f"{rows[place].where}: the stimulus {name!r} appears there twice")
    force = np.array([_profile(row, table.parent) for row in rows])
    alike = merged_sources(ids, force)
    data = DoorData(
        attributes=tuple(attributes),
        antonyms=tuple(attributes.values()),
        scale=scale,
        ids=ids,
        doors=tuple(_text(row, "door") for row in rows),
        variants=tuple(_text(row, "variant") for row in rows),
        source=tuple(_source(row, same) for row, same in zip(rows, alike, strict=True)),
        groups=tuple(row.cells.get("group", "") for row in rows),
        force_N=force,
        rating=number,
        sd=np.array([[_sd(row, name) for name in attributes] for row in rows]),
        raters=np.array([_raters(row) for row in rows], dtype=np.int64),
        simulated=simulated,
        made_from=(f"{table.name} {file_sha256(table)}",),
    )
    demand_learnable(data)
    return data


def shipped_attributes() -> dict[str, str]:
    """Return the low words and antonyms of the shipped study door_ratings, in its order (thesis Table 5.2)."""
    from palpate.studies.catalogue import SHIPPED, STUDY_FILE, read_study

    study = read_study(SHIPPED / "door_ratings" / STUDY_FILE).study
    return {attribute.name: attribute.high for attribute in study.attributes}


def _rows(path: Path, attributes: Mapping[str, str]) -> list[Row]:
    table = open_table(path, (), RATED)
    known = (*NEEDED, *OPTIONAL, *attributes, *(f"{name}{SD}" for name in attributes))
    for name in table.header:
        if name not in known:
            raise ModelDataError(f"{path}, line 1: no column is called {name!r}; {nearest(name, known)}")
        if table.header.count(name) > 1:
            raise ModelDataError(f"{path}, line 1: the column {name!r} appears there twice")
    for name in (*NEEDED, *attributes):
        if name not in table.header:
            why = "" if name in NEEDED else ", the mean rating on this attribute"
            raise ModelDataError(f"{path}, line 1: a column {name!r} is expected{why}; found {some(table.header)}")
    return list(table.rows())


def _text(row: Row, column: str) -> str:
    if not row.cells[column]:
        raise ModelDataError(f"{row.where}: the column {column!r} is empty")
    return row.cells[column]


def _rating(row: Row, column: str, scale: tuple[float, float]) -> float:
    value = row.number(column)
    if not scale[0] <= value <= scale[1]:
        raise ModelDataError(
            f"{row.where}: {column} is {value:g}, a mean rating on the scale from {scale[0]:g} to {scale[1]:g} is"
            " expected"
        )
    return value


def _sd(row: Row, attribute: str) -> float:
    column = f"{attribute}{SD}"
    if not row.cells.get(column):
        return math.nan
    value = row.number(column)
    if value < 0:
        raise ModelDataError(f"{row.where}: {column} is {value:g}, an SD of 0 or more is expected")
    return value


def _raters(row: Row) -> int:
    if not row.cells.get("raters"):
        return 0
    value = row.number("raters")
    if value != int(value) or not 1 <= value <= MOST_RATERS:
        raise ModelDataError(f"{row.where}: raters is {value:g}, a whole number of people is expected")
    return int(value)


def _source(row: Row, alike: str) -> str:
    """Return the name of the stimulus' source: by default itself, shared by all stimuli with the same profile."""
    given = row.cells.get("source", "")
    return alike if given in ("", *ORIGINS) else given


def _profile(row: Row, folder: Path) -> Array:
    file = folder / _text(row, "file")
    if not file.is_file():
        raise ModelDataError(f"{row.where}: no door profile {file}")
    try:
        return read_profile(file)
    except ModelDataError as error:
        raise ModelDataError(f"{row.where}: {error}") from None
