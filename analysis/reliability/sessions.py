"""Diagnostics of each session's answers (`palpate.analysis.ratings.diagnostics`), and groups of comparable raters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import pandas as pd

from palpate.analysis.ratings.diagnostics import Answered, diagnose
from palpate.analysis.statistics.cells import ordered

HEAD = ("participant", "session", "sign", "value", "unit", "n", "threshold", "flagged", "note")


def session_signs(ratings: pd.DataFrame, scale: tuple[float, float] | None) -> pd.DataFrame:
    """Return all diagnostics by session: participant, session, sign, value, unit, n, threshold, flagged, note.

    `ratings` has the columns participant, session, trial, stimulus, attribute, value and, where known,
    response_time_s. Without a scale, a session or a trial there are no signs, and the table is empty.
    Raises DiagnosticsError for a value off the scale.
    """
    if scale is None or not {"session", "trial", "stimulus"} <= set(ratings.columns):
        return pd.DataFrame(columns=list(HEAD)).astype({"flagged": bool})
    rows: list[dict[str, object]] = []
    sessions: dict[Any, pd.DataFrame] = dict(iter(ratings.groupby("session", sort=False)))
    for session in ordered(sorted(sessions)):
        own = sessions[session]
        for reading in diagnose(answered_trials(own), *scale):
            sign = {
                "sign": reading.name,
                "value": math.nan if reading.value is None else reading.value,
                "unit": reading.unit,
            }
            threshold = math.nan if reading.threshold is None else reading.threshold
            facts = {"n": reading.n, "threshold": threshold, "flagged": reading.flagged, "note": reading.sentence}
            rows.append({"participant": own["participant"].iloc[0], "session": session, **sign, **facts})
    return pd.DataFrame(rows, columns=list(HEAD))


def compared_within(table: pd.DataFrame, targets: Sequence[str]) -> list[pd.DataFrame]:
    """Return the tables to compare raters in: one per group if no two groups share a target."""
    if "group" not in table.columns or "group" in targets:
        return [table]
    groups = table[["group", *targets]].drop_duplicates()
    if groups["group"].nunique() < 2 or groups.duplicated(list(targets)).any():
        return [table]
    return [rows for _, rows in table.groupby("group", sort=True)]


def answered_trials(own: pd.DataFrame) -> list[Answered]:
    """Return the trials of one session's ratings.

    A trial's time is that of its slowest answer; NaN is a missing answer.
    """
    timed = "response_time_s" in own.columns
    seconds = own["response_time_s"].tolist() if timed else [math.nan] * len(own)
    columns = (own[name].tolist() for name in ("trial", "stimulus", "attribute", "value"))
    values: dict[int, dict[str, float]] = {}
    longest: dict[int, float] = {}
    stimuli: dict[int, str] = {}
    for trial, stimulus, attribute, value, took in zip(*columns, seconds, strict=True):
        number = int(str(trial))
        stimuli.setdefault(number, str(stimulus))
        answers = values.setdefault(number, {})
        if not math.isnan(value):
            answers[attribute] = value
        if not math.isnan(took):
            longest[number] = max(took, longest.get(number, 0.0))
    return [Answered(n, stimuli[n], values[n], longest.get(n)) for n in sorted(stimuli)]
