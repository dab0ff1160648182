"""Answers of a plan's tests on made tables, as `regenerate` would hold them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from palpate.analysis.plans.answers import MissingSummary, QuestionResult, Selected
from palpate.analysis.plans.kinds import TESTS


def rated(shape: tuple[int, ...] = (12, 4), *, seed: int = 3, groups: int = 1, apart: float = 8.0) -> pd.DataFrame:
    """Ratings of participants (first axis) in every cell of the factors a, b, ...; participants in turn in a group."""
    rng = np.random.Generator(np.random.PCG64(seed))
    people = rng.normal(50, apart, (shape[0],) + (1,) * (len(shape) - 1))
    cells = people + rng.normal(0, 5, shape) + 2.0 * np.arange(shape[-1])
    return long(cells, groups)


def long(cells: np.ndarray, groups: int = 1) -> pd.DataFrame:
    """The cells as rows of ratings."""
    people, *factors = np.indices(cells.shape).reshape(cells.ndim, -1)
    labels = {name: [f"{name}{i}" for i in own] for name, own in zip("abc", factors, strict=False)}
    stimulus = [" ".join(parts) for parts in zip(*labels.values(), strict=True)]
    return pd.DataFrame(
        {
            "participant": [f"P{i:03d}" for i in people],
            "group": [f"g{i % groups}" for i in people],
            **labels,
            "stimulus": stimulus,
            "session": "s1",
            "trial": np.arange(len(people)),
            "attribute": "Soft",
            "value": cells.ravel(),
        }
    )


def answered(table: pd.DataFrame, test: str, missing: str = "refuse", gaps: int = 0, **settings: Any) -> QuestionResult:
    """The answer of one test on these rows; `gaps` cells of them are missing, `missing` says what is done about it."""
    kind = TESTS[test]
    request = kind.settings(name=test, test=test, missing=missing, **settings)
    selected = Selected(table=table, trials=table, outcomes=("Soft",), levels={}, draws=100)
    answer = (kind.with_gaps if gaps and kind.with_gaps else kind.answer)(selected, request)
    return QuestionResult(request, "Soft", answer, "", "", MissingSummary(missing, gaps, gaps), 0.0, table)
