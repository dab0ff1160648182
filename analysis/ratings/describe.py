"""Means and standard deviations, correctly rounded, over ratings or over participants: the two are named apart."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from math import isfinite
from typing import Literal

import pandas as pd

from palpate.analysis.ratings.dataset import DataRefused, Ratings, natural_key
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count, some

Kind = Literal["over ratings", "over participants"]
ONE_RATING = "one rating has no spread"
ONE_PARTICIPANT = "one participant has no spread"


def describe(ratings: Ratings, by: Sequence[str], *, kind: Kind = "over ratings") -> pd.DataFrame:
    """Return one row for each combination of the `by` columns that occurs: n, mean, sd (n - 1) and what n counts.

    'over ratings' uses every rating; 'over participants' first averages each participant's ratings in the cell (over
    the cars of a variant, say), then takes mean and SD of these means (the error bars of thesis Figure 5.9);
    `ratings_min` and `ratings_max` are how many ratings a participant has. `by` may name 'category'. Rows are in the
    order of the study. sd is None if n is 1, and `sd_reason` says why. Means and SDs are computed in exact arithmetic
    and rounded once. Raises DataRefused on a value that is not finite, a missing column, and if attributes would be
    averaged without a request.
    """
    if kind == "over ratings":
        rows = [(*label, kind, *_summary(values, ONE_RATING)) for label, values in _cells(ratings, tuple(by))]
        return _frame(rows, (*by, "kind", "n", "mean", "sd", "sd_reason"))
    if kind == "over participants":
        people: dict[tuple[str, ...], list[tuple[float, int]]] = {}
        for label, values in _cells(ratings, (*by, "participant")):
            people.setdefault(label[:-1], []).append((statistics.mean(values), len(values)))
        summaries = []
        for label, averages in people.items():
            means, counts = zip(*averages, strict=True)
            summaries.append((*label, kind, *_summary(means, ONE_PARTICIPANT), min(counts), max(counts)))
        return _frame(summaries, (*by, "kind", "n", "mean", "sd", "sd_reason", "ratings_min", "ratings_max"))
    raise DataRefused(f"means {kind!r}: 'over ratings' or 'over participants' is expected")


def _summary(values: Sequence[float], reason: str) -> tuple[int, float, float | None, str]:
    """Return n, mean, sample SD and the reason if it is missing; the statistics module sums fractions exactly."""
    mean = statistics.mean(values)
    if len(values) < 2:
        return len(values), mean, None, reason
    return len(values), mean, statistics.stdev(values), ""


def _cells(ratings: Ratings, by: tuple[str, ...]) -> list[tuple[tuple[str, ...], list[float]]]:
    """Return the values of each occurring combination of `by`, in the order of the study."""
    known = [*map(str, ratings.table.columns), "category"]
    for name in by:
        if name not in known:
            raise DataRefused(f"data set {ratings.name!r}: no column {name!r}; {nearest(name, known)}")
    if "category" in by and (without := [a for a in ratings.attributes if a not in ratings.categories]):
        raise DataRefused(f"data set {ratings.name!r}: {some(without)}: no category is declared")
    if len(ratings.attributes) > 1 and not {"attribute", "category"} & set(by):
        raise DataRefused(
            f"data set {ratings.name!r}: {len(ratings.attributes)} attributes would be averaged;"
            " name 'attribute' or 'category' among the columns"
        )
    bad = [place for place, value in enumerate(ratings.table["value"].tolist()) if not isfinite(value)]
    if bad:
        first = ratings.table.iloc[bad[0]]
        raise DataRefused(
            f"data set {ratings.name!r}: {count(len(bad), 'value is', 'values are')} not finite, the first is"
            f" {first['value']} of {first['participant']} on {first['attribute']}; the design check names them all"
        )
    of_category = [ratings.categories[name] for name in ratings.table["attribute"]] if "category" in by else []
    columns = [of_category if name == "category" else list(map(str, ratings.table[name].tolist())) for name in by]
    cells: dict[tuple[str, ...], list[float]] = {}
    for *label, value in zip(*columns, ratings.table["value"].tolist(), strict=True):
        cells.setdefault(tuple(label), []).append(value)
    ranks: list[dict[str, int]] = []
    for name, labels in zip(by, columns, strict=True):
        if name == "category":
            order = list(dict.fromkeys(ratings.categories[attribute] for attribute in ratings.attributes))
        elif name in ("attribute", ratings.families, *ratings.within, *ratings.between):
            order = list(ratings.levels(name))
        else:
            order = sorted(set(labels), key=natural_key)
        ranks.append({level: rank for rank, level in enumerate(order)})
    return sorted(cells.items(), key=lambda cell: [rank[level] for rank, level in zip(ranks, cell[0], strict=True)])


def _frame(rows: Sequence[tuple[object, ...]], columns: Sequence[str]) -> pd.DataFrame:
    """Return a table with missing SDs as None, since NaN could be taken for a number."""
    table = pd.DataFrame(list(rows), columns=list(columns))
    if "sd" in table.columns:
        table["sd"] = pd.Series([row[columns.index("sd")] for row in rows], dtype="object", index=table.index)
    return table
