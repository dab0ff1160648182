"""The parts of every step: the shape of its input, the model's numbers, and words for a mismatch."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from palpate.signals.models.errors import ModelFileError

Values: TypeAlias = NDArray[Any]
KeptValues: TypeAlias = dict[str, Values]
"""What was kept on the way through one run; every run has its own."""
Run: TypeAlias = Callable[[Values, KeptValues], Values]
"""One or more steps at work: (n, *shape) to (n, *next shape)."""

LARGEST = 2**22
"""So many numbers at most between two steps, for one input; the widest network here has 120 000."""


@dataclass(frozen=True)
class Form:
    """The shape of one value as the card means it, (channels, length) where it has two sides.

    `length_first`: it is kept as (length, channels), so that a convolution is one product of matrices. `owned`: it was
    made on the way and nothing else needs it, so a step may write into it.
    """

    shape: tuple[int, ...]
    length_first: bool = False
    owned: bool = False

    @property
    def size(self) -> int:
        """Return how many numbers it is."""
        return math.prod(self.shape)


Built: TypeAlias = tuple[Run, Form]


@dataclass(frozen=True)
class At:
    """A step's place in the card, the numbers that it may name, and the forms of what steps before it have kept."""

    where: str
    tensors: Mapping[str, Values]
    kept: dict[str, Form] = field(default_factory=dict)

    def inner(self, where: str) -> At:
        """Return a place within this one."""
        return replace(self, where=f"{self.where}, {where}" if self.where else where)

    def form_of_kept(self, name: str) -> Form:
        """Return the form of a value that a step before this one has kept. Raises ModelFileError."""
        if name not in self.kept:
            raise self.refuse(f"no step before it has stored {name!r}")
        return self.kept[name]

    def refuse(self, what: str) -> ModelFileError:
        """Return the error that says where."""
        return ModelFileError(f"{self.where}: {what}. Export the model again.")

    def reals(self, name: str, *sides: int | None) -> Values:
        """Return an array of real numbers with these sides, None for any. Raises ModelFileError."""
        return self._array(name, "f", "float32 or float64", sides)

    def wholes(self, name: str, *sides: int | None) -> Values:
        """Return an array of whole numbers with these sides. Raises ModelFileError."""
        return self._array(name, "i", "int32 or int64", sides)

    def any_reals(self, name: str) -> Values:
        """Return an array of real numbers of any shape. Raises ModelFileError."""
        tensor = self.tensors.get(name)
        if tensor is None:
            raise self.refuse(f"it names {name!r}, which is not among the numbers")
        return self.reals(name, *[None] * tensor.ndim)

    def _array(self, name: str, kind: str, words: str, sides: tuple[int | None, ...]) -> Values:
        tensor = self.tensors.get(name)
        if tensor is None:
            raise self.refuse(f"it names {name!r}, which is not among the numbers")
        if tensor.dtype.kind != kind or tensor.dtype.itemsize < 4:
            raise self.refuse(f"{name!r} is {tensor.dtype}; {words} is expected")
        fits = tensor.ndim == len(sides)
        fits = fits and all(side in (None, had) for side, had in zip(sides, tensor.shape, strict=True))
        if not fits or not tensor.size:
            expected = ", ".join("any" if side is None else str(side) for side in sides)
            raise self.refuse(f"{name!r} has shape {tensor.shape}; ({expected}) is expected")
        return tensor


def flattened(form: Form) -> Callable[[Values], Values]:
    """Return (n, *shape) as it is kept to (n, size) in C order."""

    def run(x: Values) -> Values:
        return (x.swapaxes(1, 2) if form.length_first else x).reshape(len(x), -1)

    return run


def missing_where_not_finite(x: Values, answers: Values) -> Values:
    """Return the answers, NaN for every input that is not finite: a look-up must not hide that a number overflowed."""
    wrong = np.asarray(~np.isfinite(x).all(axis=1))
    return np.where(wrong[:, None], np.nan, answers) if wrong.any() else answers
