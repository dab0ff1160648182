"""The targets of the evaluation with their results, each with a label."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from palpate.modeling.textures.evaluation.evaluate import TextureEvaluation, better
from palpate.modeling.textures.evaluation.tables import Row, least, most, texture_rows
from palpate.modeling.textures.free_run import CYCLE, ENVELOPE, GFC, LEVEL
from palpate.modeling.textures.registry import BASELINE, DEFAULT, THESIS

BEATEN = 4
"""The number of textures, of six, on which the generative network must be better than the baseline."""
_LIMITS: tuple[tuple[str, str, Callable[[float], bool], str], ...] = (
    ("Level", "level", lambda value: LEVEL[0] <= value <= LEVEL[1], f"{LEVEL[0]:g} to {LEVEL[1]:g}"),
    ("Smoothed GFC", "smoothed_gfc", lambda value: value >= GFC, f"at least {GFC:g}"),
    ("Envelope", "envelope", lambda value: value >= ENVELOPE, f"correlation at least {ENVELOPE:g}"),
    ("No limit cycle", "cycle_excess", lambda value: value <= CYCLE, f"at most {CYCLE:g} above the truth"),
)


def reached(evaluation: TextureEvaluation) -> list[tuple[str, str]]:
    """Return results against targets of the generative network's free run, and of AR and the deterministic network.

    Empty if the generative network did not run.
    """
    rows = texture_rows(evaluation)
    ours = _free_rows_of(rows, DEFAULT)
    if not ours:
        return []
    points = [_limit_point(evaluation, name, ours, column, within, limit) for name, column, within, limit in _LIMITS]
    if _free_rows_of(rows, BASELINE):
        won, of = better(rows, DEFAULT, BASELINE)
        aim = -(-of * BEATEN // 6)
        verdict = "reached" if won >= aim else "not reached"
        points.append(("Against AR", f"Nearer on {won} of {of} textures (aim: {aim}): {verdict}."))
    if plain := _free_rows_of(rows, THESIS):
        within_all = sum(not row["beyond"] for row in plain)
        low, high = least(row["level"] for row in plain), most(row["level"] for row in plain)
        cycle = most(row["cycle_excess"] for row in plain)
        spread = "" if low is None or high is None else f" Level {low:.2f} to {high:.2f}"
        repeats = "" if cycle is None else f"; repeats itself by up to {cycle:.2f} more than the truth"
        sentence = f"Keeps all limits on {within_all} of {len(plain)} textures when it runs on its own output."
        points.append(("One-step FoTEN", f"{sentence}{spread}{repeats}."))
    return points


def _limit_point(
    evaluation: TextureEvaluation,
    name: str,
    rows: Sequence[Row],
    column: str,
    within: Callable[[float], bool],
    limit: str,
) -> tuple[str, str]:
    values = {row["texture"]: row[column] for row in rows if row[column] is not None}
    if not values:
        return name, "Not known for these recordings."
    silent = [row["texture"] for row in rows if row["level"] == 0]
    off = dict.fromkeys([*(texture for texture, value in values.items() if not within(value)), *silent])
    blank = [texture for texture in evaluation.textures if texture not in {**values, **off}]
    low, high = least(values.values()), most(values.values())
    # another realisation of the truth, for numbers that it bounds
    ceilings = [ceiling[column] for ceiling in evaluation.ceilings.values() if ceiling.get(column) is not None]
    bounded = ceilings and column not in ("level", "cycle_excess")
    again = f"; the truth again: {least(ceilings):.3f} to {most(ceilings):.3f}" if bounded else ""
    sentence = f"{low:.3f} to {high:.3f} over the textures (aim: {limit}{again})".replace("-", "−")
    where = f"reached on {len(values.keys() - off.keys())} of {len(evaluation.textures)}"
    missed = "".join(
        f", {what} {', '.join(texture.replace('_', ' ') for texture in textures)}"
        for what, textures in (("not on", off), ("not evaluated on", blank))
        if textures
    )
    return name, f"{sentence}: {f'{where}{missed}' if missed else 'reached'}."


def _free_rows_of(rows: Sequence[Row], method: str) -> list[Row]:
    return [row for row in rows if row["method"] == method and row["level"] is not None]
