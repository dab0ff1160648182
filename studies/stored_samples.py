"""Sample blocks that stay in their ledger: what they are is known, their bytes are read when they are asked for."""

from __future__ import annotations

import hashlib
import sqlite3
from dataclasses import fields
from pathlib import Path
from typing import Any
from urllib.parse import quote

from palpate.protocols.requests import Samples

SMALL_BYTES = 4096
"""Blocks up to this size are kept in memory: a form's few touches. A year of recordings is not."""


FORM = tuple(each.name for each in fields(Samples) if each.name != "data")


class SamplesGone(ValueError):
    """A ledger that was read, and whose samples are not there any more."""


class StoredSamples(Samples):
    """A block of samples whose `data` lies in a ledger; equal to any block of the same form and digest."""

    def __init__(self, block: Samples, path: Path, seq: int, number: int) -> None:
        kept = {name: getattr(block, name) for name in FORM}
        sha256 = hashlib.sha256(block.data).digest()
        for name, value in (kept | {"_count": block.count, "_sha256": sha256, "_at": (path, seq, number)}).items():
            object.__setattr__(self, name, value)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Samples):
            return NotImplemented
        return self.sha256() == other.sha256() and all(getattr(self, name) == getattr(other, name) for name in FORM)

    def __hash__(self) -> int:
        return hash(self.sha256())

    def __repr__(self) -> str:
        return f"{self.stream}: {self.count} samples in the ledger"

    @property
    def data(self) -> bytes:
        """The bytes, read from the file. Raises SamplesGone where they are not there, or not what they were."""
        path, seq, number = self._place()
        data = _read(path, seq, number)
        if hashlib.sha256(data).digest() != self.sha256():
            raise SamplesGone(f"{path}: the samples of event {seq} are not those that were there when it was read")
        return data

    @property
    def count(self) -> int:
        """Samples per channel."""
        return int(self.__dict__["_count"])

    def sha256(self) -> bytes:
        """The digest of the bytes, known since they were read."""
        return bytes(self.__dict__["_sha256"])

    def _place(self) -> tuple[Path, int, int]:
        place: tuple[Path, int, int] = self.__dict__["_at"]
        return place


def stored(block: Samples, path: Path, seq: int, number: int) -> Samples:
    """The block itself where it is small, else one that reads its bytes from the ledger."""
    return block if len(block.data) <= SMALL_BYTES else StoredSamples(block, path, seq, number)


def _read(path: Path, seq: int, number: int) -> bytes:
    try:
        connection = sqlite3.connect(f"file:{quote(str(path.resolve()))}?mode=ro", uri=True)
        try:
            row: Any = connection.execute(
                "SELECT data FROM samples WHERE seq = ? AND block = ?", (seq, number)
            ).fetchone()
        finally:
            connection.close()
    except sqlite3.Error as error:
        raise SamplesGone(f"{path}: the samples of event {seq} cannot be read any more ({error})") from None
    if row is None:
        raise SamplesGone(f"{path}: the samples of event {seq} are not there any more")
    return bytes(row[0])
