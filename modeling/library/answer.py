"""What goes with every answer about textures: a table on the terminal, a contact sheet, a map."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from palpate.modeling.library.entries import Entry, Kind, Library
from palpate.modeling.library.files import place_of, read_library
from palpate.modeling.library.listing import SURE, table
from palpate.modeling.library.search import chosen
from palpate.modeling.library.wishes import Wish
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.modeling.library.lab import Indexed


WIDTH = 130
"""Of a table that no terminal shows."""
SIMULATED = "These textures are simulated: no person rated them, no material was touched."


@dataclass(frozen=True)
class LibraryRequest:
    """Which textures the command line names, and the form of the answer."""

    lab: Path
    classes: tuple[str, ...]
    kind: Kind | None
    as_json: bool


@dataclass(frozen=True)
class Beside:
    """What stands on a contact sheet beside the textures themselves: over them, and by texture a text and its fit."""

    title: str
    below: Sequence[str] = ()
    texts: Mapping[str, tuple[str, float | None]] | None = None
    wishes: Sequence[Wish] = ()


@dataclass(frozen=True)
class Opened:
    """A lab's library, and the requested textures of it."""

    request: LibraryRequest
    library: Library
    entries: tuple[Entry, ...]

    @property
    def folder(self) -> Path:
        """Where the index lies, and the pictures beside it."""
        return place_of(self.request.lab).parent

    def show(self, entries: Sequence[Entry], extra: Mapping[str, Sequence[str]] | None = None) -> None:
        """Print textures as a table."""
        from rich.console import Console

        console = Console(highlight=False)
        if not console.is_terminal:
            console = Console(highlight=False, width=WIDTH)
        console.print(table(entries, self.library, self.request.kind, extra))
        console.print(SURE, style="dim", soft_wrap=True)

    def close(self, files: Sequence[Path]) -> None:
        """Print what holds for all answers, and the files that were written."""
        if self.library.simulated:
            click.echo(SIMULATED)
        for path in files:
            click.echo(f"Look at {path}")

    def demand(self, sheet: Path | None, plane: Path | None = None) -> None:
        """Raise LibraryError, before anything is computed or written, for a picture that could not be written."""
        if sheet is not None:
            from palpate.modeling.library.contact_sheet import demand_writable as demand_sheet

            demand_sheet(sheet)
        if plane is not None:
            from palpate.modeling.library.map import demand_writable as demand_map

            demand_map(plane)

    def sheet(self, path: Path | None, entries: Sequence[Entry], beside: Beside) -> list[Path]:
        """Write a contact sheet to the path, if there is one."""
        if path is None or not entries:
            return []
        from palpate.modeling.library.contact_sheet import pictures_of, sheet, tiles_of, write_sheet

        foot = "simulated" if self.library.simulated else ""
        tiles = tiles_of(entries, self.library, beside.wishes, self.request.kind, beside.texts)
        write_sheet(path, sheet(tiles, pictures_of(entries, self.folder), beside.title, beside.below, foot))
        return [path]

    def map(self, path: Path | None, marked: Collection[str]) -> list[Path]:
        """Write the map with these textures marked to the path, if there is one."""
        if path is None:
            return []
        from palpate.modeling.library.map import map_data, write_map

        return write_map(path, map_data(self.entries, self.library, self.request.kind), marked)


def opened(request: LibraryRequest) -> Opened:
    """Return the requested library. Raises LibraryError."""
    library = read_library(request.lab)
    return Opened(request, library, chosen(library, request.classes, request.kind))


def tell_index(written: Indexed) -> None:
    """Print what was indexed, what is no longer there, and what could not be taken."""
    counts, library = written.counts, written.indexed.library
    shares = f"{counts['rated']} rated, {counts['predicted']} predicted, {counts['pictures']} with a picture"
    click.echo(f"{count(counts['textures'], 'texture')}: {shares}")
    for line in library.notes:
        click.echo(f"note: {line}")
    for name, why in written.indexed.left_out.items():
        click.echo(f"left out: {name}: {why}")
    if written.gone:
        click.echo(f"no longer there: {', '.join(written.gone)}")
    if library.simulated:
        click.echo(SIMULATED)
    click.echo(f"{written.path}{'' if written.changed else ' (as it was)'}")


def name_of(entry: Entry) -> str:
    """Return a texture's id and label."""
    return entry.id if entry.label in ("", entry.id) else f"{entry.id} ({entry.label})"
