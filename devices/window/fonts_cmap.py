"""Which characters a font file can draw, read from its character map (OpenType `cmap`, formats 4 and 12)."""

from __future__ import annotations

import struct
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

UNICODE = ((3, 10), (0, 6), (0, 4), (3, 1), (0, 3), (0, 2), (0, 1), (0, 0))
"""(platform, encoding) of Unicode subtables, the widest first."""
LARGEST_TABLE = 4_000_000


class NotAFont(ValueError):
    """The file is no OpenType or TrueType font with a Unicode character map."""


@dataclass(frozen=True)
class Coverage:
    """Ranges of code points, sorted: first[n] to last[n], both inside."""

    first: tuple[int, ...]
    last: tuple[int, ...]

    def holds(self, character: str) -> bool:
        """Whether the font has a glyph for the character."""
        place = bisect_right(self.first, ord(character)) - 1
        return place >= 0 and ord(character) <= self.last[place]


def coverage(path: Path, index: int = 0) -> Coverage:
    """The characters that font number `index` of a file can draw. Raises NotAFont; OSError if it cannot be read."""
    try:
        with path.open("rb") as file:
            data = _subtable(_table(file, index))
            ranges = sorted(_ranges(data))
    except (struct.error, IndexError) as error:
        raise NotAFont(f"{path}: a broken character map ({error})") from None
    except NotAFont as error:
        raise NotAFont(f"{path}: {error}") from None
    return Coverage(tuple(first for first, _ in ranges), tuple(last for _, last in ranges))


def _table(file: BinaryIO, index: int) -> bytes:
    """The bytes of the cmap table."""
    start = 0
    if file.read(4) == b"ttcf":
        _, count = struct.unpack(">II", file.read(8))
        if not 0 <= index < count:
            raise NotAFont(f"font {index} of {count}")
        file.seek(12 + 4 * index)
        (start,) = struct.unpack(">I", file.read(4))
    file.seek(start + 4)
    (tables,) = struct.unpack(">H", file.read(2))
    file.seek(start + 12)
    for _ in range(tables):
        tag, _, offset, length = struct.unpack(">4sIII", file.read(16))
        if tag == b"cmap":
            file.seek(offset)
            return file.read(min(length, LARGEST_TABLE))
    raise NotAFont("no character map")


def _subtable(table: bytes) -> bytes:
    """The widest Unicode subtable of a format that is read here."""
    _, count = struct.unpack_from(">HH", table)
    found = {}
    for number in range(count):
        platform, encoding, offset = struct.unpack_from(">HHI", table, 4 + 8 * number)
        (kind,) = struct.unpack_from(">H", table, offset)
        if kind in (4, 12):
            found[platform, encoding] = table[offset:]
    for key in UNICODE:
        if key in found:
            return found[key]
    raise NotAFont("no Unicode character map of format 4 or 12")


def _ranges(data: bytes) -> Iterator[tuple[int, int]]:
    (kind,) = struct.unpack_from(">H", data)
    return _groups(data) if kind == 12 else _segments(data)


def _groups(data: bytes) -> Iterator[tuple[int, int]]:
    (count,) = struct.unpack_from(">I", data, 12)
    for first, last, glyph in struct.iter_unpack(">III", data[16 : 16 + 12 * count]):
        yield first + (glyph == 0), last


def _segments(data: bytes) -> Iterator[tuple[int, int]]:
    (twice,) = struct.unpack_from(">H", data, 6)
    columns = [
        struct.unpack_from(f">{twice // 2}H", data, 14 + twice * n + 2 * (n > 0)) for n in range(4)
    ]  # ends; a pad; starts; deltas; range offsets
    for place, (last, first, delta, offset) in enumerate(zip(*columns, strict=True)):
        if offset == 0 and not first <= (-delta & 0xFFFF) <= last:
            yield first, last
        else:
            where = 16 + 3 * twice + 2 * place + offset
            yield from ((c, c) for c in range(first, last + 1) if _glyph(data, c, first, delta, offset, where))


def _glyph(data: bytes, code: int, first: int, delta: int, offset: int, where: int) -> int:
    """The glyph of a code point; 0 is none."""
    if offset == 0:
        return (code + delta) & 0xFFFF
    place = where + 2 * (code - first)
    if place + 2 > len(data):
        return 0
    (glyph,) = struct.unpack_from(">H", data, place)
    return (glyph + delta) & 0xFFFF if glyph else 0
