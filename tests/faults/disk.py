"""A disk in a power cut: every change that a process makes below a folder, and what may be left of them on the disk.

A child runs under a seccomp filter that asks this process before each system call that changes a file, so that the
calls are known with their data and in their order; nothing of the program is replaced. The model follows SQLite's own
crash tests. On the disk is what was synced. Of every write and truncation since, any part may be there, by sectors of
512 bytes and in any combination; where a file grew without its data, there is nothing, zeros or garbage. A name that
was made, changed or removed is there for sure when its folder was synced, and until then in any combination.
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import random
import select
import socket
import struct
import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tests.faults.machine import CALLS, filtering, install

SECTOR = 512
MAPPED = "-shm"
"""SQLite's index of a write-ahead log: shared memory, which is never synced, and made anew after a crash."""
_ASK, _WITH_LISTENER = 0x7FC00000, 8
_NOTICE, _ANSWER = struct.Struct("=QIIiIQ6Q"), struct.Struct("=QqiI")
_RECEIVE, _SEND, _GOES_ON = 0xC0502100, 0xC0182101, 1
_CREATES, _TRUNCATES, _APPENDS = os.O_CREAT, os.O_TRUNC, os.O_APPEND
_AT_CWD = -100
_PATHS = {
    "open": [(None, 0)], "openat": [(0, 1)], "creat": [(None, 0)], "mkdir": [(None, 0)], "mkdirat": [(0, 1)],
    "unlink": [(None, 0)], "unlinkat": [(0, 1)], "rmdir": [(None, 0)], "rename": [(None, 0), (None, 1)],
    "renameat": [(0, 1), (2, 3)], "renameat2": [(0, 1), (2, 3)], "link": [(None, 0), (None, 1)],
    "linkat": [(0, 1), (2, 3)],
}  # fmt: skip
"""Which arguments of a call name a path: (the handle of its folder, its text)."""
_WITH_PATHS = ("truncate", "symlink", "symlinkat", "renameat2")
INTERCEPTED = (
    "open", "openat", "creat", "write", "pwrite64", "writev", "pwritev", "ftruncate", "truncate", "fallocate", "fsync",
    "fdatasync", "rename", "renameat", "renameat2", "link", "linkat", "symlink", "symlinkat", "unlink", "unlinkat",
    "mkdir", "mkdirat", "rmdir", "sendfile", "copy_file_range", "sync_file_range", "mmap",
)  # fmt: skip


@dataclass(eq=False)
class File:
    """A file, whatever its names; `before` is what it held when the recording began."""

    name: str
    before: bytes = b""


@dataclass(eq=False)
class Folder:
    """A folder; `names` are those that the running system sees."""

    name: str
    names: dict[str, Node] = field(default_factory=dict)


Node = File | Folder


@dataclass(frozen=True)
class Write:
    """Bytes that were written at a place of a file."""

    node: File
    at: int
    data: bytes


@dataclass(frozen=True)
class Truncate:
    """A file that was cut or filled with zeros to a size."""

    node: File
    size: int


@dataclass(frozen=True)
class Names:
    """Names that changed together: (folder, name, what it names now, None for nothing)."""

    changes: tuple[tuple[Folder, str, Node | None], ...]

    @property
    def folders(self) -> set[Folder]:
        """The folders that hold them."""
        return {folder for folder, _, _ in self.changes}


@dataclass(frozen=True)
class Sync:
    """A file or a folder that was synced."""

    node: Node


@dataclass(frozen=True)
class Mark:
    """What the process printed at this moment: from now on it must not be lost."""

    text: str


Step = Write | Truncate | Names | Sync | Mark


@dataclass(frozen=True)
class Recording:
    """A folder as it was, and everything that a process did to it, in order."""

    top: Folder
    before: dict[Folder, dict[str, Node]]
    steps: Sequence[Step]


def record(folder: Path, act: Callable[[Callable[[str], object]], object]) -> Recording:
    """Run `act(mark)` in a child and return what it did below the folder; `mark` puts a Mark among the steps.

    Raises AssertionError where the child fails, or where the steps do not give what the folder holds in the end.
    """
    recorder = _Recorder(folder.resolve())
    ours, its = socket.socketpair()
    child = os.fork()
    if child == 0:
        _be_child(its, ours, act)
    its.close()
    _, handles, _, _ = socket.recv_fds(ours, 1, 1)
    try:
        _listen(handles[0], recorder)
    finally:
        os.close(handles[0])
        ours.close()
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status != 0:
        raise AssertionError(f"the recorded process ended with {status}")
    recording = Recording(recorder.top, recorder.before, recorder.steps)
    _demand_true(folder, recording)
    return recording


