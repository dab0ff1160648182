"""Weights as the kernel reads them: panels of two vectors' columns, one row of a panel behind the other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.models.native.library import InstructionSet
from devices.models.native.values import Array


def packed(matrix: Array, instructions: InstructionSet, half: bool = False) -> NDArray[np.float32]:
    """(k, n) in panels; the last is one vector wide where that is enough. `half`: two numbers in the place of one."""
    k, n = matrix.shape
    parts = []
    for col in range(0, n, instructions.panel):
        left = n - col
        wide = instructions.panel if left > instructions.lanes else instructions.lanes
        panel = np.zeros((k, wide))
        panel[:, : min(left, wide)] = matrix[:, col : col + wide]
        parts.append(panel.astype(np.float16 if half else np.float32).reshape(-1))
    together = np.concatenate(parts)
    if not half:
        single: NDArray[np.float32] = together.astype(np.float32)
        return single
    pairs: NDArray[np.float32] = np.pad(together, (0, len(together) % 2)).view(np.float32)
    return pairs


def halves(matrix: Array) -> bool:
    """Whether half precision holds these numbers, as they will be run, exactly: they were stored so."""
    single = matrix.astype(np.float32)
    with np.errstate(over="ignore"):
        return bool((single.astype(np.float16).astype(np.float32) == single).all())
