"""What all steps use: the shape of a value, the model's tensors, and messages for a mismatch."""

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
"""Values that are kept during one run, by name; every run has its own."""
Run: TypeAlias = Callable[[Values, KeptValues], Values]
"""A function that runs one or more steps: (n, *shape) to (n, *next shape)."""

LARGEST = 2**22
"""Greatest number of values between two steps, for one input; the widest network here has 120 000."""


@dataclass(frozen=True)
class Form:
    """The shape of a value as the card defines it: (size,) or (channels, length).

    `length_first`: it is stored as (length, channels), so that a convolution is one product of matrices. `owned`: it is
    an intermediate result that nothing else needs, so a step may write into it.
    """

    shape: tuple[int, ...]
    length_first: bool = False
    owned: bool = False

    @property
    def size(self) -> int:
        """Return how many numbers a value has."""
        return math.prod(self.shape)


Built: TypeAlias = tuple[Run, Form]


@dataclass(frozen=True)
class At:
    """A step's place in the card, the tensors that it may name, and the forms of values that earlier steps have
    kept.
    """

    where: str
    tensors: Mapping[str, Values]
    kept: dict[str, Form] = field(default_factory=dict)

    def inner(self, where: str) -> At:
        """Return a place nested in this one."""
        return replace(self, where=f"{self.where}, {where}" if self.where else where)

    def form_of_kept(self, name: str) -> Form:
        """Return the form of a value that an earlier step has kept. Raises ModelFileError where there is none."""
        if name not in self.kept:
            raise self.refuse(f"no step before it has stored {name!r}")
        return self.kept[name]

    def refuse(self, what: str) -> ModelFileError:
        """Return a ModelFileError that says where in the card the problem is."""
        return ModelFileError(f"{self.where}: {what}. Export the model again.")

    def reals(self, name: str, *sides: int | None) -> Values:
        """Return a tensor of real numbers with these dimensions, None for any size. Raises ModelFileError."""
        return self._array(name, "f", "float32 or float64", sides)

    def wholes(self, name: str, *sides: int | None) -> Values:
        """Return a tensor of whole numbers with these dimensions. Raises ModelFileError."""
        return self._array(name, "i", "int32 or int64", sides)

    def any_reals(self, name: str) -> Values:
        """Return a tensor of real numbers of any shape. Raises ModelFileError."""
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
    """Return a function from a value as it is stored, (n, *shape), to (n, size) in C order."""

    def run(x: Values) -> Values:
        return (x.swapaxes(1, 2) if form.length_first else x).reshape(len(x), -1)

    return run


def missing_where_not_finite(x: Values, answers: Values) -> Values:
    """Return the answers, NaN for every input that is not finite: a look-up must not hide an overflow."""
    wrong = np.asarray(~np.isfinite(x).all(axis=1))
    return np.where(wrong[:, None], np.nan, answers) if wrong.any() else answers
