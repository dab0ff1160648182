"""Summaries of Likert items: counts and shares of each point, and measures of their middle."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import pandas as pd

from palpate.analysis.ordinal.ranks import Truths, refuse_huge, rounding, same_value
from palpate.analysis.statistics.cells import check_columns, coded, numbers_of
from palpate.analysis.statistics.doubles import Floats, deviation_ss, exact_sum
from palpate.analysis.statistics.refusals import BadOption, BadValue, listed, shown

MOST_POINTS = 101


def likert(data: pd.DataFrame, dv: Hashable, item: Hashable, points: Sequence[float]) -> pd.DataFrame:
    """Return a summary of each item's answers: one row per item, in natural order of names.

    `points` are the scale's points from lowest to highest, such as range(1, 8); an answer between them is refused, an
    empty answer counts as `missing`. Columns: `n`, `missing`, `n_POINT` and `share_POINT` (of the answers given),
    `median`, `q1`, `q3` (linear between order statistics: type 7 of Hyndman & Fan 1996, R's default), `mode` (all most
    frequent points), `mean` and `sd` (n - 1), which assume equal distances of points, `agree`: the share of answers
    above the middle of the scale, `disagree` below it, and `note`. Raises a StatisticsError (a ValueError) that names
    what is wrong with the table.
    """
    given = [] if isinstance(points, str) else list(points)
    finite = (isinstance(p, int | float) and not isinstance(p, bool) and math.isfinite(p) for p in given)
    if not 2 <= len(given) <= MOST_POINTS or not all(finite):
        raise BadOption(f"points={shown(points)}: 2 to {MOST_POINTS} numbers are expected, such as range(1, 8)")
    scale = np.array(given, dtype=np.float64)
    if not np.all(np.diff(scale) > 0):
        raise BadOption(f"points={given}: each point must be above the one before it")
    refuse_huge(scale)
    check_columns(data, [dv, item])
    values, items = numbers_of(data[dv], dv), coded(data[item], item)
    rows = []
    for code, label in enumerate(items.labels):
        own = values[items.codes == code]
        answers = own[~np.isnan(own)]
        rows.append(
            {"item": label, "n": len(answers), "missing": len(own) - len(answers)} | _summary(answers, scale, label)
        )
    return pd.DataFrame(rows)


def _summary(answers: Floats, scale: Floats, label: Hashable) -> dict[str, Any]:
    # The point that each answer is, rounding allowed for.
    refuse_huge(np.append(answers, 0.0))
    place = np.abs(answers[:, None] - scale[None, :]).argmin(axis=1)
    room = np.maximum(rounding(answers), rounding(scale[place]))
    on: Truths = same_value(answers, scale[place], room)
    if not on.all():
        off = sorted(set(answers[~on].tolist()))
        points = ", ".join(f"{point:g}" for point in scale.tolist())
        raise BadValue(
            f"item {label!r} has answers that are not on the scale {points}: "
            f"{listed(map(repr, off), len(off))}; correct them or give the scale's own points"
        )
    counts = np.bincount(place, minlength=len(scale)).tolist()
    n, names = len(answers), [f"{point:g}" for point in scale.tolist()]
    per_point: dict[str, Any] = {f"n_{name}": count for name, count in zip(names, counts, strict=True)}
    per_point |= {f"share_{name}": count / n if n else math.nan for name, count in zip(names, counts, strict=True)}
    if not n:
        undefined = dict.fromkeys(("median", "q1", "q3", "mean", "sd", "agree", "disagree"), math.nan)
        return per_point | undefined | {"mode": "", "note": "no answer was given"}
    modes = [name for name, count in zip(names, counts, strict=True) if count == max(counts)]
    note = "sd is undefined: one answer" if n == 1 else ""
    answers, middle = np.sort(scale[place]), (scale[0] + scale[-1]) / 2
    q1, median, q3 = np.quantile(answers, [0.25, 0.5, 0.75]).tolist()
    first = float(answers[0])
    mean = float(Fraction(first) + exact_sum(answers, first) / n)
    sd = math.sqrt(deviation_ss(answers) / (n - 1)) if n > 1 else math.nan
    above, below = int(np.count_nonzero(answers > middle)), int(np.count_nonzero(answers < middle))
    numbers = {"median": median, "q1": q1, "q3": q3, "mean": mean, "sd": sd, "agree": above / n, "disagree": below / n}
    return per_point | numbers | {"mode": ", ".join(modes), "note": note}
