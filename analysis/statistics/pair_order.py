"""Pairs of levels in a given order, each as the earlier level minus the later one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

ENDS = (("ci_low", "ci_high"), ("bound_low", "bound_high"), ("T_low", "T_high"))


def pairs_in_order(
    table: pd.DataFrame, order: Sequence[str], sizes: Sequence[str] = ("dz",), turned: pd.DataFrame | None = None
) -> list[dict[str, Any]]:
    """The rows of a table of pairs (columns A and B) with the level first that comes first in `order`.

    A level that `order` does not name comes after those that it names. `sizes` are the columns of effect sizes, which
    change their sign as the differences do. `turned` is the table that the rows to be turned round are taken from, row
    by row, where turning changes more than signs (bounds that are not symmetric); None takes them from `table`.
    """
    place = {level: at for at, level in enumerate(order)}
    places = {level: place.get(str(level), len(place)) for level in {*table["A"], *table["B"]}}
    backwards = (table if turned is None else turned).to_dict("records")
    rows = [
        {str(name): value for name, value in row.items()}
        if places[row["A"]] <= places[row["B"]]
        else _turned(back, sizes)
        for row, back in zip(table.to_dict("records"), backwards, strict=True)
    ]
    return sorted(rows, key=lambda row: (places[row["A"]], places[row["B"]]))


def _turned(row: Mapping[Any, Any], sizes: Sequence[str]) -> dict[str, Any]:
    """B minus A instead of A minus B."""
    ends = (*ENDS, *((f"{size}_low", f"{size}_high") for size in sizes))
    signed = {name: -row[name] for name in ("mean_diff", "T", *sizes) if name in row}
    swapped = {a: -row[b] for low, high in ends if low in row for a, b in ((low, high), (high, low))}
    p = {"p_low": row["p_high"], "p_high": row["p_low"]} if "p_low" in row else {}
    return {**{str(name): value for name, value in row.items()}, "A": row["B"], "B": row["A"], **signed, **swapped, **p}
