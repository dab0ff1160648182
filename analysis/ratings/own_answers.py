"""Answers in a table that a form brings of its own: which rows count, and what is added to them.

Such a table (`OwnTable` in protocols/forms.py) is collected as its form declares it, like `choices`, `rankings` and
`fields`, or one of an extension.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from sqlalchemy import Connection, inspect, text

from palpate.analysis.ratings.dataset import Exclusion
from palpate.analysis.ratings.session_choice import query
from palpate.protocols.forms import own_tables, tables_with
from palpate.protocols.tasks import TASKS

if TYPE_CHECKING:
    from palpate.analysis.ratings.session_choice import Choice
    from palpate.protocols.forms import OwnTable
    from palpate.protocols.study import Study

TIMES = ("rt_s", "response_time_s")
"""The columns of an own table that hold the time of an answer, for rules on fast and slow trials."""


def tables_of_study(study: Study) -> tuple[OwnTable, ...]:
    """Return the tables that the form of the study's trials brings, the one with its answers first; () for none."""
    return tables_with(TASKS[study.task].answers)


def read_own_answers(connection: Connection, study: Study, choice: Choice) -> dict[str, list[dict[str, Any]]]:
    """Return the rows of the sessions that count in each own table that has any, with group."""
    sessions = {session.session: session for session in choice.sessions}
    rows = {name: _rows_of(connection, name, study.study) for name in own_tables()}
    own = {
        name: [
            {
                **row,
                "participant": sessions[row["session"]].participant,
                "group": sessions[row["session"]].group_name or "",
                "session_number": sessions[row["session"]].number,
            }
            for row in of_table
            if row["session"] in sessions
        ]
        for name, of_table in rows.items()
    }
    return {name: of_table for name, of_table in own.items() if of_table}


def _rows_of(connection: Connection, table: str, study: str) -> list[dict[str, Any]]:
    """Return a study's rows of an own table; [] where the database has no such table."""
    if not inspect(connection).has_table(table):
        return []
    name = connection.dialect.identifier_preparer.quote(table)
    joined = f"SELECT own.* FROM {name} AS own JOIN sessions ON sessions.session = own.session"
    return list(query(connection, text(f"{joined} WHERE sessions.study = :study"), study))


def counted_answers(
    rows: Sequence[Mapping[str, Any]], own: OwnTable, trials: pd.DataFrame, stimuli: pd.DataFrame
) -> pd.DataFrame:
    """Return the rows that count, without practice, typed as their table declares; an empty table if there is none.

    Numbers and truths (0 or 1) are float64, NaN where there is none. Added are the stimulus of the trial (`trials`),
    unless the table has a stimulus of its own, and the columns of the stimulus (`stimuli`) whose names are not taken.
    """
    counted = [row for row in rows if row["counts"] and not row["practice"]]
    if not counted:
        return pd.DataFrame()
    table = pd.DataFrame(counted).drop(columns=["counts", "practice"])
    for column in own.columns:
        if column.name in table.columns and column.kind != "text":
            numbers = [np.nan if value is None else float(value) for value in table[column.name]]
            whole = column.kind == "whole" and not np.isnan(numbers).any()
            table[column.name] = pd.Series(numbers, dtype="float64").astype("int64" if whole else "float64")
    if "stimulus" not in table.columns:
        table = table.merge(trials[["session", "trial", "stimulus"]], on=["session", "trial"], how="left")
    new = [name for name in stimuli.columns if name not in table.columns]
    table = table.merge(stimuli[["stimulus", *new]], on="stimulus", how="left") if new else table
    return table.sort_values(["participant", "session", "trial"], kind="stable", ignore_index=True)


def practice_lines(rows: Sequence[Mapping[str, Any]]) -> list[Exclusion]:
    """Return a line for each session with practice among these rows of an own table, with how many of them it has."""
    practice = [row for row in rows if row["counts"] and row["practice"]]
    return lines_of("practice", practice, "practice trials do not count")


def lines_of(what: str, rows: Sequence[Mapping[str, Any]], why: str) -> list[Exclusion]:
    """Return a line for each session with any of these rows, with how many of them it has."""
    counted = Counter((row["participant"], row["session"]) for row in rows)
    return [Exclusion(what, f"{who}, session {session}", why, n) for (who, session), n in sorted(counted.items())]
