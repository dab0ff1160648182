"""Marks of significance: stars by thresholds, and brackets that are stacked without overlap."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from palpate.analysis.figures.columns import finite_or_nan, to_float
from palpate.analysis.figures.figure_kind import FigureSettings
from palpate.analysis.figures.lettering import format_p
from palpate.analysis.plans.answers import Answer, Row
from palpate.analysis.ratings.dataset import DataRefused
from palpate.protocols.did_you_mean import nearest

P_COLUMNS = ("p_adjusted", "p_bonferroni", "p_holm", "p_corr", "p")
"""The columns in which a test of pairs may have its p, the adjusted ones first."""


def p_column(settings: FigureSettings, chosen: str | None, rows: Sequence[Row]) -> str:
    """Return the column of p: the named one, else the first usual one with a number. Raises DataRefused without one."""
    if chosen is not None:
        if chosen not in rows[0]:
            raise DataRefused(
                f"figure {settings.name!r}: the test has no column {chosen!r}; {nearest(chosen, rows[0])}"
            )
        return chosen
    for name in P_COLUMNS:
        if any(row.get(name) is not None for row in rows):
            return name
    if any(name in rows[0] for name in P_COLUMNS):
        return next(name for name in P_COLUMNS if name in rows[0])
    raise DataRefused(f"figure {settings.name!r}: the test has none of the columns {', '.join(P_COLUMNS)}; set `p`")


def pair_rows(
    settings: FigureSettings, answer: Answer, p: str | None, levels: Iterable[str], thresholds: Sequence[float]
) -> list[dict[str, Any]]:
    """Return a, b, p and stars (None if p is undefined) of each pair, in the order of levels.

    Raises DataRefused where the test compares other levels than the figure shows.
    """
    rank = {level: i for i, level in enumerate(levels)}
    column, pairs = p_column(settings, p, answer.rows), []
    for row in answer.rows:
        a, b = sorted((str(row["a"]), str(row["b"])), key=lambda level: rank.get(level, -1))
        if a not in rank or b not in rank or a == b:
            raise DataRefused(
                f"figure {settings.name!r}: its test compares {row['a']!r} with {row['b']!r}; the bars are"
                f" {', '.join(rank)}"
            )
        p_value = finite_or_nan(row[column], f"figure {settings.name!r}, {a} and {b}")
        known = not math.isnan(p_value)
        pairs.append(
            {"a": a, "b": b, "p": p_value if known else None, "stars": stars(p_value, thresholds) if known else None}
        )
    return sorted(pairs, key=lambda row: (rank[row["a"]], rank[row["b"]]))


def stars(p: float, thresholds: Sequence[float]) -> str:
    """Return one star for each threshold that p is below."""
    return "*" * sum(p < threshold for threshold in thresholds)


def stars_note(thresholds: Sequence[float]) -> str:
    """Return the caption's note on the stars."""
    return ", ".join(f"{'*' * i} p < {f'{t:g}'.lstrip('0')}" for i, t in enumerate(thresholds, 1))


def not_drawn_note(pairs: Sequence[Row]) -> str:
    """Return the caption's note on pairs without a bracket, with their p if they are few."""
    note = ""
    for why, without in (("Not significant", ""), ("Undefined", None)):
        rows = [row for row in pairs if row["stars"] == without]
        names = [
            f"{row['a']} and {row['b']}" + ("" if row["p"] is None else f" ({format_p(to_float(row['p']))})")
            for row in rows
        ]
        if len(rows) > 6:
            note += f" {why}: {len(rows)} of {len(pairs)} pairs."
        elif rows:
            note += f" {why}: {'; '.join(names)}."
    return note


def stack_brackets(spans: Sequence[tuple[int, int]]) -> list[int]:
    """Return the storey of each bracket from one place to another: the lowest without overlap, shorter brackets first.

    Brackets that only meet at an end may share a storey.
    """
    storeys: list[list[tuple[int, int]]] = []
    level = [0] * len(spans)
    for i in sorted(range(len(spans)), key=lambda i: (spans[i][1] - spans[i][0], spans[i])):
        left, right = spans[i]
        free = (k for k, taken in enumerate(storeys) if all(right <= a or left >= b for a, b in taken))
        level[i] = next(free, len(storeys))
        if level[i] == len(storeys):
            storeys.append([])
        storeys[level[i]].append((left, right))
    return level
