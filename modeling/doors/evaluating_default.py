"""Which method a lab should train, and why, in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from modeling.doors.registry import THESIS

ALLOWED = 0.05
"""The network may be this much worse than the best baseline before that is said in plain words."""
SAME = 0.02
"""Errors that differ by less than this share are called equal: the first, simpler method of the table is taken."""
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Choice:
    """The default method of one direction, why it is, and what is to be said of the thesis' own method."""

    method: str
    why: str
    of_the_network: str = ""


def forward_choice(rows: Sequence[Row]) -> Choice:
    """The method with the least MAE; of equals the first. `rows` are those of the table of all methods."""
    best = _least(rows, lambda row: row["mae"])
    least = min(rows, key=lambda row: row["mae"])
    equal = "" if least is best else _equal(least["title"], f"{least['mae']:.2f}")
    of_network = _network(rows, "mae", "MAE", [row for row in rows if row["method"] != THESIS])
    rank = "an" if equal else "the least"
    why = f"{best['title']} has {rank} MAE of {best['mae']:.2f}, all methods on the same folds.{equal}"
    return Choice(best["method"], why, of_network)


def inverse_choice(rows: Sequence[Row]) -> Choice:
    """Of the methods whose profiles the door plays, corners too, the one with the least loop error.

    The loop is closed by perceivers who never saw the training data where there are any, else by the forward model.
    """
    by, whose = _loop(rows)
    able = [row for row in rows if not row["unplayable"] and not row["corners_unplayable"] and row[by] is not None]
    if not able:
        best = _least([row for row in rows if row[by] is not None] or rows, lambda row: row[by])
        why = (
            f"No method stays within the limits of a made profile everywhere, corners too. {best['title']} has the "
            f"least loop error ({whose}): {best[by]:.2f}."
        )
        return Choice(best["method"], why)
    best = _least(able, lambda row: row[by])
    least = min(able, key=lambda row: row[by])
    rank = "the least" if least is best else "a"
    why = (
        f"{best['title']} has {rank} loop error ({whose}) of {best[by]:.2f}, among methods whose every made profile "
        "is within the limits, at the corners too."
    )
    why += "" if least is best else _equal(least["title"], f"{least[by]:.2f}")
    of_network = _network(rows, by, "loop error", [row for row in rows if row["method"] != THESIS])
    return Choice(best["method"], why, of_network)


def _equal(title: str, error: str) -> str:
    return f" {title} with {error} is not {SAME:.0%} better: the simpler one is taken."


def _loop(rows: Sequence[Row]) -> tuple[str, str]:
    fresh = any(row["loop_fresh"] is not None for row in rows)
    return ("loop_fresh", "fresh perceivers") if fresh else ("loop_judge", "judged by the forward model")


def _least(rows: Sequence[Row], error: Callable[[Row], float]) -> Row:
    least = min(error(row) for row in rows)
    return next(row for row in rows if error(row) <= least * (1 + SAME))


def _network(rows: Sequence[Row], name: str, what: str, others: Sequence[Row]) -> str:
    """How the thesis' network stands against the best of the others; "" where either is missing."""
    network = next((row for row in rows if row["method"] == THESIS and row[name] is not None), None)
    known = [row for row in others if row[name] is not None]
    if network is None or not known:
        return ""
    best = min(known, key=lambda row: row[name])
    if best[name] <= 0:
        return f"{best['title']} is without error; the network of the thesis has a {what} of {network[name]:.2f}."
    more = network[name] / best[name] - 1
    told = f"{what} {network[name]:.2f} against {best[name]:.2f} of {best['title']}"
    if more > ALLOWED:
        return f"The network of the thesis is beaten: {told}, {more:.0%} more; {ALLOWED:.0%} was allowed."
    if more > 0:
        return f"The network of the thesis is {more:.1%} behind the best other method: {told}."
    return f"The network of the thesis is the best, by {-more:.1%}: {told}."
