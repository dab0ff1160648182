"""A folder's table of ratings alone: where no model looks at pictures, none of their features is computed."""

from __future__ import annotations

from pathlib import Path

from modeling.attributes import reading_folder
from modeling.attributes.material import Material, MaterialError, Texture
from modeling.attributes.reading_columns import rated_in
from modeling.attributes.reading_ratings import attributes_of
from studies.content import file_sha256


def read_rated(folder: Path, table: Path | None = None, scale: tuple[float, float] | None = None) -> Material:
    """The textures of the table with their ratings, read and refused as by `reading_folder.read_folder`."""
    table = table or reading_folder.table_in(folder)
    lines, columns = reading_folder.lines_of(table, attributes_of(None))
    ends = scale or reading_folder.SCALE
    if not ends[0] < ends[1]:
        raise MaterialError(f"a scale from {ends[0]:g} to {ends[1]:g}: the lower end comes first")
    rated = [rated_in(line.cells, line.place, columns, ends) for line in lines]
    if scale is None:
        reading_folder.demand_wide(table, [line for line, each in zip(lines, rated, strict=True) if each], columns)
    textures = tuple(
        Texture(line.id, line.cells.get("label") or line.id, _category(line), rated=each)
        for line, each in zip(lines, rated, strict=True)
    )
    return Material(textures, columns.pairs, notes=(*columns.notes, f"ratings: {table.name} {file_sha256(table)}"))


def _category(line: reading_folder.Line) -> str:
    return line.cells.get("category") or line.cells.get("class") or ""
