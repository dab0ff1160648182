"""A ledger's file seen from outside: whether it changed, and whether a process holds it."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class FileState:
    """What tells one state of a ledger from the next: file and write-ahead log, each by size and time of change."""

    inode: int
    size: int
    mtime_ns: int
    wal_size: int
    wal_mtime_ns: int

    @property
    def changed_at(self) -> float:
        """When something was last written, in seconds since 1970."""
        return max(self.mtime_ns, self.wal_mtime_ns) / 1e9


def file_state(path: Path) -> FileState:
    """The file's state now. Raises FileNotFoundError where there is no file."""
    found = path.stat()
    try:
        wal = path.with_name(f"{path.name}-wal").stat()
    except FileNotFoundError:
        return FileState(found.st_ino, found.st_size, found.st_mtime_ns, 0, 0)
    return FileState(found.st_ino, found.st_size, found.st_mtime_ns, wal.st_size, wal.st_mtime_ns)


def held(path: Path) -> bool:
    """Whether a process is running the session in this ledger.

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
