"""A model opened for the kernel: its program, its workspace, and the one call that runs it."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.signals.arrays import Array
from palpate.signals.models.card import Card
from palpate.signals.models.native.library import ANSWERED, InstructionSet, Library, Program
from palpate.signals.models.native.program import compiled
from palpate.signals.models.runtime import Model

FURTHEST = float(np.finfo(np.float64).max)


class Native:
    """A model run by the kernel.

    It has one workspace, so it runs one input at a time; threads that share it wait for each other. A thread that must
    not wait opens its own.
    """

    def __init__(
        self, model: Model, library: Library, instructions: InstructionSet, reopen: Callable[[Model], Any]
    ) -> None:
        """Take the model; `reopen` opens it when this is unpickled. Raise NotCompiled for an unsupported step."""
        self._model, self._library, self._reopen = model, library, reopen
        self.instructions = instructions
        self.runtime = f"native ({instructions.name})"
        card = model.card
        self._lock = threading.Lock()
        self._size, self._inputs = (card.takes.size,), card.takes.size
        self._x, self._y = np.zeros(card.takes.size), np.zeros(card.gives.size)
        self._program, self._held = _program(model, instructions, self._x, self._y)
        self._step, self._at = library.step, ctypes.addressof(self._program)

    @property
    def card(self) -> Card:
        """Return the model's card."""
        return self._model.card

    @property
    def ops(self) -> NDArray[np.int64]:
        """Return the program's operations, a row each (kernel.h)."""
        found: NDArray[np.int64] = self._held[0]
        return found

    @property
    def weights(self) -> int:
        """Return how many numbers in single precision the program reads."""
        return len(self._held[3])

    def run(self, given: Array) -> Array:
        """Return the answer as `Model.run` does; inputs that the kernel does not answer are passed to NumPy."""
        if not _plain(given) or given.shape != self._size:
            return self._many(given)
        with self._lock:
            self._x[:] = given
            if self._step(self._at) == ANSWERED:
                return self._y.copy()
        return self._model.run(given)

    def _many(self, given: Any) -> Array:
        if not _plain(given) or given.ndim != 2 or given.shape[1] != self._inputs:
            return self._model.run(given)
        rows = np.ascontiguousarray(given, dtype=np.float64)
        answers = np.empty((len(rows), self.card.gives.size))
        batch = Program.from_buffer_copy(self._program)  # nothing to put back where a Ctrl-C comes in between
        batch.x, batch.y = rows.ctypes.data, answers.ctypes.data
        with self._lock:
            done = self._library.many(ctypes.addressof(batch), len(rows))
        return answers if done == len(rows) else self._model.run(given)

    def __reduce__(self) -> tuple[Any, tuple[Model]]:
        return self._reopen, (self._model,)


def _plain(given: Any) -> bool:
    """Return whether the input is an array of real numbers that double precision holds."""
    return type(given) is np.ndarray and given.dtype.kind in "iuf" and given.dtype.itemsize <= 8


def _program(model: Model, instructions: InstructionSet, x: Array, y: Array) -> tuple[Program, tuple[Any, ...]]:
    """Return the program of a model, and the arrays that it points into."""
    takes = model.card.takes
    with np.errstate(over="ignore", invalid="ignore"):  # what does not stay finite is not compiled
        program = compiled(model.card, model.tensors, instructions)
    numbers = program.numbers
    within = np.array(takes.within or (-FURTHEST, FURTHEST))
    out = np.concatenate([program.out_gain, program.out_offset])
    work, work64 = _aligned(numbers.work, np.float32), _aligned(numbers.wide, np.float64)
    weights = _aligned(len(numbers.weights), np.float32)
    weights[:] = numbers.weights
    arrays = (np.ascontiguousarray(numbers.ops), work, work64, weights, numbers.doubles, within, out, x, y)
    places = [array.ctypes.data for array in arrays]
    sizes = (instructions.number, len(numbers.ops), takes.size, model.card.gives.size, program.answer, program.answer64)
    return Program(*sizes, *places), arrays


def _aligned(count: int, kind: type[Any], to: int = 64) -> NDArray[Any]:
    """Return an array of zeros that begins at a line of the processor's cache."""
    size = np.dtype(kind).itemsize
    room = np.zeros(count * size + to, dtype=np.uint8)
    start = -room.ctypes.data % to
    return room[start : start + count * size].view(kind)
