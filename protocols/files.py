"""Write files completely or not at all: the only module of the product that writes files.

A file is written beside its place under another name, synced to the disk, and then renamed. If an error or an interrupt
stops the writing, the unfinished file is removed and the earlier one is left as it was. The module is in `protocols`
because every package may import from here; nothing else in `protocols` uses it.
"""

from __future__ import annotations

import errno
import hashlib
import io
import os
import shutil
import stat
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from palpate.protocols.interrupts import holding_interrupts

UNFINISHED = ".unfinished-"
"""Prefix of the names of unfinished files and folders."""
REASONS = {
    errno.ENOSPC: "no space left on the device",
    errno.EDQUOT: "the disk quota is used up",
    errno.EFBIG: "the file would be larger than is allowed here",
    errno.EIO: "the device reports an input/output error",
    errno.EROFS: "the file system is read-only",
    errno.EACCES: "permission denied",
    errno.EPERM: "permission denied",
    errno.ENOENT: "no such file or folder",
    errno.EEXIST: "exists already",
    errno.ENOTDIR: "this is a file; a folder is expected",
    errno.EISDIR: "this is a folder; a file is expected",
    errno.ENOTEMPTY: "the folder is not empty",
    errno.ENAMETOOLONG: "the name is too long",
    errno.EMFILE: "too many files are open in this program",
    errno.ENFILE: "too many files are open on this machine",
    errno.EBUSY: "another program is using it",
    errno.ETXTBSY: "another program is using it",
}


def reason(error: OSError) -> str:
    """Return the system's error in plain words, without the file's name."""
    if error.errno in REASONS:
        return REASONS[error.errno]
    return error.strerror[:1].lower() + error.strerror[1:] if error.strerror else str(error)


Check = Callable[[Path], object]
"""Checks an unfinished file, and raises if it must not get its name."""


def file_sha256(path: Path) -> str:
    """Return the SHA-256 of a file, which may be larger than memory, in hexadecimal digits. Raises OSError."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def write_bytes(path: Path, content: bytes, check: Check | None = None) -> Path:
    """Write a file completely or not at all, creating its folder if it is missing, and return its path.

    Raises OSError with the path as its file name, and the note that the earlier file was left as it was.
    """
    with open_bytes(path, check) as file:
        file.write(content)
    return path


def write_text(path: Path, text: str, errors: str = "strict") -> Path:
    """Write a text as UTF-8 with its line ends unchanged, as `write_bytes` does."""
    return write_bytes(path, text.encode("utf-8", errors))


def write_texts(folder: Path, texts: Mapping[str, str]) -> list[Path]:
    """Write all texts into the folder, by their names there, or none of them, and return their paths."""
    with staged_files(folder) as draft:
        for name, text in texts.items():
            write_text(draft / name, text)
    return [folder / name for name in texts]


@contextmanager
def open_bytes(path: Path, check: Check | None = None) -> Iterator[IO[bytes]]:
    """Open a file for writing that gets its name when the block ends, and is removed if the block raises.

    A device or a pipe is written directly. In a staged folder the file is synced with the folder.
    """
    target = Path(os.path.realpath(path))
    if _is_staged(target) or _is_special(path):
        with _folder_of(path), io.BufferedWriter(_Raw(path, "wb", path)) as file:
            yield file
        return
    draft = _unfinished(target.parent)
    with _reporting(draft, path, _earlier(path)), _folder_of(target):
        try:
            with io.BufferedWriter(_Raw(draft, "xb", path)) as file:
                yield file
                file.flush()
                _sync(file.fileno(), path)
            if check is not None:
                check(draft)
            with holding_interrupts():
                with suppress(FileNotFoundError):
                    draft.chmod(stat.S_IMODE(target.stat().st_mode))
                draft.replace(target)
        except BaseException:
            with holding_interrupts(), suppress(OSError):
                draft.unlink(missing_ok=True)
            raise
        sync_folder(target.parent)


@contextmanager
def open_text(path: Path, errors: str = "strict") -> Iterator[IO[str]]:
    """Open a UTF-8 file for writing with line ends unchanged, as `open_bytes` does."""
    with open_bytes(path) as file:
        text = io.TextIOWrapper(file, "utf-8", errors, newline="")
        try:
            yield text
            text.flush()
        finally:
            with suppress(OSError, ValueError):
                text.detach()


@contextmanager
def staged_folder(folder: Path) -> Iterator[Path]:
    """Yield an empty folder to write into, which takes the place of `folder` when the block ends.

    The old folder is removed then; if the block raises, it is left as it was.
    """
    outer = _unfinished(folder.parent)
    draft, replaced = outer / "new", outer / "replaced"
    with _reporting(draft, folder, _earlier(folder)), _folder_of(folder), _temporary(outer):
        draft.mkdir()
        yield draft
        _sync_tree(draft)
        with holding_interrupts():
            if folder.exists():
                folder.rename(replaced)
            try:
                draft.rename(folder)
            except BaseException:
                if replaced.exists():
                    replaced.rename(folder)
                raise
        sync_folder(folder.parent)


@contextmanager
def staged_files(
    folder: Path, last: Sequence[str] = (), obsolete: Iterable[str] = (), check: Check | None = None
) -> Iterator[Path]:
    """Yield an empty folder to write into, whose files are moved to `folder` at the end, those in `last` as the last.

    The files named in `obsolete`, which is read when the block ends, are removed from `folder`. If the block raises,
    `check` of the synced draft raises, or a file cannot be placed, `folder` stays as it was.
    """
    if _is_staged(folder / "file"):
        folder.mkdir(parents=True, exist_ok=True)
        yield folder
        return
    draft = _unfinished(folder)
    with _reporting(draft, folder, f"{folder} was left as it was"), _folder_of(draft), _temporary(draft):
        yield draft
        _sync_tree(draft)
        with holding_interrupts():
            if check is not None:
                check(draft)
            _place(draft, folder, last, obsolete)


def _place(draft: Path, folder: Path, last: Sequence[str], obsolete: Iterable[str]) -> None:
    """Move every file to its place; move all of them back if one cannot be moved."""
    held = draft.with_name(f"{draft.name}-replaced")
    found = sorted(draft.rglob("*"))
    folders = [path.relative_to(draft) for path in found if path.is_dir()]
    files = sorted((str(path.relative_to(draft)) in last, path.relative_to(draft)) for path in found if path.is_file())
    undo: list[Callable[[], object]] = []
    complete = False

    def sync_folders() -> bool:
        for inner in (folder, *(folder / inner for inner in folders)):
            sync_folder(inner)
        return True

    try:
        for inner in folders:
            if not (folder / inner).is_dir():
                (folder / inner).mkdir()
                undo.append((folder / inner).rmdir)
        for at_the_end, name in files:
            if at_the_end and not complete:  # what says that all is there must not be on the disk before all is
                _set_aside(folder, obsolete, held, undo)
                complete = sync_folders()
            undo.append(_restoring(folder / name, held / name))
            (draft / name).replace(folder / name)
        _set_aside(folder, obsolete, held, undo)
        sync_folders()
    except BaseException:
        for step in reversed(undo):
            with suppress(OSError):
                step()
        raise
    finally:
        shutil.rmtree(held, ignore_errors=True)


def _restoring(path: Path, copy: Path) -> Callable[[], object]:
    """Make a second link to the file, and return a function that restores the file from it."""
    if not path.exists():
        return path.unlink
    copy.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(path, copy)
    except OSError:  # a file system without hard links
        shutil.copy2(path, copy)
    return lambda: copy.replace(path)


def _set_aside(folder: Path, names: Iterable[str], held: Path, undo: list[Callable[[], object]]) -> None:
    for name in names:
        path, away = folder / name, held / name
        if path.is_file() or path.is_symlink():
            away.parent.mkdir(parents=True, exist_ok=True)
            path.replace(away)
            undo.append(lambda path=path, away=away: away.replace(path))  # type: ignore[misc]


def make_folder(folder: Path, mode: int = 0o777) -> list[Path]:
    """Create a folder and its missing parents, synced to the disk, and return the new ones in order.

    Raises OSError after removing the folders that it created.
    """
    made: list[Path] = []
    try:
        for parent in reversed([folder, *folder.parents]):
            if not parent.is_dir():
                made.append(parent)
                parent.mkdir(mode, exist_ok=True)
                sync_folder(parent.parent)
    except BaseException:
        _remove_empty(made)
        raise
    return made


def _remove_empty(folders: Sequence[Path]) -> None:
    for folder in reversed(folders):
        with suppress(OSError):
            folder.rmdir()


def sync_folder(folder: Path) -> None:
    """Sync a folder's entries to the disk, where the system can do that."""
    if os.name != "posix":
        return
    try:
        handle = os.open(folder, os.O_RDONLY)
    except PermissionError:  # a folder that may be written and not be read
        return
    try:
        _sync(handle, folder)
    finally:
        os.close(handle)


