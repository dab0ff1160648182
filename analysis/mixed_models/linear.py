"""Linear algebra in the few forms that the model needs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from palpate.analysis.statistics.doubles import Floats


def triangle_of(rows: Floats) -> Floats:
    """R of rows = Q R, of one matrix or of a stack: the same sums of squares in fewer rows."""
    found: Any = np.linalg.qr(rows, mode="r")
    triangle: Floats = found
    return triangle


def kronecker(blocks: Iterable[Floats]) -> Floats:
    """The Kronecker product of matrices, [[1]] of none."""
    whole: Floats = np.ones((1, 1))
    for block in blocks:
        whole = np.asarray(np.kron(whole, block), dtype=np.float64)
    return whole
