"""Whether every participant rated all that others of the same group rated, for questions that take all attributes."""

from __future__ import annotations

from collections import Counter
from typing import Literal

import numpy as np
import pandas as pd

from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.statistics.columns import coded, numbers_of
from palpate.analysis.statistics.refusals import listed
from palpate.protocols.wording import count

ITEMS = ("attribute", "stimulus")


def without_gaps(
    table: pd.DataFrame, missing: Literal["raise", "listwise"] = "raise", items: tuple[str, ...] = ITEMS
) -> tuple[pd.DataFrame, dict[str, int]]:
    """Return the rows of who rated all that others of their `group` rated, and how much each other person lacks.

    What is owed is, in each group, every combination of `items` as often as the participant with most of it rated it;
    a value of NaN is no rating. Raises DataRefused where someone lacks ratings (unless `missing="listwise"`) and where
    nobody is left.
    """
    known = table[~np.isnan(numbers_of(table["value"], "value"))].reset_index(drop=True)
    gaps = _missing_ratings(known, table, [name for name in items if name in table.columns])
    if not gaps:
        return known, {}
    if missing == "raise":
        lines = (f"{who} lacks {count(number, 'rating')}" for who, number in gaps.items())
        raise DataRefused(
            f"{listed(lines, len(gaps))}; find the ratings, or leave such participants out with `missing: listwise`"
        )
    complete = known[~known["participant"].astype(str).isin(list(gaps))].reset_index(drop=True)
    if not len(complete):
        raise DataRefused(f"each of {count(len(gaps), 'participant')} lacks a rating; nobody is left listwise")
    return complete, gaps


def _missing_ratings(known: pd.DataFrame, table: pd.DataFrame, items: list[str]) -> dict[str, int]:
    people = [str(label) for label in coded(table["participant"], "participant").labels]
    group = dict(zip(map(str, table["participant"]), _groups(table), strict=True))
    labels = list(zip(*(known[name].tolist() for name in items), strict=True)) if items else [()] * len(known)
    rated: dict[str, Counter[tuple[object, ...]]] = {who: Counter() for who in people}
    for who, label in zip(known["participant"].astype(str).tolist(), labels, strict=True):
        rated[who][label] += 1
    owed: dict[str, Counter[tuple[object, ...]]] = {}
    for who in people:
        owed[group[who]] = owed.get(group[who], Counter()) | rated[who]
    missing = {who: (owed[group[who]] - rated[who]).total() for who in people}
    return {who: number for who, number in missing.items() if number}


def _groups(table: pd.DataFrame) -> list[str]:
    return table["group"].astype(str).tolist() if "group" in table.columns else [""] * len(table)
