"""What a network is trained on: rows in memory, or batches made on demand."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor

from palpate.modeling.training.refusals import TrainingError

Given: TypeAlias = Tensor | tuple[Tensor, ...]
"""What a network takes or should answer; a tuple for a network of several inputs, or a loss of several targets."""


class Source(Protocol):
    """Rows that can be read in any order."""

    def __len__(self) -> int: ...

    def batch(self, rows: Tensor, chance: torch.Generator) -> tuple[Given, Given]:
        """Inputs and targets of these rows; all that is random in them (augmentation) comes from `chance`."""

    @property
    def digest(self) -> str:
        """SHA-256 of all that the rows are made from; a checkpoint of other data is refused."""


@dataclass(frozen=True)
class Pairs:
    """Inputs and targets in memory, one row each; `pairs` makes them from arrays."""

    inputs: Given
    targets: Given

    def __post_init__(self) -> None:
        lengths = {len(tensor) for tensor in _tensors(self.inputs, self.targets)}
        if len(lengths) != 1 or not lengths.pop():
            shapes = [tuple(tensor.shape) for tensor in _tensors(self.inputs, self.targets)]
            raise TrainingError(
                f"inputs and targets have shapes {shapes}: expected one row each, and at least one row."
            )
        for what, given in (("input", self.inputs), ("target", self.targets)):
            for tensor in _tensors(given):
                if not bool(torch.isfinite(tensor).all()):
                    finite = torch.isfinite(tensor.reshape(len(tensor), -1)).all(dim=1)
                    row = int(finite.logical_not().nonzero()[0])
                    raise TrainingError(f"{what}: row {row + 1} holds a number that is not finite.")

    def __len__(self) -> int:
        return len(next(_tensors(self.inputs)))

    def batch(self, rows: Tensor, _chance: torch.Generator) -> tuple[Given, Given]:
        """Return the rows as they are."""
        return _rows(self.inputs, rows), _rows(self.targets, rows)

    @property
    def digest(self) -> str:
        """SHA-256 of every number, with shapes and types."""
        return digest_of(_tensors(self.inputs, self.targets))


@dataclass(frozen=True)
class GeneratedRows:
    """`rows` rows that `make(rows, chance)` computes on demand: windows of a recording, augmented images.

    `digest` is the caller's SHA-256 of what they are made from.
    """

    rows: int
    make: Callable[[Tensor, torch.Generator], tuple[Given, Given]]
    digest: str

    def __len__(self) -> int:
        return self.rows

    def batch(self, rows: Tensor, chance: torch.Generator) -> tuple[Given, Given]:
        """Return what `make` gives."""
        return self.make(rows, chance)


def pairs(inputs: ArrayLike, targets: ArrayLike) -> Pairs:
    """Arrays of numbers of any type as float32 rows. Raises TrainingError where one is not finite in 32 bits.

    Class numbers for a cross-entropy are given as `Pairs(inputs, torch.tensor(classes))`.
    """
    return Pairs(_float32("input", inputs), _float32("target", targets))


def digest_of(tensors: Iterator[Tensor]) -> str:
    """SHA-256 over tensors, their shapes and types."""
    digest = hashlib.sha256()
    for tensor in tensors:
        plain = tensor.detach().cpu().contiguous()
        digest.update(f"{plain.dtype}{tuple(plain.shape)}".encode())
        digest.update(plain.view(-1).view(torch.uint8).numpy().tobytes() if plain.numel() else b"")
    return digest.hexdigest()


def _float32(what: str, values: ArrayLike) -> Tensor:
    given = np.asarray(values)
    with np.errstate(over="ignore"):
        single = np.array(given, dtype=np.float32, order="C")
    if (bad := np.argwhere(~np.isfinite(single))).size:
        place = tuple(int(i) for i in bad[0])
        raise TrainingError(f"{what}: row {place[0] + 1} holds {given[place]}: a finite number of 32 bits is expected.")
    return torch.from_numpy(single)


def _tensors(*given: Given) -> Iterator[Tensor]:
    for one in given:
        yield from (one if isinstance(one, tuple) else (one,))


def _rows(given: Given, rows: Tensor) -> Given:
    return tuple(tensor[rows] for tensor in given) if isinstance(given, tuple) else given[rows]


def answer_of(network: Callable[..., Any], inputs: Given) -> Any:
    """Return what the network answers: a tuple of inputs is given as so many arguments."""
    return network(*inputs) if isinstance(inputs, tuple) else network(inputs)
