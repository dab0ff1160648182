"""Answers about a lab's textures: a table on the terminal, a contact sheet, a map."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from palpate.modeling.library.entries import Entry, Kind, Library
from palpate.modeling.library.files import place_of, read_library
from palpate.modeling.library.listing import SURE, table
from palpate.modeling.library.search import select_textures
from palpate.modeling.library.wishes import Wish
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.modeling.library.lab import IndexResult


WIDTH = 130
"""The width in characters of a table that is not printed to a terminal."""
SIMULATED = "These textures are simulated: no person rated them, no material was touched."


@dataclass(frozen=True)
class LibraryRequest:
    """The textures that the command line selects, and the form of the answer."""

    lab: Path
    classes: tuple[str, ...]
    kind: Kind | None
    as_json: bool


@dataclass(frozen=True)
class Beside:
    """Texts of a contact sheet: a title, lines below it, by texture a text and its fit (0 to 1), and the wishes."""

    title: str
    below: Sequence[str] = ()
    texts: Mapping[str, tuple[str, float | None]] | None = None
    wishes: Sequence[Wish] = ()


@dataclass(frozen=True)
class LabLibrary:
    """A lab's library with the requested textures, printed and drawn."""

    request: LibraryRequest
    library: Library
    entries: tuple[Entry, ...]

    @property
    def folder(self) -> Path:
        """The folder of the index and its pictures."""
        return place_of(self.request.lab).parent

    def show(self, entries: Sequence[Entry], extra: Mapping[str, Sequence[str]] | None = None) -> None:
        """Print textures as a table; `extra` holds further columns by heading."""
        from rich.console import Console

        console = Console(highlight=False)
        if not console.is_terminal:
            console = Console(highlight=False, width=WIDTH)
        console.print(table(entries, self.library, self.request.kind, extra))
        console.print(SURE, style="dim", soft_wrap=True)

    def close(self, files: Sequence[Path]) -> None:
        """Print whether the textures are simulated, and the files that were written."""
        if self.library.simulated:
            click.echo(SIMULATED)
        for path in files:
            click.echo(f"Look at {path}")

    def demand(self, sheet: Path | None, plane: Path | None = None) -> None:
        """Raise LibraryError where the contact sheet or the map cannot be written."""
        if sheet is not None:
            from palpate.modeling.library.contact_sheet import demand_writable as demand_sheet

            demand_sheet(sheet)
        if plane is not None:
            from palpate.modeling.library.map import demand_writable as demand_map

            demand_map(plane)

    def sheet(self, path: Path | None, entries: Sequence[Entry], beside: Beside) -> list[Path]:
        """Write a contact sheet to the path, if there is one; return the files."""
        if path is None or not entries:
            return []
        from palpate.modeling.library.contact_sheet import pictures_of, sheet, tiles_of, write_sheet

        foot = "simulated" if self.library.simulated else ""
        tiles = tiles_of(entries, self.library, beside.wishes, self.request.kind, beside.texts)
        write_sheet(path, sheet(tiles, pictures_of(entries, self.folder), beside.title, beside.below, foot))
        return [path]

    def map(self, path: Path | None, marked: Collection[str]) -> list[Path]:
        """Write the map with these textures marked to the path, if there is one; return the files."""
        if path is None:
            return []
        from palpate.modeling.library.map import map_data, write_map

        return write_map(path, map_data(self.entries, self.library, self.request.kind), marked)


def open_library(request: LibraryRequest) -> LabLibrary:
    """Return the requested library. Raises LibraryError."""
    library = read_library(request.lab)
    return LabLibrary(request, library, select_textures(library, request.classes, request.kind))


def print_index(written: IndexResult) -> None:
    """Print the textures that were indexed, left out and removed, and the notes."""
    counts, library = written.counts, written.indexed.library
    shares = f"{counts['rated']} rated, {counts['predicted']} predicted, {counts['pictures']} with a picture"
    click.echo(f"{count(counts['textures'], 'texture')}: {shares}")
    for line in library.notes:
        click.echo(f"note: {line}")
    for name, why in written.indexed.left_out.items():
        click.echo(f"left out: {name}: {why}")
    if written.removed:
        click.echo(f"no longer there: {', '.join(written.removed)}")
    if library.simulated:
        click.echo(SIMULATED)
    click.echo(f"{written.path}{'' if written.changed else ' (as it was)'}")


def name_of(entry: Entry) -> str:
    """Return a texture's id and label."""
    return entry.id if entry.label in ("", entry.id) else f"{entry.id} ({entry.label})"
