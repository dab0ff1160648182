"""Types of arrays of any shape: the docstrings give shapes and units."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]
