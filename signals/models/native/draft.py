"""A program under construction: its operations, numbers and rooms of the workspace, which share space at the end.

The kernel reads weights in panels of two vectors' columns, one row of a panel after the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from palpate.signals.arrays import Array
from palpate.signals.models.native.library import InstructionSet
from palpate.signals.models.native.values import NotCompiled, Product, Room, Spot, Value


def single(numbers: Array) -> NDArray[np.float32]:
    """Return the numbers in single precision. Raise NotCompiled where that cannot hold them."""
    with np.errstate(over="ignore"):
        single: NDArray[np.float32] = np.asarray(numbers, dtype=np.float32)
    if not np.isfinite(single).all():
        raise NotCompiled("numbers beyond single precision")
    return single


def packed(matrix: Array, instructions: InstructionSet, half: bool = False) -> NDArray[np.float32]:
    """Return a matrix (k, n) in panels; the last panel is one vector wide where that is enough.

    With `half`, numbers are in half precision, two in the place of one.
    """
    k, n = matrix.shape
    numbers, parts = single(matrix), []
    for col in range(0, n, instructions.panel):
        left = n - col
        wide = instructions.panel if left > instructions.lanes else instructions.lanes
        panel = np.zeros((k, wide), dtype=np.float16 if half else np.float32)
        panel[:, : min(left, wide)] = numbers[:, col : col + wide]
        parts.append(panel.reshape(-1))
    together: NDArray[np.float32] = np.concatenate(parts)
    if not half:
        return together
    pairs: NDArray[np.float32] = np.pad(together, (0, len(together) % 2)).view(np.float32)
    return pairs


def halves(matrix: Array) -> bool:
    """Return whether half precision represents these numbers, in single precision, exactly: they were stored so."""
    with np.errstate(over="ignore"):
        single = matrix.astype(np.float32)
        return bool((single.astype(np.float16).astype(np.float32) == single).all())


FIELDS = 24
"""Fields of an operation (kernel.h)."""
SPARE = 64
"""Numbers after the last one that a vector may read."""
LINE = 16
"""Rooms begin at multiples of so many numbers, a line of the processor's cache."""
MOST_LINES, MOST_WORK = 2000, 2**24
"""Greatest numbers of operations, and of numbers in the workspace; larger models are run by NumPy."""
KINDS = (
    "normalise", "linear", "polar", "cartesian", "gemm", "norm", "attention", "function", "affine", "add", "copy",
    "softmax", "pool", "repeat", "lstm", "autoregression", "clip",
)  # fmt: skip
Field: TypeAlias = int | Spot
Line: TypeAlias = tuple[str, tuple[Field, ...]] | Product


@dataclass
class Numbers:
    """Arrays stored one after the other."""

    parts: list[NDArray[np.float64] | NDArray[np.float32]] = field(default_factory=list)
    size: int = 0

    def put(self, numbers: Array | NDArray[np.float32], whole: int = 1) -> int:
        """Append numbers and return where they begin; the next ones begin at a multiple of `whole`."""
        start, flat = self.size, numbers.reshape(-1)
        self.parts += [flat, np.zeros(-len(flat) % whole, dtype=flat.dtype)]
        self.size += len(flat) + -len(flat) % whole
        return start


@dataclass
class Draft:
    """The program under construction, which `program.py` writes."""

    instructions: InstructionSet
    lines: list[Line] = field(default_factory=list)
    weights: Numbers = field(default_factory=Numbers)
    doubles: Numbers = field(default_factory=Numbers)
    wide: int = 0
    kept: dict[str, Value] = field(default_factory=dict)

    def room(self, size: int, fixed: bool = False) -> Spot:
        """Reserve room for `size` numbers in single precision."""
        return Spot(Room(size, fixed))

    def wide_room(self, size: int) -> int:
        """Reserve room for `size` numbers in double precision, and return where it begins."""
        self.wide += size
        return self.wide - size

    def say(self, kind: str, *fields: Field) -> None:
        """Add an operation."""
        self.lines.append((kind, fields))

    def multiply(self, product: Product) -> None:
        """Add a product of matrices as the next operation; it may be changed until the program is finished."""
        self.lines.append(product)

    def weight(self, numbers: Array) -> int:
        """Append numbers in single precision, unchanged, and return where they begin. Raises NotCompiled on
        overflow.
        """
        return self.weights.put(single(numbers), LINE)

    def panels(self, matrix: Array) -> int:
        """Append a matrix (k, n) in panels, and return where it begins."""
        return self.weights.put(packed(matrix, self.instructions), LINE)


