"""The measured curves with the known facts about each switch: kind, maker, family."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.keyswitch.families import families
from palpate.protocols.tables import split_records
from palpate.signals.arrays import Array, Indices

MEASURED = Path(__file__).parent / "measured"
CURVES, KINDS_FILE = "downstroke_621.csv", "kinds.csv"
KINDS = ("linear", "tactile", "clicky")
POINTS = 621


class CurveError(ValueError):
    """A file of curves or kinds is invalid."""


@dataclass(frozen=True)
class Curves:
    """One row for each switch.

    `force_gf` is (n, 621): gram-force of the down-stroke at equal steps of travel, 0 to `travel_mm`. `kind` (n,) is a
    place in KINDS. Switches of one `family` never lie on both sides of a split.
    """

    names: tuple[str, ...]
    makers: tuple[str, ...]
    family: tuple[str, ...]
    kind: Indices
    travel_mm: Array
    force_gf: Array
    digest: str

    def __len__(self) -> int:
        return len(self.names)


def measured(folder: Path = MEASURED) -> Curves:
    """Return the 119 shipped curves (NOTICE beside them). Raise CurveError on an invalid file, line or number."""
    curves, kinds = folder / CURVES, folder / KINDS_FILE
    rows = list(_lines(curves, 2 + POINTS))
    kind_lines = {line[0]: line for line in _lines(kinds, 4)}
    names = tuple(line[0] for line in rows)
    if unlike := sorted(set(names) ^ set(kind_lines)):
        raise CurveError(f"{curves} and {kinds} name different switches: {', '.join(unlike[:3])}.")
    makers = tuple(kind_lines[name][3] for name in names)
    numbers = np.array([_numbers(curves, line) for line in rows])
    digest = hashlib.sha256(curves.read_bytes() + kinds.read_bytes()).hexdigest()
    kind = np.array([_kind(kinds, kind_lines[name]) for name in names])
    return Curves(names, makers, families(names, makers), kind, numbers[:, 0], numbers[:, 1:], digest)


def _lines(path: Path, columns: int) -> Iterator[Sequence[str]]:
    """Yield the lines after the heading, each with `columns` cells and a unique name."""
    with path.open(encoding="utf-8", newline="") as file:
        seen: set[str] = set()
        for number, record in enumerate(split_records(file), 1):
            line = record.cells
            if len(line) != columns or line[0] in seen:
                raise CurveError(f"{path}: line {number} has {len(line)} cells ({columns} expected) or a name again.")
            seen.add(line[0])
            if number > 1:
                yield line


def _numbers(path: Path, line: Sequence[str]) -> Array:
    try:
        numbers = np.array([float(cell) for cell in line[1:]])
    except ValueError as error:
        raise CurveError(f"{path}: {line[0]}: {error}.") from None
    if not np.isfinite(numbers).all():
        raise CurveError(f"{path}: {line[0]} has a force that is not finite.")
    return numbers


def _kind(path: Path, line: Sequence[str]) -> int:
    if line[1] not in KINDS:
        raise CurveError(f"{path}: {line[0]} is {line[1]!r}: one of {', '.join(KINDS)} is expected.")
    return KINDS.index(line[1])
