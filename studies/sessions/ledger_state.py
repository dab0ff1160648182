"""A ledger's file seen from outside: whether it changed, how its chain ends, and whether a process holds it."""

from __future__ import annotations

import os
import sqlite3
import sys
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote


@dataclass(frozen=True)
class FileState:
    """What distinguishes two states of a ledger: file and write-ahead log, each by size and time of change."""

    size: int
    mtime_ns: int
    wal_size: int
    wal_mtime_ns: int

    @property
    def changed_at(self) -> float:
        """When the ledger was last written, in seconds since 1970."""
        return max(self.mtime_ns, self.wal_mtime_ns) / 1e9


def file_state(path: Path) -> FileState:
    """Return the file's present state; an empty write-ahead log, as a reader may leave, counts as none.

    Raises FileNotFoundError where there is no file.
    """
    file = path.stat()
    try:
        wal = path.with_name(f"{path.name}-wal").stat()
    except FileNotFoundError:
        wal = None
    if wal is None or not wal.st_size:
        return FileState(file.st_size, file.st_mtime_ns, 0, 0)
    return FileState(file.st_size, file.st_mtime_ns, wal.st_size, wal.st_mtime_ns)


def last_hash(path: Path) -> str | None:
    """Return the last link of the event chain in the file, unverified; None if it cannot be read."""
    try:
        with closing(sqlite3.connect(f"file:{quote(os.fsencode(path))}?mode=ro", uri=True)) as connection:
            row = connection.execute("SELECT hash FROM events ORDER BY seq DESC LIMIT 1").fetchone()
    except sqlite3.Error:
        return None
    return None if row is None else str(row[0])


def held(path: Path) -> bool:
    """Return whether a process is running the session in this ledger.

    On POSIX the lock is tried shared, for an instant and without writing: a process that holds it never notices.
    """
    lock = path.resolve().parent / ".locks" / f"{path.name}.lock"
    return lock.exists() and _locked_by_another(lock)


if sys.platform == "win32":

    def _locked_by_another(lock: Path) -> bool:
        from filelock import FileLock, Timeout

        try:
            with FileLock(lock, timeout=0):
                return False
        except Timeout:
            return True

else:

    def _locked_by_another(lock: Path) -> bool:
        import fcntl

        try:
            handle = os.open(lock, os.O_RDONLY | os.O_CLOEXEC)
        except OSError:
            return False
        try:
            fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        finally:
            os.close(handle)
        return False
