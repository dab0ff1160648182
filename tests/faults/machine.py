"""Faults of the machine, injected below Python's files: system calls that the kernel refuses, and interrupts.

A child of this process installs a seccomp filter, so that the kernel itself answers with ENOSPC, EIO or EROFS, or a
limit on the size of files; then it runs one command line. Nothing of the program is replaced.
"""

from __future__ import annotations

import ctypes
import errno
import fcntl
import mmap
import os
import pickle
import resource
import shutil
import signal
import struct
import sys
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")
CALLS = {
    "write": 1, "pwrite64": 18, "writev": 20, "pwritev": 296, "ftruncate": 77, "truncate": 76, "fallocate": 285,
    "sendfile": 40, "copy_file_range": 326, "sync_file_range": 277, "mmap": 9, "fsync": 74, "fdatasync": 75,
    "openat": 257, "open": 2, "creat": 85, "mkdir": 83, "mkdirat": 258, "rename": 82, "renameat": 264, "renameat2": 316,
    "link": 86, "linkat": 265, "symlink": 88, "symlinkat": 266, "unlink": 87, "unlinkat": 263, "rmdir": 84, "chmod": 90,
}  # fmt: skip
"""Numbers of system calls on x86_64."""
DATA = ("write", "pwrite64", "writev", "pwritev", "ftruncate", "fallocate", "sendfile", "copy_file_range")
NAMES = ("mkdir", "rename", "link", "unlink", "rmdir", "chmod")
SECONDS = 120
CHANGES = {"open", "os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.link", "os.chmod", "sqlite3.connect"}
"""Audit events at which something in the lab may change; an interrupt is raised at each of them in turn."""


ANY_OF, ABOVE = 0x45, 0x25
"""Jumps of a filter: whether an argument has one of these bits, whether it is above this number."""
_TO_WRITE = os.O_WRONLY | os.O_RDWR | os.O_CREAT
ONLY_WHERE = {
    "openat": [(32, ANY_OF, _TO_WRITE)], "open": [(24, ANY_OF, _TO_WRITE)],
    "mmap": [(32, ANY_OF, mmap.PROT_WRITE), (40, ANY_OF, mmap.MAP_SHARED)], **{name: [(16, ABOVE, 2)] for name in DATA},
}  # fmt: skip
"""The calls that matter, by their arguments: opening to write, shared memory of a file, data not to the console."""


def refusing(*names: str, error: int) -> list[tuple[int, ...]]:
    """Return filter steps that let calls fail."""
    return filtering(names, 0x00050000 | error)


def filtering(names: Sequence[str], answer: int) -> list[tuple[int, ...]]:
    """Return filter steps by which the kernel answers calls so, those that matter (ONLY_WHERE)."""
    steps: list[tuple[int, ...]] = []
    for name in names:
        tests = ONLY_WHERE.get(name, [])
        steps += [(0x20, 0, 0, 0), (0x15, 0, 2 * len(tests) + 1, CALLS[name])]
        for left, (argument, jump, value) in zip(range(len(tests), 0, -1), tests, strict=True):
            steps += [(0x20, 0, 0, argument), (jump, 0, 2 * left - 1, value)]
        steps.append((0x06, 0, 0, answer))
    return steps


FAULTS: dict[str, list[tuple[int, ...]]] = {
    "disk full": refusing(*DATA, error=errno.ENOSPC),
    "write error": refusing(*DATA, error=errno.EIO),
    "sync error": refusing("fsync", "fdatasync", error=errno.EIO),
    "read-only": refusing("openat", "open", *NAMES, error=errno.EROFS),
}
MEMORY = "/dev/shm"
"""Files in memory are synced at once."""
SIZE = "size limit"
FULL = "full tmpfs"
FILLER = "filler"
"""The file that fills it."""
INTERRUPT = "interrupt"
PIPE = 2**20
"""Bytes that a pipe from a child takes before anyone reads: a pipe, as limits on files do not hold for it."""


def install(steps: list[tuple[int, ...]], flags: int = 0) -> int:
    """Give the kernel a filter for this process and its children; return 0, or the handle that the flags ask for."""
    program = [*steps, (0x06, 0, 0, 0x7FFF0000)]
    code = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *step) for step in program))
    head = ctypes.create_string_buffer(struct.pack("HxxxxxxQ", len(program), ctypes.addressof(code)))
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(38, 1, 0, 0, 0) or (answer := libc.syscall(317, 1, flags, head)) < 0:
        raise OSError(ctypes.get_errno(), "seccomp")
    return int(answer)


@dataclass(frozen=True)
class Ended:
    """How a command line ended: exit code, what it printed, how often it changed something, what it had imported."""

    code: int
    out: str
    err: str
    changes: int = 0
    modules: tuple[str, ...] = ()


