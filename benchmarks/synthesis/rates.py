"""The least time that a program could take on this machine, from its products, its numbers and the best rates."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from palpate.protocols.progress import Clock
from palpate.signals.models.native.draft import KINDS
from palpate.signals.models.native.library import InstructionSet, Library
from palpate.signals.models.native.opened import Native

ROUNDS, READS, TRIES = 20_000, 20, 30


@dataclass(frozen=True)
class Work:
    """The work of one step: floating-point operations (a multiply-add is two), and bytes of weights to read."""

    flop: int
    bytes: int


@dataclass(frozen=True)
class Rates:
    """The best rates of one core: FLOP/s in registers, and bytes/s from a buffer of that size."""

    flop_s: float
    bytes_s: float

    def seconds(self, work: Work) -> tuple[float, float]:
        """Return the least time for the products, and for reading the numbers."""
        return work.flop / self.flop_s, work.bytes / self.bytes_s


def work_of(native: Native) -> Work:
    """Return the work of the program: products of matrices and attention, which dominate the cost."""
    flop = 0
    for row in native.ops:
        kind, fields = KINDS[row[0]], [int(field) for field in row[1:]]
        if kind == "gemm":
            flop += 2 * fields[3] * fields[4] * fields[5]
        elif kind == "attention":
            heads, depth, queries, keys = fields[8:12]
            flop += 4 * heads * depth * queries * keys
        elif kind == "lstm":
            rows, hidden = fields[4:6]
            flop += 8 * rows * hidden * hidden
        elif kind == "linear":
            flop += 2 * fields[1] * fields[3]
    return Work(flop, 4 * native.weights)


def rates(library: Library, instructions: InstructionSet, size: int, clock: Clock) -> Rates:
    """Return the best rates of a few tries, so that other work counts little; `size`: bytes of the buffer."""
    calls, number = library.calls, instructions.number
    calls.palpate_set_products.restype = ctypes.c_int64
    calls.palpate_most_products.argtypes = (ctypes.c_int64, ctypes.c_int64)
    calls.palpate_most_numbers.argtypes = (ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64)
    calls.palpate_most_products.restype = calls.palpate_most_numbers.restype = ctypes.c_float
    whole = 8 * instructions.lanes
    count = -(-size // 4 // whole) * whole
    numbers = np.zeros(count, dtype=np.float32)
    products = 2 * ROUNDS * int(calls.palpate_set_products(number))

    def read() -> None:
        for _ in range(READS):
            calls.palpate_most_numbers(number, numbers.ctypes.data, count)

    multiplied = _best(lambda: calls.palpate_most_products(number, ROUNDS), clock)
    return Rates(products / multiplied, READS * 4 * count / _best(read, clock))


def _best(run: Callable[[], object], clock: Clock) -> float:
    least = float("inf")
    for _ in range(TRIES):
        start = clock()
        run()
        least = min(least, clock() - start)
    return least
