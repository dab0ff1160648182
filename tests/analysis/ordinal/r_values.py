"""R's numbers and the tables they were made from; see tests/analysis/data/r/ordinal.R."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.analysis.statistics.references import reference_table

FOLDER = Path(__file__).parent.parent / "data" / "r"
HOUSING_ORDERS = {
    "Infl": ["Low", "Medium", "High"],
    "Cont": ["Low", "High"],
    "Type": ["Tower", "Apartment", "Atrium", "Terrace"],
}


def r_values(part):
    return json.loads((FOLDER / "ordinal.json").read_text(encoding="utf-8"))[part]


def r_table(name):
    return pd.read_csv(FOLDER / f"ordinal_{name}.csv", keep_default_na=False)


def shipped(name):
    return reference_table(f"csv/{name}.csv")


def long(cells, label=str):
    people, conditions = np.indices(np.shape(cells)).reshape(2, -1)
    names = {"subject": [label(i) for i in people], "condition": [label(j) for j in conditions]}
    return pd.DataFrame({**names, "y": np.asarray(cells, dtype=float).ravel()})
