"""Files of the library and its pictures: written whole or not at all, and only into a folder that is there."""

from __future__ import annotations

import os
from pathlib import Path

from palpate.modeling.library.entries import LibraryError
from palpate.protocols.files import reason, write_bytes


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
