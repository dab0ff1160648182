"""The library as a file: LAB/library/index.json, written atomically; newer or damaged files are refused."""

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
    """Return the path of a lab's library, or the path itself where it is a .json file."""
    return lab if lab.suffix == ".json" else lab / FOLDER / INDEX


def read_library(lab: Path) -> Library:
    """Return a lab's library, or the one in a file.

    Raises LibraryError for a file that is missing, newer, of another format, cut short, or changed since then.
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
    """Write a lab's library with a digest, atomically; return the path, and whether the file changed.

    A file with equal content is not rewritten. Raises LibraryError where it cannot be written.
    """
    from palpate.analysis.regenerating.outputs import readable_json

    plain = library.model_dump(mode="json")
    content = (readable_json({**plain, "digest": digest(plain)}) + "\n").encode()
    path = place_of(lab)
    if path.is_file() and path.read_bytes() == content:
        return path, False
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, content)
    return path, True


def earlier_in(lab: Path) -> Library | None:
    """Return a lab's library; None where it cannot be read. Raises NewerLibrary, which must not be overwritten."""
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
    """Raise LibraryError unless the folder of a file to write exists and is writable."""
    folder = path.parent
    if not folder.is_dir():
        raise LibraryError(f"{path}: there is no folder {folder}; make it first, or name a file in another one.")
    if not os.access(folder, os.W_OK):
        raise LibraryError(f"{path}: nothing can be written in {folder}; name a file in another folder.")


def write_whole(path: Path, content: bytes) -> None:
    """Write a file atomically. Raises LibraryError where it cannot be written; an earlier file is then unchanged."""
    try:
        write_bytes(path, content)
    except OSError as error:
        raise LibraryError(f"{path}: it cannot be written ({reason(error)}); any earlier one is as it was.") from None
