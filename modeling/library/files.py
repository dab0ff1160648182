"""The library as a file: LAB/library/index.json, written whole or not at all; what is newer or damaged is refused."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from palpate.modeling.library.entries import FORMAT, Library, LibraryError
from palpate.protocols.canonical import digest, parse
from palpate.protocols.files import reason, write_bytes
from palpate.signals.models.card import complaint

FOLDER, INDEX = "library", "index.json"
AGAIN = "`palpate textures index` makes it again from the lab's ratings and recordings."
FAMILY = FORMAT.rpartition("/")[0]


class NewerLibrary(LibraryError):
    """A library that a later version wrote: it is neither read nor overwritten."""


def place_of(lab: Path) -> Path:
    """Return where a lab's library lies; the file itself where one was given."""
    return lab if lab.suffix == ".json" else lab / FOLDER / INDEX


def read_library(lab: Path) -> Library:
    """Return a lab's library, or the one in a file.

    Raises LibraryError for a file that is missing, newer, foreign, cut short, or was changed since it was written.
    """
    path = place_of(lab)
    plain = _parsed(path)
    written = plain.pop("digest", None) if isinstance(plain, dict) else None
    if not isinstance(plain, dict) or not isinstance(plain.get("format"), str):
        raise LibraryError(f"{path}: this is not a library of textures ({FORMAT} is expected). {AGAIN}")
    if plain["format"] != FORMAT:
        other = plain["format"]
        if other.startswith(f"{FAMILY}/"):
            raise NewerLibrary(f"{path}: format {other!r}; this version reads {FORMAT!r}. Update palpate to use it.")
        raise LibraryError(f"{path}: format {other[:40]!r}; a library of textures has {FORMAT!r}. {AGAIN}")
    if written != digest(plain):
        raise LibraryError(
            f"{path}: its content is not what was written (its digest differs): damaged or edited. {AGAIN}"
        )
    try:
        return Library.model_validate(plain)
    except ValidationError as error:
        raise LibraryError(f"{path}: {complaint(error)}. {AGAIN}") from None


def write_library(lab: Path, library: Library) -> tuple[Path, bool]:
    """Write a lab's library, readable and with a digest; the path, and whether anything changed.

    Until the last moment the earlier one is there; equal content is left alone.
    """
    from palpate.analysis.regenerating.outputs import readable_json

    plain = library.model_dump(mode="json")
    # the plain values of a texture stand on one line
    content = (readable_json({**plain, "digest": digest(plain)}) + "\n").encode()
    path = place_of(lab)
    if path.is_file() and path.read_bytes() == content:
        return path, False
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, content)
    return path, True


def earlier_in(lab: Path) -> Library | None:
    """The library that a lab has, where it can be read. Raises NewerLibrary: that one must not be overwritten."""
    try:
        return read_library(lab)
    except NewerLibrary:
        raise
    except LibraryError:
        return None


def _parsed(path: Path) -> Any:
    if not path.is_file():
        raise LibraryError(f"{path}: there is no library of textures yet. `palpate textures index` makes it.")
    try:
        return parse(path.read_bytes())
    except (ValueError, RecursionError) as error:
        raise LibraryError(f"{path}: it cannot be read ({error}): cut short or damaged. {AGAIN}") from None


def demand_folder(path: Path) -> None:
    """Raise LibraryError unless there is a folder for the file that is to be written, which can be written to."""
    folder = path.parent
    if not folder.is_dir():
        raise LibraryError(f"{path}: there is no folder {folder}; make it first, or name a file in another one.")
    if not os.access(folder, os.W_OK):
        raise LibraryError(f"{path}: nothing can be written in {folder}; name a file in another folder.")


def write_whole(path: Path, content: bytes) -> None:
    """Write a file beside its place, then rename it: until then the earlier one is there. Raises LibraryError."""
    try:
        write_bytes(path, content)
    except OSError as error:
        raise LibraryError(f"{path}: it cannot be written ({reason(error)}); any earlier one is as it was.") from None
