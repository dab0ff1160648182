"""Which method a lab should train, and why, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from palpate.modeling.doors.registry import NO_FILE, THESIS
from palpate.modeling.evaluate.outputs import Choice

ALLOWED = 0.05
"""The network may be this much worse than the best baseline before that is said in plain words."""
Row = Mapping[str, Any]


def forward_choice(rows: Sequence[Row]) -> Choice:
    """Return the method with the least MAE; of equals the first. `rows` are those of the table of all methods."""
    best = min(rows, key=lambda row: row["mae"])
    why = f"{best['title']} has the least MAE: {best['mae']:.2f}, all methods on the same folds."
    return Choice(best["method"], why, _network(rows, "mae", "MAE"))


def inverse_choice(rows: Sequence[Row]) -> Choice:
    """Of the methods that a rig can be given and whose profiles it plays, corners too, the one of least loop error.

    The loop is closed by perceivers who never saw the training data where there are any, else by the forward model.
    """
    fresh = any(row["loop_fresh"] is not None for row in rows)
    by, whose = ("loop_fresh", "fresh perceivers") if fresh else ("loop_judge", "judged by the forward model")
    possible = [row for row in rows if ("inverse", row["method"]) not in NO_FILE] or rows
    able = [row for row in possible if not row["unplayable"] and not row["corners_unplayable"]]
    if not able:
        best = min(possible, key=lambda row: row[by])
        why = (
            f"No method stays within the limits of a made profile everywhere, corners too. {best['title']} has the "
            f"least loop error ({whose}): {best[by]:.2f}."
        )
        return Choice(best["method"], why)
    best = min(able, key=lambda row: row[by])
    why = (
        f"{best['title']} has the least loop error ({whose}): {best[by]:.2f}, among methods whose every made profile "
        "is within the limits, at the corners too."
    )
    return Choice(best["method"], why, _network(rows, by, "loop error"))


def _network(rows: Sequence[Row], name: str, what: str) -> tuple[str, ...]:
    """Return how the thesis' network stands against the best of the others; empty where either is missing."""
    network = next((row for row in rows if row["method"] == THESIS and row[name] is not None), None)
    known = [row for row in rows if row["method"] != THESIS and row[name] is not None]
    if network is None or not known:
        return ()
    best = min(known, key=lambda row: row[name])
    if best[name] <= 0:
        return (f"{best['title']} is without error; the network of the thesis has a {what} of {network[name]:.2f}.",)
    more = network[name] / best[name] - 1
    numbers = f"{what} {network[name]:.2f} against {best[name]:.2f} of {best['title']}"
    if more > ALLOWED:
        return (f"The network of the thesis is beaten: {numbers}, {more:.0%} more; {ALLOWED:.0%} was allowed.",)
    if more > 0:
        return (f"The network of the thesis is {more:.1%} behind the best other method: {numbers}.",)
    return (f"The network of the thesis is the best, by {-more:.1%}: {numbers}.",)