@dataclass(frozen=True)
class Finished:
    """The arrays of a finished program, for the kernel to point at."""

    ops: NDArray[np.int64]
    weights: NDArray[np.float32]
    doubles: NDArray[np.float64]
    work: int
    wide: int


def finished(draft: Draft, last: Spot) -> Finished:
    """Return the finished program; rooms that are needed at different times share their place.

    Raises NotCompiled where it is too long, too wide, or where its numbers did not stay finite.
    """
    if len(draft.lines) > MOST_LINES:
        raise NotCompiled(f"{len(draft.lines)} operations; at most {MOST_LINES} are run")
    lines = [_line(draft, line) for line in draft.lines]
    size = _lay_out([fields for _, fields in lines], last)
    if size > MOST_WORK:
        raise NotCompiled(f"a workspace of {size} numbers; at most {MOST_WORK} are held")
    ops = np.zeros((len(lines), FIELDS), dtype=np.int64)
    for row, (kind, fields) in enumerate(lines):
        places = (place.room.start + place.past if isinstance(place, Spot) else place for place in fields)
        ops[row, : len(fields) + 1] = (KINDS.index(kind), *places)
    weights = np.concatenate([*draft.weights.parts, np.zeros(SPARE, dtype=np.float32)])
    doubles = np.concatenate([*draft.doubles.parts, np.zeros(SPARE)])
    if not np.isfinite(doubles).all():
        raise NotCompiled("numbers beyond double precision")
    return Finished(ops, weights, doubles, size + SPARE, draft.wide + SPARE)


def _line(draft: Draft, line: Line) -> tuple[str, tuple[Field, ...]]:
    if not isinstance(line, Product):
        return line
    k, n = line.weight.shape
    half = line.m == 1 and line.col_step == 1 and draft.instructions.lanes > 4 and halves(line.weight)
    weight = draft.weights.put(packed(line.weight, draft.instructions, half), LINE)
    plain = not line.bias.any()
    bias = -1 if plain else draft.weight(np.pad(line.bias, ((0, 0), (0, -n % LINE))))
    bias_step = 0 if len(line.bias) == 1 else n + -n % LINE
    more: tuple[Field, ...] = (-1, 0) if line.more is None else (line.more, line.more_step)
    return "gemm", (
        line.a, line.row_step, line.col_step, line.m, k, n, weight, int(half), bias, bias_step, *more, line.y,
        n, int(line.relu),
    )  # fmt: skip


def _lay_out(lines: Sequence[tuple[Field, ...]], last: Spot) -> int:
    """Give every room its start, and return the size of the workspace."""
    spans: dict[Room, tuple[int, int]] = {}
    for number, fields in enumerate([*lines, (last,)]):
        for room in (field_.room for field_ in fields if isinstance(field_, Spot)):
            spans[room] = (spans.get(room, (number, number))[0], number)
    most = 0
    placed: list[Room] = []
    for room, span in spans.items():
        others = [
            other
            for other in placed
            if room.fixed or other.fixed or (spans[other][0] <= span[1] and span[0] <= spans[other][1])
        ]
        room.start = _gap(others, room.size)
        placed.append(room)
        most = max(most, room.start + room.size)
    return most


def _gap(others: Iterable[Room], size: int) -> int:
    """Return the first start at which `size` numbers do not overlap any of the other rooms."""
    start = 0
    for other in sorted(others, key=lambda room: room.start):
        if start + size <= other.start:
            break
        start = max(start, -(-(other.start + other.size) // LINE) * LINE)
    return start
