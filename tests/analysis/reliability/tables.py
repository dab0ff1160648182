"""What the tests of reliability share: R's numbers, and long tables of small arrays."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

R = json.loads((Path(__file__).parent.parent / "data" / "r" / "reliability.json").read_text(encoding="utf-8"))


def long(values: Any, label: type = str) -> pd.DataFrame:
    """Columns target, rater, y of an array (targets, raters); NaN is a row without a value."""
    cells: NDArray[np.float64] = np.asarray(values, dtype=np.float64)
    targets, raters = np.indices(cells.shape).reshape(2, -1)
    names = {"target": [label(int(i)) for i in targets], "rater": [label(int(i)) for i in raters]}
    return pd.DataFrame({**names, "y": cells.ravel()})


def wide(name: str) -> NDArray[np.float64]:
    """One of R's sets as an array (targets or cases, raters or items)."""
    return np.array(R["sets"][name]["wide"], dtype=np.float64)


def relative(result: float, expected: float) -> float:
    """|found - expected| / |expected|; infinite where nothing was found."""
    return abs(result - expected) / (abs(expected) or 1.0) if np.isfinite(result) else np.inf
