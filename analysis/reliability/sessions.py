"""The signs of how each session was answered (`analysis.ratings.diagnostics`), and who is compared with whom."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import pandas as pd

from analysis.ratings.diagnostics import Answered, diagnose
from analysis.statistics.labels import ordered

HEAD = ("participant", "session", "sign", "value", "unit", "n", "threshold", "flagged", "note")


def session_signs(ratings: pd.DataFrame, scale: tuple[float, float] | None) -> pd.DataFrame:
    """Every sign of every session: columns participant, session, sign, value, unit, n, threshold, flagged, note.

    `ratings` has the columns participant, session, trial, stimulus, attribute, value and, where known,
    response_time_s. Without a scale, a session or a trial there are no signs, and the table is empty.
    Raises DiagnosticsError for a value off the scale.
    """
    if scale is None or not {"session", "trial", "stimulus"} <= set(ratings.columns):
        return pd.DataFrame(columns=list(HEAD)).astype({"flagged": bool})
    rows: list[dict[str, object]] = []
    for session in ordered(sorted(set(ratings["session"].tolist()))):
        own = ratings[ratings["session"] == session]
        for each in diagnose(_trials(own), *scale):
            sign = {"sign": each.name, "value": math.nan if each.value is None else each.value, "unit": each.unit}
            threshold = math.nan if each.threshold is None else each.threshold
            told = {"n": each.n, "threshold": threshold, "flagged": each.flagged, "note": each.sentence}
            rows.append({"participant": own["participant"].iloc[0], "session": session, **sign, **told})
    return pd.DataFrame(rows, columns=list(HEAD))


def compared_within(table: pd.DataFrame, targets: Sequence[str]) -> list[pd.DataFrame]:
    """Who is compared with whom: the participants of each group, where no two groups share a target."""
    if "group" not in table.columns:
        return [table]
    groups = table[["group", *targets]].drop_duplicates()
    if groups["group"].nunique() < 2 or groups.duplicated(list(targets)).any():
        return [table]
    return [rows for _, rows in table.groupby("group", sort=True)]


def _trials(own: pd.DataFrame) -> Iterator[Answered]:
    """A trial is as long as its slowest answer; a rating without a value is not given."""
    for trial, rows in own.groupby("trial", sort=True):
        given = rows[rows["value"].notna()]
        values = dict(zip(given["attribute"].tolist(), given["value"].tolist(), strict=True))
        seconds = rows["response_time_s"].max() if "response_time_s" in rows.columns else math.nan
        yield Answered(
            int(str(trial)), str(rows["stimulus"].iloc[0]), values, None if pd.isna(seconds) else float(seconds)
        )
