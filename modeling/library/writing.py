"""Files of the library and its pictures: written whole or not at all, and only into a folder that is there."""

from __future__ import annotations

import os
from pathlib import Path

from modeling.library.entries import LibraryError


def demand_folder(path: Path) -> None:
    """Raise LibraryError unless there is a folder for the file that is to be written, which can be written to."""
    folder = path.parent
    if not folder.is_dir():
        raise LibraryError(f"{path}: there is no folder {folder}; make it first, or name a file in another one.")
    if not os.access(folder, os.W_OK):
        raise LibraryError(f"{path}: nothing can be written in {folder}; name a file in another folder.")


def write_whole(path: Path, content: bytes) -> None:
    """Write a file beside its place, then rename it: until then the earlier one is there. Raises LibraryError."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with part.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        raise LibraryError(f"{path}: it cannot be written ({error.strerror}); any earlier one is as it was.") from None
    finally:
        part.unlink(missing_ok=True)