class _Raw(io.FileIO):
    """A file whose errors carry the name that the user knows."""

    def __init__(self, file: Path, mode: str, path: Path) -> None:
        self.path = path
        super().__init__(file, mode)

    def write(self, data: Any, /) -> int:
        """Write as FileIO does. Raises OSError with the path."""
        try:
            return super().write(data)
        except OSError as error:
            error.filename = str(self.path)
            raise


def _unfinished(folder: Path) -> Path:
    return folder / f"{UNFINISHED}{os.urandom(6).hex()}"


def _is_staged(path: Path) -> bool:
    return any(part.startswith(UNFINISHED) for part in path.parent.parts)


def _is_special(path: Path) -> bool:
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    return stat.S_ISCHR(mode) or stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode)


def _earlier(path: Path) -> str:
    return "it was left as it was" if path.exists() else "nothing was written"


@contextmanager
def _reporting(draft: Path, path: Path, note: str) -> Iterator[None]:
    """Put the user's name of the file into an OSError within the block, and add a note on what became of it."""
    try:
        yield
    except OSError as error:
        if error.errno is None:
            raise
        inside = [Path(name) for name in (error.filename, error.filename2) if isinstance(name, str | os.PathLike)]
        for name in inside:
            if name == draft or draft in name.parents:
                error.filename, error.filename2 = str(path / name.relative_to(draft)), None
        if error.errno in REASONS and error.filename is not None and path in (p := Path(error.filename), *p.parents):
            error.add_note(note)
        raise


@contextmanager
def _folder_of(path: Path) -> Iterator[None]:
    """Create the folder of a file; remove it again if the block raises and left it empty."""
    made = make_folder(path.parent)
    try:
        yield
    except BaseException:
        _remove_empty(made)
        raise


@contextmanager
def _temporary(folder: Path) -> Iterator[None]:
    try:
        folder.mkdir()
        yield
    finally:
        with holding_interrupts():
            shutil.rmtree(folder, ignore_errors=True)


def _sync_tree(folder: Path) -> None:
    for path in (folder, *folder.rglob("*")):
        if path.is_dir():
            sync_folder(path)
        elif path.is_file():
            handle = os.open(path, os.O_RDONLY if os.name == "posix" else os.O_RDWR)
            try:
                _sync(handle, path)
            finally:
                os.close(handle)


def _sync(handle: int, path: Path) -> None:
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno in (errno.EINVAL, errno.ENOTSUP):  # a file system that cannot
            return
        if error.errno is not None:
            error.filename = str(path)
        raise
