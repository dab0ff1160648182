"""Which method a lab should train for its textures, and why, in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from palpate.modeling.evaluate.outputs import Choice
from palpate.modeling.textures.registry import BASELINE, DEFAULT

Row = Mapping[str, Any]
RULE = (
    "The default is the method that keeps all limits of free running on the most textures; of equals, the one that ran "
    "on the most, and then the one with the least mean distance of felt levels."
)

NOWHERE = (math.inf, math.inf)


def choice(rows: Sequence[Row], textures: Sequence[Row]) -> Choice:
    """Return the default by `RULE`. `rows` are those of all methods, `textures` of each method on each texture.

    Where nothing ran free it is the shipped default: the error one step ahead says nothing of that.
    """
    ran = [row for row in rows if row.get("felt_dB") is not None]
    if not ran:
        why = (
            "Nothing could be run free, and the error one step ahead does not tell a living model from a dead one: "
            "the shipped default stays."
        )
        return Choice(DEFAULT, why)
    best = min(ran, key=lambda row: (-row["kept"], -row["ran"], row["felt_dB"]))
    kept, of = int(best["kept"]), int(best["ran"])
    why = (
        f"No method keeps all limits of free running on any texture; {best['title']} has the least distance of felt "
        f"levels: {best['felt_dB']:.2f} dB."
        if not kept
        else f"{best['title']} keeps all limits of free running on {kept} of {of} textures, and its felt levels are "
        f"{best['felt_dB']:.2f} dB off."
    )
    sentences = _of_ours(ran, textures, best)
    if not any(row["method"] == DEFAULT for row in rows):
        sentences.append(f"The shipped default, {DEFAULT}, was not evaluated: palpate train goes on taking that.")
    return Choice(best["method"], why, tuple(sentences))


def _of_ours(rows: Sequence[Row], textures: Sequence[Row], best: Row) -> list[str]:
    """Return how the generative network stands against the baseline, and against what beats it."""
    ours = next((row for row in rows if row["method"] == DEFAULT), None)
    baseline = next((row for row in rows if row["method"] == BASELINE), None)
    sentences = []
    if ours is not None and baseline is not None:
        won, of = better(textures, DEFAULT, BASELINE)
        sentences.append(f"{ours['title']} is nearer to the truth than {baseline['title']} on {won} of {of} textures.")
    if ours is not None and best["method"] != DEFAULT:
        simple = "A baseline wins: " if best["method"] == BASELINE else ""
        sentences.append(
            f"{simple}{best['title']} beats {ours['title']}: limits kept on {int(best['kept'])} against "
            f"{int(ours['kept'])} textures, felt levels {best['felt_dB']:.2f} against {ours['felt_dB']:.2f} dB off."
        )
    return sentences


def better(textures: Sequence[Row], one: str, other: str) -> tuple[int, int]:
    """On how many textures one method is nearer than another, and of how many: those on which either ran.

    Nearer: it keeps more of the limits; of equals, its felt levels are less off. One that did not run is farthest.
    """
    by_texture: dict[str, dict[str, tuple[float, float]]] = {}
    for row in textures:
        if row["method"] in (one, other) and row.get("felt_dB") is not None:
            by_texture.setdefault(row["texture"], {})[row["method"]] = (len(row["beyond"].split()), row["felt_dB"])
    pairs = [[ranks.get(name, NOWHERE) for name in (one, other)] for ranks in by_texture.values()]
    return sum(ours < theirs for ours, theirs in pairs), len(pairs)
