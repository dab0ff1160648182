"""Which method a lab should train for its textures' attributes, and why, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from palpate.modeling.attributes.entries import FEELING, PROPOSED, SEEING
from palpate.modeling.evaluate.outputs import Choice

Row = Mapping[str, Any]
DEFAULT = PROPOSED
"""What is trained where no evaluation of the same textures chose another one."""
RULE = (
    "The default is the method with the least MAE, mean over textures and attributes, of those that answered for every "
    "texture; of equals, the one that is trained faster."
)


def choice(rows: Sequence[Row]) -> Choice:
    """Return the default by `RULE`, from the rows of all methods (`mae`, `train_s`, and against the best `best_*`).

    Where none answered for every texture it is the shipped default.
    """
    answered = [row for row in rows if row["mae"] is not None]
    if not answered:
        return Choice(DEFAULT, "No method answered for every texture: the shipped default stays.")
    best = min(answered, key=lambda row: (row["mae"], row["train_s"]))
    return Choice(
        best["method"], f"{best['title']} has the least MAE: {best['mae']:.2f} (0 to 100).", _ours(best, answered)
    )


def _ours(best: Row, rows: Sequence[Row]) -> tuple[str, ...]:
    ours = next((row for row in rows if row["method"] == PROPOSED), None)
    if ours is None:
        return ("The thesis' network was not evaluated, or did not answer for every texture.",)
    if best["method"] != PROPOSED:
        chance = ", which may be chance" if ours["best_chance"] else ""
        more = f"{ours['mae'] - best['mae']:.2f} more than that of {best['title']}{chance}"
        return (f"The MAE of the thesis' network is not the lowest: {ours['mae']:.2f}, {more}.",)
    if len(rows) == 1:
        return ("Nothing else was evaluated.",)
    close = [row["title"] for row in rows if row["method"] != PROPOSED and row["best_chance"]]
    lead = f"Its lead over {', '.join(close)} may be chance." if close else "No interval of its leads holds 0."
    return ("The MAE of the thesis' network is the lowest.", lead)


def fusion(rows: Sequence[Row]) -> tuple[str, str] | None:
    """Return whether the proposed network errs less than each of its branches, as a label and a sentence.

    None where they were not all evaluated. `rows` hold the difference from the proposed one in `ours_*`.
    """
    answered = {row["method"]: row for row in rows if row["mae"] is not None}
    if not {PROPOSED, SEEING, FEELING} <= set(answered):
        return None
    ours = answered[PROPOSED]["mae"]
    parts = [
        f"{answered[name]['title']} {answered[name]['mae']:.2f}{_surely(answered[name])}" for name in (SEEING, FEELING)
    ]
    met = all(ours < answered[name]["mae"] for name in (SEEING, FEELING))
    sentence = f"Both senses {ours:.2f}, {' and '.join(parts)} (MAE; wanted: less than each branch by itself)"
    return "Fusion", f"{sentence}: {'reached' if met else 'not reached'}."


def _surely(row: Row) -> str:
    """Return whether the difference from the proposed one may be chance."""
    return " (a difference that may be chance)" if row["ours_chance"] else ""