def _demand_true(folder: Path, recording: Recording) -> None:
    """The steps, all of them done, must give the folder's files as they are."""
    disk = Disk(recording)
    for step in recording.steps:
        disk.do(step)
    disk.flush()
    files = {path: data for path, data in disk.files() if not path.endswith(MAPPED)}
    actual = {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    actual = {path: data for path, data in actual.items() if not path.endswith(MAPPED)}
    if files != actual:
        wrong = [path for path in files.keys() | actual.keys() if files.get(path) != actual.get(path)]
        raise AssertionError(f"the recording misses something: {sorted(wrong)}")


class Disk:
    """What is on the disk for sure, and what has not been synced yet."""

    def __init__(self, recording: Recording) -> None:
        self.top = recording.top
        self.names = {folder: dict(names) for folder, names in recording.before.items()}
        self.data: dict[File, bytes] = {}
        self.pending: list[Write | Truncate | Names] = []

    def do(self, step: Step) -> None:
        """Take the next step of the recording."""
        match step:
            case Mark():
                return
            case Sync():
                self._sync(step.node)
            case _:
                self.pending.append(step)

    def flush(self) -> None:
        """Put everything on the disk."""
        for step in self.pending:
            self._settle(step)
        self.pending = []

    def after_cut(self, chance: random.Random) -> Disk:
        """Return what may be left when the power goes now."""
        left = Disk.__new__(Disk)
        left.top, left.pending = self.top, []
        left.names = {folder: dict(names) for folder, names in self.names.items()}
        left.data = dict(self.data)
        usual = chance.choice((0.0, 0.1, 0.5, 0.9, 1.0))
        filler = chance.choice((bytes, chance.randbytes))
        for step in self.pending:
            if isinstance(step, Write) and chance.random() < 0.5:
                for part in _sectors(step):
                    left._perhaps(part, chance, usual, filler)
            else:
                left._perhaps(step, chance, usual, filler)
        for file in left.data:
            if file.name.endswith(MAPPED):
                left.data[file] = chance.randbytes(len(left.data[file]))
        return left

    def files(self) -> Iterator[tuple[str, bytes]]:
        """Yield every file that has a name, by its path."""
        for path, node in self._walk(self.top, ""):
            if isinstance(node, File):
                yield path, self._held(node)

    def write_to(self, target: Path) -> None:
        """Make real files and folders of it, for their owner only: modes are not followed."""
        target.mkdir()
        for path, node in self._walk(self.top, ""):
            if isinstance(node, File):
                (target / path).touch(0o600)
                (target / path).write_bytes(self._held(node))
            else:
                (target / path).mkdir(0o700)

    def _held(self, file: File) -> bytes:
        return self.data.get(file, file.before)

    def _walk(self, folder: Folder, path: str) -> Iterator[tuple[str, Node]]:
        for name, node in sorted(self.names.get(folder, {}).items()):
            yield path + name, node
            if isinstance(node, Folder):
                yield from self._walk(node, f"{path}{name}/")

    def _sync(self, node: Node) -> None:
        """Put on the disk what is pending for a file; for a folder its names, with what was renamed from elsewhere."""
        folders = {node} if isinstance(node, Folder) else set()
        chosen = set()
        for place in reversed(range(len(self.pending))):
            match self.pending[place]:
                case Names() as names if names.folders & folders:
                    folders |= names.folders
                    chosen.add(place)
                case Write() | Truncate() as change if change.node is node:
                    chosen.add(place)
        for place in sorted(chosen):
            self._settle(self.pending[place])
        self.pending = [step for place, step in enumerate(self.pending) if place not in chosen]

    def _settle(self, step: Write | Truncate | Names) -> None:
        match step:
            case Write():
                self.data[step.node] = _written(self._held(step.node), step, bytes)
            case Truncate():
                self.data[step.node] = self._held(step.node)[: step.size].ljust(step.size, b"\0")
            case Names():
                for folder, name, node in step.changes:
                    if node is None:
                        self.names.setdefault(folder, {}).pop(name, None)
                    else:
                        self.names.setdefault(folder, {})[name] = node

    def _perhaps(
        self, step: Write | Truncate | Names, chance: random.Random, usual: float, filler: Callable[[int], bytes]
    ) -> None:
        if chance.random() < usual:
            if isinstance(step, Write):
                self.data[step.node] = _written(self._held(step.node), step, filler)
            else:
                self._settle(step)
        elif isinstance(step, Write) and chance.random() < 0.3:  # the new length came to the disk, the data did not
            held, end = self._held(step.node), step.at + len(step.data)
            self.data[step.node] = held + filler(max(0, end - len(held)))


def _written(held: bytes, step: Write, filler: Callable[[int], bytes]) -> bytes:
    return held[: step.at] + filler(max(0, step.at - len(held))) + step.data + held[step.at + len(step.data) :]


def _sectors(step: Write) -> Iterator[Write]:
    """A write in parts, none of which crosses a sector's border."""
    at, end = step.at, step.at + len(step.data)
    while at < end:
        border = min(end, (at // SECTOR + 1) * SECTOR)
        yield Write(step.node, at, step.data[at - step.at : border - step.at])
        at = border


def _be_child(channel: socket.socket, other: socket.socket, act: Callable[[Callable[[str], object]], object]) -> None:
    code = 99
    try:
        other.close()
        output = os.memfd_create("said")
        listener = install(filtering(INTERCEPTED, _ASK), flags=_WITH_LISTENER)
        socket.send_fds(channel, [b"x"], [listener])
        os.close(listener)
        act(lambda text: os.write(output, text.encode()))
        code = 0
    except BaseException:
        os.write(2, traceback.format_exc().encode())
    finally:
        sys.stdout.flush()
        os._exit(code)


def _listen(handle: int, recorder: _Recorder) -> None:
    """Note each call before it is performed, until no process with the filter is left."""
    poll = select.poll()
    poll.register(handle, select.POLLIN)
    while True:
        events = poll.poll()
        if not events[0][1] & select.POLLIN:
            return
        notice = bytearray(_NOTICE.size)
        try:
            fcntl.ioctl(handle, _RECEIVE, notice)
        except OSError:  # the process is gone meanwhile
            continue
        number, process, _, call, _, _, *arguments = _NOTICE.unpack(notice)
        try:
            recorder.note(process, _NAMES[call], arguments)
        finally:
            fcntl.ioctl(handle, _SEND, bytearray(_ANSWER.pack(number, 0, 0, _GOES_ON)))


_NAMES = {CALLS[name]: name for name in INTERCEPTED}


class _Recorder:
    """Turns system calls into steps; its folders' names follow the running system."""

    def __init__(self, place: Path) -> None:
        self.place = str(place)
        self.top = Folder("")
        self.before: dict[Folder, dict[str, Node]] = {}
        self.steps: list[Step] = []
        self._load(place, self.top)

    def _load(self, place: Path, folder: Folder) -> None:
        for path in place.iterdir():
            if path.is_dir():
                inner = folder.names[path.name] = Folder(path.name)
                self._load(path, inner)
            else:
                folder.names[path.name] = File(path.name, path.read_bytes())
        self.before[folder] = dict(folder.names)

    def note(self, process: int, call: str, args: Sequence[int]) -> None:
        """Note one call. Raises AssertionError on one that would make the recording untrue."""
        paths = [_path(process, _AT_CWD if at is None else args[at], args[text]) for at, text in _PATHS.get(call, ())]
        match call:
            case "write" | "pwrite64" | "ftruncate" | "fsync" | "fdatasync":
                self._of_file(process, call, args)
            case "open" | "openat" | "creat":
                self._opened(*paths, {"open": args[1], "openat": args[2]}.get(call, _CREATES | _TRUNCATES))
            case "mkdir" | "mkdirat":
                self._named(*paths, Folder)
            case "unlink" | "rmdir" | "unlinkat":
                if (place := self._find(*paths)) is not None and place[1] in place[0].names:
                    self._change((*place, None))
            case "rename" | "renameat" | "renameat2" if call != "renameat2" or not args[4]:
                self._renamed(*paths)
            case "link" | "linkat":
                if (source := self._find(paths[0])) is not None:
                    self._named(paths[1], lambda _name: source[0].names[source[1]])
            case _:
                self._demand_elsewhere(process, call, args)

    def _demand_elsewhere(self, process: int, call: str, args: Sequence[int]) -> None:
        place = {"mmap": 4, "copy_file_range": 2}.get(call, 0)
        handle = ctypes.c_int32(args[place] & 0xFFFFFFFF).value
        opened = _opened_path(process, handle) if handle >= 0 and call not in _WITH_PATHS else self.place
        if opened.startswith(self.place) and not (call == "mmap" and (handle < 0 or opened.endswith(MAPPED))):
            raise AssertionError(f"{call} is not followed: {opened}")

    def _of_file(self, process: int, call: str, args: Sequence[int]) -> None:
        opened = _opened_path(process, args[0])
        if opened.startswith("/memfd:said") and call == "write":
            self.steps.append(Mark(_memory(process, args[1], args[2]).decode()))
            return
        place = self._find(opened)
        node = self.top if opened == self.place else None if place is None else place[0].names.get(place[1])
        if node is None:  # elsewhere, or deleted
            return
        if call in {"fsync", "fdatasync"}:
            self.steps.append(Sync(node))
        elif not isinstance(node, File):
            raise AssertionError(f"{call} to a folder")
        elif call == "ftruncate":
            self.steps.append(Truncate(node, args[1]))
        else:
            at = args[3] if call == "pwrite64" else _position(process, args[0], opened)
            self.steps.append(Write(node, at, _memory(process, args[1], args[2])))

    def _opened(self, path: str, flags: int) -> None:
        place = self._find(path)
        if place is None:
            return
        node = place[0].names.get(place[1])
        if node is None and flags & _CREATES:
            self._named(path, File)
        elif isinstance(node, File) and flags & _TRUNCATES:
            self.steps.append(Truncate(node, 0))

    def _named(self, path: str, make: Callable[[str], Node]) -> None:
        if (place := self._find(path)) is not None and place[1] not in place[0].names:
            self._change((*place, make(place[1])))

    def _renamed(self, old: str, new: str) -> None:
        source, target = self._find(old), self._find(new)
        if (source is None) != (target is None):
            raise AssertionError(f"{old} is moved across the border of the recording to {new}")
        if source is not None and target is not None and (node := source[0].names.get(source[1])) is not None:
            self._change((*source, None), (*target, node))

    def _change(self, *changes: tuple[Folder, str, Node | None]) -> None:
        for folder, name, node in changes:
            if node is None:
                del folder.names[name]
            else:
                folder.names[name] = node
        self.steps.append(Names(changes))

    def _find(self, path: str) -> tuple[Folder, str] | None:
        """The folder and the name of a path, or None where it is not below the recorded folder."""
        if not path.startswith(f"{self.place}/"):
            return None
        *outer, name = path[len(self.place) + 1 :].split("/")
        folder = self.top
        for part in outer:
            inner = folder.names.get(part)
            if not isinstance(inner, Folder):
                return None
            folder = inner
        return folder, name


def _memory(process: int, at: int, count: int) -> bytes:
    with open(f"/proc/{process}/mem", "rb", buffering=0) as memory:  # noqa: PTH123
        memory.seek(at)
        return memory.read(count)


def _path(process: int, folder: int, at: int) -> str:
    """The absolute path that a call names, its folder's links followed."""
    text = b""
    while b"\0" not in text:  # never beyond the page, as the next one may not be there
        text += _memory(process, at + len(text), 4096 - (at + len(text)) % 4096)
    name = os.fsdecode(text[: text.index(b"\0")])
    signed = ctypes.c_int32(folder & 0xFFFFFFFF).value
    base = Path(f"/proc/{process}", "cwd" if signed == _AT_CWD else f"fd/{signed}").readlink()
    outer, inner = os.path.split(os.path.normpath(base / name))
    return str(Path(outer).resolve() / inner)


def _opened_path(process: int, handle: int) -> str:
    try:
        return str(Path(f"/proc/{process}/fd/{handle}").readlink())
    except OSError:
        return ""


def _position(process: int, handle: int, path: str) -> int:
    fields = dict(line.split(":\t", 1) for line in Path(f"/proc/{process}/fdinfo/{handle}").read_text().splitlines())
    return Path(path).stat().st_size if int(fields["flags"], 8) & _APPENDS else int(fields["pos"])
