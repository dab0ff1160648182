"""A model opened for the kernel: its program, its workspace, and the one call that a step is."""

from __future__ import annotations

import ctypes
import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.models.native.library import ANSWERED, InstructionSet, Library, Program
from devices.models.native.program import compiled
from devices.models.runtime import Model
from protocols.model_card import Card

Array = NDArray[np.float64]
FURTHEST = float(np.finfo(np.float64).max)


class Native:
    """A model run by the kernel.

    It has one workspace, so one step runs at a time: several threads may use one, they wait for each other; a thread
    that must not wait opens its own.
    """

    def __init__(self, model: Model, library: Library, instructions: InstructionSet) -> None:
        """Raises NotCompiled: a step that the kernel does not know."""
        self._model, self._library = model, library
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
        """What it takes and gives."""
        return self._model.card

    @property
    def ops(self) -> NDArray[np.int64]:
        """The program's operations, a row each (kernel.h)."""
        found: NDArray[np.int64] = self._held[0]
        return found

    @property
    def weights(self) -> int:
        """Numbers in single precision that the program reads."""
        return len(self._held[3])

    def run(self, given: Array) -> Array:
        """As `Model.run`: what the kernel will not answer, NumPy answers or refuses."""
        if type(given) is not np.ndarray or given.shape != self._size or given.dtype.kind not in "iuf":
            return self._many(given)
        with self._lock:
            self._x[:] = given
            if self._step(self._at) == ANSWERED:
                return self._y.copy()
        return self._model.run(given)

    def _many(self, given: Any) -> Array:
        rows = given if type(given) is np.ndarray else None
        if rows is None or rows.dtype.kind not in "iuf" or rows.ndim != 2 or rows.shape[1] != self._inputs:
            return self._model.run(given)
        rows = np.ascontiguousarray(rows, dtype=np.float64)
        answers = np.empty((len(rows), self.card.gives.size))
        with self._lock:
            self._program.x, self._program.y = rows.ctypes.data, answers.ctypes.data
            done = self._library.many(self._at, len(rows))
            self._program.x, self._program.y = self._x.ctypes.data, self._y.ctypes.data
        return answers if done == len(rows) else self._model.run(given)

    def __reduce__(self) -> tuple[Any, tuple[Model]]:
        from devices.models.fastest import fastest

        return fastest, (self._model,)


def _program(model: Model, instructions: InstructionSet, x: Array, y: Array) -> tuple[Program, tuple[Any, ...]]:
    """The program, and the arrays that it points into."""
    made, takes = compiled(model.card, model.tensors, instructions), model.card.takes
    numbers = made.numbers
    within = np.array(takes.within or (-FURTHEST, FURTHEST))
    out = np.concatenate([made.out_gain, made.out_offset])
    work, work64 = _aligned(numbers.work, np.float32), _aligned(numbers.wide, np.float64)
    weights = _aligned(len(numbers.weights), np.float32)
    weights[:] = numbers.weights
    arrays = (np.ascontiguousarray(numbers.ops), work, work64, weights, numbers.doubles, within, out, x, y)
    places = [each.ctypes.data for each in arrays]
    sizes = (instructions.number, len(numbers.ops), takes.size, model.card.gives.size, made.answer, made.answer64)
    return Program(*sizes, *places), arrays


def _aligned(count: int, kind: type[Any], to: int = 64) -> NDArray[Any]:
    """Zeros that begin at a line of the processor's cache."""
    size = np.dtype(kind).itemsize
    room = np.zeros(count * size + to, dtype=np.uint8)
    start = -room.ctypes.data % to
    return room[start : start + count * size].view(kind)
