"""What functions of participants have in common: numbers of a fit, means over people, differences within them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.analysis.choices.intervals import CORRECTING_DRAWS, profile_intervals, resampled_answers
from palpate.analysis.statistics.f_and_t import adjusted, t_critical, t_two_sided

if TYPE_CHECKING:
    from palpate.analysis.choices.psychometric import Psychometric
    from palpate.analysis.plans.answers import Row, Selected
    from palpate.analysis.plans.families.choices import PsychometricFunction
    from palpate.analysis.statistics.doubles import Floats

PARTICIPANT = "participant"
MOST_COMPARED = 12
"""The largest number of tracks of which every two are compared."""
HOW = {
    "corrected": "profile likelihood with Bartlett's correction",
    "profile": "profile likelihood",
    "bootstrap": "parametric bootstrap, percentiles",
    "posterior": "posterior, equal tails",
    "none": "none",
}
"""The kinds of interval of a function, in words."""


def fitted_numbers(
    selected: Selected, settings: PsychometricFunction, fit: Psychometric, interval: str
) -> tuple[dict[str, Any], list[str], float]:
    """Return the numbers of a fit by maximum likelihood, notes on its intervals, and the share of lost simulated sets.

    `interval` is one of `HOW`, but "posterior".
    """
    draws, seed = settings.draws or selected.draws, selected.seed
    again = None if interval == "none" else resampled_answers(fit, draws, settings.confidence, seed)
    ends: list[tuple[float, float]] = [(math.nan, math.nan)] * 2
    notes: list[str] = []
    if interval in ("profile", "corrected"):
        how = (0, 0) if interval == "profile" else (CORRECTING_DRAWS, seed)
        found = profile_intervals(fit, settings.confidence, *how)
        ends = [(one.low, one.high) for one in found]
        notes = [one.note for one in found]
    if interval == "bootstrap" and again is not None:
        ends = [(again.threshold.low, again.threshold.high), (again.jnd.low, again.jnd.high)]
    numbers = {
        "threshold": fit.threshold,
        "threshold_low": ends[0][0],
        "threshold_high": ends[0][1],
        "jnd": fit.jnd,
        "jnd_low": ends[1][0],
        "jnd_high": ends[1][1],
        "slope": fit.slope,
        "guess": fit.guess,
        "lapse": fit.lapse,
        "deviance": fit.deviance,
        "df": fit.df,
        "p_deviance": None if again is None else again.p_deviance,
    }
    return numbers, notes, 0.0 if again is None else again.lost


def summary_rows(
    rows: list[dict[str, Any]], by: tuple[str, ...], names: tuple[str, ...], confidence: float
) -> Iterator[Row]:
    """Yield means over participants with SD and Student's interval, by combination of the other columns."""
    others = [name for name in by if name != PARTICIPANT]
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in others), []).append(row)
    for key, members in groups.items():
        for name in names:
            values = [float(row[name]) for row in members if row.get(name) is not None]
            if not values:
                continue
            n, mean = len(values), float(np.mean(values))
            sd = float(np.std(values, ddof=1)) if n > 1 else None
            half = None if sd is None else t_critical(n - 1, confidence) * sd / math.sqrt(n)
            yield {
                **dict(zip(others, key, strict=True)),
                "quantity": name, "n": n, "without_estimate": len(members) - n, "mean": mean, "sd": sd,
                "ci_low": None if half is None else mean - half, "ci_high": None if half is None else mean + half,
                "note": "" if n > 1 else "one value: no spread",
            }  # fmt: skip


def difference_rows(
    rows: list[dict[str, Any]], by: tuple[str, ...], names: tuple[str, ...], confidence: float
) -> Iterator[Row]:
    """Yield paired t tests of every two combinations of the columns but the participant, over those with both numbers.

    `p_corrected` is by Holm's method over the pairs of a quantity. None where the rows are not of participants.
    """
    others = [name for name in by if name != PARTICIPANT]
    if PARTICIPANT not in by or not others:
        return
    keys = list(dict.fromkeys(tuple(row[name] for name in others) for row in rows))
    if not 2 <= len(keys) <= MOST_COMPARED:
        return
    for name in names:
        values = {
            key: {row[PARTICIPANT]: float(row[name]) for row in rows
                  if row.get(name) is not None and tuple(row[other] for other in others) == key}
            for key in keys
        }  # fmt: skip
        tests: list[dict[str, Any]] = []
        for one, two in combinations(keys, 2):
            both = [who for who in values[one] if who in values[two]]
            found = np.array([values[one][who] - values[two][who] for who in both])
            tests.append(
                {"quantity": name, "one": ", ".join(map(str, one)), "two": ", ".join(map(str, two)), "n": len(both)}
                | _paired(found, confidence)
            )
        known = [float(test["p"]) for test in tests if test["p"] is not None]
        corrected = iter(adjusted(known, "holm") if known else ())
        for test in tests:
            yield {**test, "p_corrected": None if test["p"] is None else next(corrected)}


def _paired(found: Floats, confidence: float) -> dict[str, Any]:
    """Return the mean difference with its interval and t test; without p for fewer than two, or where all are equal."""
    n = len(found)
    mean = float(found.mean()) if n else None
    sd = float(found.std(ddof=1)) if n > 1 else 0.0
    if mean is None or sd == 0:
        note = "all differences are equal" if n > 1 else "fewer than two participants have both"
        missing = dict.fromkeys(("sd", "ci_low", "ci_high", "t", "df", "p"))
        return {"difference": mean, **missing, "note": note}
    error = sd / math.sqrt(n)
    half = t_critical(n - 1, confidence) * error
    return {
        "difference": mean, "sd": sd, "ci_low": mean - half, "ci_high": mean + half, "t": mean / error, "df": n - 1,
        "p": t_two_sided(mean / error, n - 1), "note": "",
    }  # fmt: skip
