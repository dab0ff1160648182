"""Confidence intervals of partial and generalized eta squared from the noncentral F distribution."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from typing import Any, Literal, TypeAlias

import pandas as pd

from palpate.analysis.statistics.noncentral import NONE, f_noncentrality
from palpate.analysis.statistics.refusals import BadOption, UnknownColumn, refuse_idle, shown

Corrected: TypeAlias = Literal["GG", "HF", "none"]
EPSILONS = {"GG": "eps", "HF": "eps_HF"}
TINY = "the interval of eta squared is 0 to 0: F is smaller than chance alone would make it"
ABOVE = "eta squared lies above its own interval: F is so small that chance alone would often make a larger one"
BEYOND = "no interval of eta squared: F is beyond what the noncentral F distribution can tell"


def eta_squared_interval(
    f: float, df1: float, df2: float, *, confidence: float = 0.90, added: float = 0.0
) -> tuple[float, float]:
    """The interval of partial eta squared that an F with its degrees of freedom gives: nc / (nc + df2 + added).

    nc are the limits of F's noncentrality (Steiger 2004). `added` = 0 is the scale on which F df1 / (F df1 + df2) is
    partial eta squared itself (as in R's effectsize); `added` = df1 + 1 divides by the number of participants of a
    design between groups (Steiger 2004, eq. 51; R's MBESS). 90 % by default: it leaves out 0 where p < .05.
    NaN where F is NaN. Raises BadOption for a confidence outside 0..1.
    """
    low, high = f_noncentrality(f, df1, df2, checked_confidence(confidence))
    return low / (low + df2 + added), high / (high + df2 + added)


def checked_confidence(confidence: object) -> float:
    """Refuse a confidence that is no number between 0 and 1."""
    if isinstance(confidence, bool) or not isinstance(confidence, int | float) or not 0 < confidence < 1:
        raise BadOption(f"confidence={shown(confidence)} is unknown: a number between 0 and 1, such as 0.90")
    return float(confidence)


def eta_squared_intervals(
    table: pd.DataFrame, *, confidence: float = 0.90, correction: Corrected = "none"
) -> pd.DataFrame:
    """Intervals for every row of a result of `rm_anova`, `mixed_anova` or `anova`: one row per effect.

    `np2_low` and `np2_high` come from the noncentral F with the effect's degrees of freedom, times epsilon where
    `correction` is "GG" or "HF" and the effect has one. `ng2_low` and `ng2_high` are the same limits carried over to
    generalized eta squared, holding the ratio of this effect's error to all others at what was observed; a table of
    `anova` has `eta2_low` and `eta2_high` instead. A row without F has NaN and a `note`.
    Raises BadOption, and UnknownColumn for a table that none of these calls made.
    """
    level = checked_confidence(confidence)
    if not isinstance(correction, str) or correction not in ("none", *EPSILONS):
        raise BadOption(f"correction={shown(correction)} is unknown: 'GG', 'HF' or 'none'")
    lacking = {"Source", "F", "ddof1", "ddof2", "np2", "note"} - set(table.columns)
    if lacking:
        raise UnknownColumn(
            f"the table has no column {min(lacking)!r}; pass a result of rm_anova, mixed_anova or anova"
        )
    if correction in EPSILONS and EPSILONS[correction] not in table:
        refuse_idle("correction", correction, "none", "on a table without epsilon, such as one of `anova`")
    return pd.DataFrame([_row(row, level, correction) for row in table.to_dict("records")])


def _row(row: Mapping[Hashable, Any], confidence: float, correction: Corrected) -> dict[str, Any]:
    eps = float(row.get(EPSILONS.get(correction, ""), 1.0))
    partial = NONE
    if not math.isnan(row["F"] * eps):
        partial = eta_squared_interval(row["F"], row["ddof1"] * eps, row["ddof2"] * eps, confidence=confidence)
    generalized = tuple(_carried(limit, row) for limit in partial)
    name = "ng2" if "ng2" in row else "eta2"
    found = {"Source": row["Source"], **_named("np2", row["np2"], partial), **_named(name, row[name], generalized)}
    return found | {"note": "; ".join(filter(None, (row["note"], _note(row, partial))))}


def _note(row: Mapping[Hashable, Any], limits: tuple[float, float]) -> str:
    if math.isnan(row["F"]):
        return ""
    if math.isnan(sum(limits)):
        return BEYOND
    if limits[1] >= row["np2"]:
        return ""
    return TINY if limits[1] == 0 else ABOVE


def _named(name: str, value: float, limits: tuple[float, ...]) -> dict[str, float]:
    return {name: value, f"{name}_low": limits[0], f"{name}_high": limits[1]}


def _carried(limit: float, row: Mapping[Hashable, Any]) -> float:
    """A limit of partial eta squared on the scale of the generalized one: SS / (SS + r SS_error), r as observed."""
    partial, generalized = row["np2"], row.get("ng2", row["np2"])
    if not (limit > 0 and partial > 0):
        return limit
    ratio = partial / (1 - partial) / (generalized / (1 - generalized))
    odds = limit / (1 - limit) / ratio
    return float(odds / (1 + odds))
