"""What the tests of this room share: R's numbers, its tables, and designs made from a seed."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

DATA = Path(__file__).parent.parent / "data" / "r" / "variance"
R: dict[str, Any] = json.loads((DATA / "variance.json").read_text(encoding="utf-8"))


def r_table(name: str) -> pd.DataFrame:
    """A table that variance.R made: labels as text, y as the nearest double."""
    with (DATA / name).open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    return pd.DataFrame(rows).astype({"y": float})


def design(sizes: dict[tuple[str, str], int], k: tuple[int, ...] = (3, 2), seed: int = 1) -> pd.DataFrame:
    """A long table with between factors g and h of these group sizes and within factors A and B."""
    rng = np.random.Generator(np.random.PCG64(seed))
    rows = []
    for (g, h), size in sizes.items():
        for i in range(size):
            cells = np.round(rng.normal(50, 6) + rng.normal(0, 4, k), 1)
            for where, y in np.ndenumerate(cells):
                labels = {name: f"{name.lower()}{level}" for name, level in zip("AB", where, strict=False)}
                rows.append({"subject": f"{g}{h}{i}", "g": g, "h": h, **labels, "y": y})
    return pd.DataFrame(rows)


UNEQUAL = {("u", "f"): 3, ("u", "m"): 5, ("v", "f"): 6, ("v", "m"): 2}