def run_with(fault: str | None, folder: Path, command: Callable[[], int], instant: int = 0) -> Ended:
    """Run a command in a child with `folder` as its working directory and a fault of the machine.

    An interrupt comes before the change with the number `instant`, from 1 on.
    """
    pipes = [os.pipe() for _ in range(4)]
    for _, write in pipes:
        fcntl.fcntl(write, fcntl.F_SETPIPE_SZ, PIPE)
    child = os.fork()
    if child == 0:
        _be_child(fault, folder, command, instant, [write for _, write in pipes])
    signal.alarm(SECONDS)
    _, status = os.waitpid(child, 0)
    signal.alarm(0)
    texts = []
    for read, write in pipes:
        os.close(write)
        with os.fdopen(read, encoding="utf-8", errors="replace") as pipe:
            texts.append(pipe.read())
    out, err, changes, modules = texts
    return Ended(os.waitstatus_to_exitcode(status), out, err, len(changes), tuple(modules.split()))


def _be_child(fault: str | None, folder: Path, command: Callable[[], int], instant: int, channels: list[int]) -> None:
    code = 99
    try:
        os.chdir(folder)
        for number, channel in enumerate(channels[:2], start=1):
            os.dup2(channel, number)
        sys.stdout, sys.stderr = (open(number, "w", encoding="utf-8", closefd=False) for number in (1, 2))  # noqa: SIM115
        counter, imported = channels[2:]
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if fault in FAULTS:
            install(FAULTS[fault])
        elif fault == SIZE:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (512, 512))
        else:
            sys.addaudithook(_Interrupting(folder, counter, instant))
        code = command()
        sys.stdout.flush()
        if fault is None:
            os.write(imported, " ".join(sys.modules).encode())
    except BaseException:
        os.write(2, traceback.format_exc().encode())
    finally:
        os._exit(code)


def in_full_tmpfs(place: Path, base: Path, free: int, act: Callable[[], T]) -> T:
    """Return what a child answers that acts while `place`, a copy of `base`, is a file system with so few bytes free.

    The child has mounts of its own, which end with it. Raises OSError where this machine lets nobody mount.
    """
    place.mkdir()
    size = sum(-(-path.stat().st_size // 4096) * 4096 for path in base.rglob("*") if path.is_file())
    return _answer(lambda: (_mount_tmpfs(place, size + 2**20), shutil.copytree(base, place, dirs_exist_ok=True),
                            _fill(place, free), act())[-1])  # fmt: skip


def may_mount() -> bool:
    """Whether a child of this process may mount a file system for itself."""
    try:
        _answer(lambda: _mount_tmpfs(Path(MEMORY), 4096))
    except OSError:
        return False
    return True


def _answer(act: Callable[[], T]) -> T:
    """Return what a forked child returns, or raise what it raises."""
    read, write = os.pipe()
    if (child := os.fork()) == 0:
        try:
            answer = (True, act())
        except BaseException as error:
            answer = (False, error)
        with os.fdopen(write, "wb") as pipe:
            pickle.dump(answer, pipe)
        os._exit(0)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        succeeded, answer = pickle.load(pipe)
    os.waitpid(child, 0)
    if not succeeded:
        raise answer
    return answer


def _mount_tmpfs(place: Path, size: int) -> None:
    """Mount a file system in memory that only this process and its children see, as root or in a user namespace."""
    libc = ctypes.CDLL(None, use_errno=True)
    mounts, users, private = 0x00020000, 0x10000000, 0x44000
    identity = f"{os.getuid()} {os.getuid()} 1"
    if libc.unshare(mounts) != 0:
        if libc.unshare(mounts | users) != 0:
            raise OSError(ctypes.get_errno(), "unshare")
        Path("/proc/self/uid_map").write_text(identity)
    if libc.mount(b"none", b"/", None, private, None) or libc.mount(
        b"none", str(place).encode(), b"tmpfs", 0, f"size={size}".encode()
    ):
        raise OSError(ctypes.get_errno(), "mount")


def _fill(place: Path, free: int) -> None:
    """Fill the file system, and then give so many bytes back."""
    filler = place / FILLER
    with filler.open("wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(4096))
        except OSError as full:
            if full.errno != errno.ENOSPC:
                raise
    os.truncate(filler, filler.stat().st_size - free)


class _Interrupting:
    """Counts the changes below a folder, and raises SIGINT before one of them."""

    def __init__(self, folder: Path, counter: int, instant: int) -> None:
        self.folder, self.counter, self.instant, self.count = str(folder), counter, instant, 0

    def __call__(self, event: str, arguments: tuple[object, ...]) -> None:
        if event not in CHANGES or (event == "open" and not int(arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR)):
            return
        path = arguments[0]
        if not isinstance(path, str | os.PathLike) or not os.path.abspath(path).startswith(self.folder):  # noqa: PTH100
            return
        self.count += 1
        os.write(self.counter, b".")
        if self.count == self.instant:
            signal.raise_signal(signal.SIGINT)
