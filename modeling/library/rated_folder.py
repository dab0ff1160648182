"""A folder's table of ratings alone: where no model looks at pictures, none of their features is computed."""

from __future__ import annotations

from pathlib import Path

from palpate.modeling.attributes.material import Material, Texture
from palpate.modeling.attributes.reading_folder import rated_lines
from palpate.modeling.attributes.reading_ratings import attributes_of
from palpate.protocols.files import file_sha256


def read_rated(folder: Path, table: Path | None = None, scale: tuple[float, float] | None = None) -> Material:
    """The textures of the table with their ratings, read and refused as by `reading_folder.read_folder`."""
    table, lines, columns = rated_lines(folder, table, attributes_of(None), scale)
    textures = tuple(Texture(line.id, line.label, line.category, rated=line.rated) for line in lines)
    return Material(textures, columns.pairs, notes=(*columns.notes, f"ratings: {table.name} {file_sha256(table)}"))
