"""Answers of participants about themselves as columns of a table: closed questions only, never free text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from palpate.analysis.ratings.dataset import DataRefused, DeclarationRefused
from palpate.studies.sessions.tables import session_number

SESSION = "session"
ANSWER = "answer."
"""The optional prefix of a question's name, required if a column of the stimuli has the same name."""
CLOSED = ("number", "choice", "points")
"""Kinds of answers that may be columns: numbers and choices, and items of a questionnaire."""


@dataclass(frozen=True)
class People:
    """The answers: question or item -> participant -> last answer as text; `free` are questions answered in words."""

    answers: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    free: frozenset[str] = frozenset()

    def named(self, table: pd.DataFrame, names: Iterable[str]) -> list[str]:
        """Return which of the names are answered questions that the table has no column for.

        Raises DataRefused on a question that was answered in the participant's own words.
        """
        new = [name for name in names if name not in table.columns]
        for name in new:
            if question_of(name) in self.free and question_of(name) not in self.answers:
                raise DeclarationRefused(
                    f"{name!r} was answered in the participants' own words, which no test may group by"
                )
        return [name for name in dict.fromkeys(new) if question_of(name) in self.answers]

    def added(self, table: pd.DataFrame, names: Sequence[str]) -> pd.DataFrame:
        """Return the table with the answers as columns, and `session` as its number if it is among the names.

        A missing answer is NaN.
        """
        whose = table["participant"].astype(str)
        columns: dict[str, Any] = {
            name: whose.map(self.answers[question_of(name)]) for name in self.named(table, names)
        }
        if SESSION in names and SESSION in table.columns:
            columns[SESSION] = table[SESSION].astype(str).map(session_number)
        return table.assign(**columns) if columns else table


def question_of(name: str) -> str:
    """Return the question of a column named after it: `age` or `answer.age`."""
    return name.removeprefix(ANSWER)


def people_of(rows: Sequence[Mapping[str, Any]]) -> People:
    """Return the answers of forms (session, participant, item, kind, value, number); a later session's count."""
    answers: dict[str, dict[str, str]] = {}
    free = set()
    for row in sorted(rows, key=lambda row: int(session_number(row["session"]))):
        if row["kind"] == "text":
            free.add(row["item"])
        elif row["kind"] in CLOSED and row["value"] != "null":
            level = row["value"] if row["number"] is None else f"{row['number']:.15g}"
            answers.setdefault(row["item"], {})[row["participant"]] = level
    return People(answers, frozenset(free))


def refuse_small_groups(table: pd.DataFrame, names: Sequence[str], least: int, whose: str) -> None:
    """Raise DataRefused if fewer than `least` participants gave the same combination of answers to the questions.

    So few people could be recognised in a shared table.
    """
    people = table[["participant", *names]].drop_duplicates()
    sizes = people.groupby(list(names), sort=True).size()
    small = sizes[sizes < least]
    if not len(small):
        return
    levels = small.index[0] if isinstance(small.index[0], tuple) else (small.index[0],)
    answers = ", ".join(f"{name} {level}" for name, level in zip(names, levels, strict=True))
    raise DataRefused(
        f"{whose!r}: {int(small.iloc[0])} of the participants have {answers}, and fewer than {least} could be"
        " recognised: leave them out with `where`, or ask for it with `least_people: 1` in the plan"
    )
