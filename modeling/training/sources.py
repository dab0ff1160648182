"""Rows that a network is trained on: in memory, or computed on demand."""

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
"""Inputs or targets, rows first; a tuple for a network with several inputs, or a loss with several targets."""


class Source(Protocol):
    """Rows that can be read in any order."""

    def __len__(self) -> int: ...

    def batch(self, rows: Tensor, chance: torch.Generator) -> tuple[Given, Given]:
        """Return inputs and targets of these rows, (n,) indices; `chance` is the only source of randomness."""

    @property
    def digest(self) -> str:
        """The SHA-256 of all that the rows are computed from; a checkpoint with another one is refused."""


@dataclass(frozen=True)
class Pairs:
    """Inputs and targets in memory, with as many rows each; `pairs` creates them from arrays.

    Raises TrainingError for different numbers of rows, no rows, or a number that is not finite.
    """

    inputs: Given
    targets: Given

    def __post_init__(self) -> None:
        lengths = {len(tensor) for tensor in _tensors(self.inputs, self.targets)}
        if len(lengths) != 1 or not lengths.pop():
            shapes = [tuple(tensor.shape) for tensor in _tensors(self.inputs, self.targets)]
            raise TrainingError(
                f"inputs and targets have shapes {shapes}: expected one row each, and at least one row."
            )
        for what, tensors in (("input", self.inputs), ("target", self.targets)):
            for tensor in _tensors(tensors):
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
        """The SHA-256 of all numbers, shapes and types."""
        return digest_of(_tensors(self.inputs, self.targets))


@dataclass(frozen=True)
class GeneratedRows:
    """Rows that `make(rows, chance)` computes on demand: windows of a recording, augmented images.

    `rows` is their number; `digest` the caller's SHA-256 of their data.
    """

    rows: int
    make: Callable[[Tensor, torch.Generator], tuple[Given, Given]]
    digest: str

    def __len__(self) -> int:
        return self.rows

    def batch(self, rows: Tensor, chance: torch.Generator) -> tuple[Given, Given]:
        """Return the rows that `make` computes."""
        return self.make(rows, chance)


def pairs(inputs: ArrayLike, targets: ArrayLike) -> Pairs:
    """Return arrays, rows first, as float32 `Pairs`. Raises TrainingError for a number that is not finite in float32.

    For class numbers of a cross-entropy, use `Pairs(inputs, torch.tensor(classes))`.
    """
    return Pairs(_float32("input", inputs), _float32("target", targets))


def digest_of(tensors: Iterator[Tensor]) -> str:
    """Return the SHA-256 over tensors, their shapes and types."""
    digest = hashlib.sha256()
    for tensor in tensors:
        plain = tensor.detach().cpu().contiguous()
        digest.update(f"{plain.dtype}{tuple(plain.shape)}".encode())
        digest.update(plain.view(-1).view(torch.uint8).numpy().tobytes() if plain.numel() else b"")
    return digest.hexdigest()


def _float32(what: str, values: ArrayLike) -> Tensor:
    array = np.asarray(values)
    with np.errstate(over="ignore"):
        single = np.array(array, dtype=np.float32, order="C")
    if (bad := np.argwhere(~np.isfinite(single))).size:
        place = tuple(int(i) for i in bad[0])
        raise TrainingError(f"{what}: row {place[0] + 1} holds {array[place]}: a finite number of 32 bits is expected.")
    return torch.from_numpy(single)


def _tensors(*groups: Given) -> Iterator[Tensor]:
    for tensors in groups:
        yield from (tensors if isinstance(tensors, tuple) else (tensors,))


def _rows(tensors: Given, rows: Tensor) -> Given:
    return tuple(tensor[rows] for tensor in tensors) if isinstance(tensors, tuple) else tensors[rows]


def answer_of(network: Callable[..., Any], inputs: Given) -> Any:
    """Return the network's answer; a tuple of inputs is passed as several arguments."""
    return network(*inputs) if isinstance(inputs, tuple) else network(inputs)
