"""R's numbers for the spaces, and small tables."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from palpate.analysis.spaces.dissimilarities import Dissimilarities, dissimilarities_of

FILE = Path(__file__).parents[1] / "data" / "r" / "spaces.json"


@cache
def in_r() -> dict[str, Any]:
    return json.loads(FILE.read_text())


def attitude() -> pd.DataFrame:
    return pd.DataFrame(in_r()["attitude"], columns=in_r()["attitude_columns"])


def given_set(name: str) -> Dissimilarities:
    result = in_r()["sets"][name]
    return dissimilarities_of(pd.DataFrame(result["values"], index=result["labels"], columns=result["labels"]))


def ratings(people: int = 12, stimuli: int = 8, attributes: int = 4, noise: float = 0.7, seed: int = 5) -> pd.DataFrame:
    """Long ratings of stimuli that lie in a plane, by people who are noisy and use the scale each in their own way."""
    rng = np.random.default_rng(seed)
    truth = rng.normal(size=(stimuli, 2)) @ rng.normal(size=(2, attributes))
    values = truth + rng.normal(size=(people, 1, 1)) + noise * rng.normal(size=(people, stimuli, attributes))
    where = np.array(list(np.ndindex(values.shape)))
    return pd.DataFrame(
        {
            "participant": [f"P{i:02d}" for i in where[:, 0]],
            "stimulus": [f"S{i}" for i in where[:, 1]],
            "attribute": [f"A{i}" for i in where[:, 2]],
            "value": values.ravel(),
        }
    )
