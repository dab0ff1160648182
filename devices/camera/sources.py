"""Sources of pictures: a folder that a tethered camera fills, or a twin."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from palpate.devices.device import DeviceError, DeviceFault
from palpate.protocols.events import Sense

LOOK_S = 0.2
"""Seconds between two looks at the folder."""
LARGEST_BYTES = 2**30
Stamp = tuple[int, int]
"""Size of a file and time of its last change."""
PicturesOf = Callable[[Sense], Iterable[bytes]]


@dataclass(frozen=True)
class Arrived:
    """A picture that seems to be complete."""

    name: str
    data: bytes


@dataclass
class Folder:
    """A folder of files; each is returned once its size has not changed for `settle_s`."""

    device: str
    path: Path
    suffixes: tuple[str, ...]
    settle_s: float
    order: Literal["name", "time"]
    known: dict[str, Stamp] = field(default_factory=dict)
    waiting: dict[str, tuple[Stamp, float]] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    looked_s: float = float("-inf")

    def demand(self) -> None:
        """Raise DeviceError if the folder cannot be read."""
        try:
            self._files()
        except OSError as error:
            raise DeviceError(
                f"{self.device}: the camera's folder {self.path} cannot be read: {error.strerror}"
            ) from None

    def begin(self, request: Sense) -> None:  # noqa: ARG002 - a real camera need not know what it is asked for
        """Mark all present files as older than the request."""
        self.known, self.waiting, self.refused, self.looked_s = self._there(), {}, {}, float("-inf")

    def new(self, now_s: float) -> Sequence[Arrived]:
        """Return files that have stopped changing, sorted by name or by the time of their last change."""
        if now_s - self.looked_s < LOOK_S:
            return ()
        self.looked_s = now_s
        there = self._there()
        self.waiting = {name: stamp for name, stamp in self.waiting.items() if name in there}
        still = []
        for name, stamp in there.items():
            if self.known.get(name) != stamp and stamp[0] > 0:
                before = self.waiting.get(name)
                if before is None or before[0] != stamp:
                    self.waiting[name] = (stamp, now_s)
                elif now_s - before[1] >= self.settle_s:
                    still.append(name)
        still.sort(key=lambda name: (there[name][1], name) if self.order == "time" else (0, name))
        return [self._read(name, there[name]) for name in still]

    def _read(self, name: str, stamp: Stamp) -> Arrived:
        self.known[name] = stamp
        self.waiting.pop(name, None)
        self.refused.pop(name, None)
        if stamp[0] > LARGEST_BYTES:
            raise self._lost(f"{name} has {stamp[0]} bytes: no picture is so large")
        try:
            return Arrived(name, (self.path / name).read_bytes())
        except OSError as error:
            raise self._lost(f"{name} cannot be read: {error.strerror}") from None

    def _there(self) -> dict[str, Stamp]:
        try:
            return self._files()
        except OSError as error:
            raise self._lost(f"the folder {self.path} cannot be read: {error.strerror}") from None

    def _files(self) -> dict[str, Stamp]:
        with os.scandir(self.path) as entries:
            files = [entry for entry in entries if entry.name.lower().endswith(self.suffixes)]
            return {entry.name: stamp for entry in files if (stamp := _stamp(entry)) is not None}

    def _lost(self, message: str) -> DeviceFault:
        return DeviceFault(self.device, "link_lost", f"{self.device}: {message}")

    def refuse(self, name: str, why: str) -> None:
        """Remember why a file is refused."""
        self.refused[name] = why

    def broken(self) -> Sequence[str]:
        """Return messages on files that are not complete, or still change."""
        return [
            *(f"{name} is broken ({why})" for name, why in sorted(self.refused.items())),
            *(f"{name} is still being written" for name in sorted(self.waiting)),
        ]


@dataclass
class Simulated:
    """A simulated camera that takes a picture at each look; `suffix` is that of its files."""

    device: str
    pictures_of: PicturesOf | None = None
    coming: Iterator[bytes] = field(default_factory=lambda: iter(()))
    count: int = 0
    suffix: str = ".png"

    def begin(self, request: Sense) -> None:
        """Start over. Raises DeviceError if there are no pictures."""
        if self.pictures_of is None:
            raise DeviceError(f"{self.device}: the simulated camera has nothing before it: this study has no surfaces")
        self.coming, self.count = iter(self.pictures_of(request)), 0

    def new(self, now_s: float) -> Sequence[Arrived]:  # noqa: ARG002 - it never waits
        """Return the next picture, if any is left."""
        data = next(self.coming, None)
        if data is None:
            return ()
        self.count += 1
        return (Arrived(f"simulated-{self.count:02d}{self.suffix}", data),)

    def refuse(self, name: str, why: str) -> None:
        """Raise DeviceFault, because a simulated picture does not get better."""
        raise DeviceFault(self.device, "refused", f"{self.device}: {name} is not a picture: {why}")

    def broken(self) -> Sequence[str]:
        """Return an empty sequence."""
        return ()


def _stamp(entry: os.DirEntry[str]) -> Stamp | None:
    """Return the stamp of a file; None if it is not a file, or no longer exists."""
    try:
        status = entry.stat()
        return (status.st_size, status.st_mtime_ns) if entry.is_file() else None
    except FileNotFoundError:
        return None
