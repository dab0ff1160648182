"""Weights as the kernel reads them: panels of two vectors' columns, one row of a panel behind the other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.signals.arrays import Array
from palpate.signals.models.native.library import InstructionSet
from palpate.signals.models.native.values import NotCompiled


def single(numbers: Array) -> NDArray[np.float32]:
    """In single precision. Raises NotCompiled where that does not hold them."""
    with np.errstate(over="ignore"):
        single: NDArray[np.float32] = np.asarray(numbers, dtype=np.float32)
    if not np.isfinite(single).all():
        raise NotCompiled("numbers beyond single precision")
    return single


def packed(matrix: Array, instructions: InstructionSet, half: bool = False) -> NDArray[np.float32]:
    """Return (k, n) in panels; the last is one vector wide where that is enough. `half`: two numbers in the place of
    one.
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
    """Return whether half precision holds these numbers, as they will be run, exactly: they were stored so."""
    with np.errstate(over="ignore"):
        single = matrix.astype(np.float32)
        return bool((single.astype(np.float16).astype(np.float32) == single).all())
