"""Participants by pseudonym: group, row of the counterbalancing square, and answers about themselves."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import fsum
from typing import Any

from sqlalchemy import select

from palpate.analysis.exporting.session_rows import AGE, OLDEST, SessionRows
from palpate.analysis.exporting.source import Source
from palpate.analysis.exporting.tabular import Column, Row, Table
from palpate.protocols.forms import LabForms, Question
from palpate.studies.collecting import schema
from palpate.studies.lab import SIDECAR
from palpate.studies.participants.sidecar import columns as described_columns
from palpate.studies.participants.sidecar import level_label

FORM = "demographics"
_OWN = ("participant", "group", "counterbalancing_row", "sessions", "simulated")


@dataclass(frozen=True)
class ParticipantTable:
    """The table of participants, with a column for each question that was asked."""

    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    kinds: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """Question -> its column, and whether it asks for a number, a choice or a text."""

    def table(self) -> Table:
        """Return the participants as a shared table."""
        return Table("participants", "One row for each participant, by pseudonym.", self.columns, lambda: self.rows)


def participant_table(source: Source) -> ParticipantTable:
    """Return everybody with a shared session; the last valid answer to each question counts."""
    events = schema.events
    questions: dict[str, Question] = {}
    rows: dict[str, Row] = {}
    for session in source.sessions:
        if FORM in source.study.opening:  # the questions that the session put, by its first event
            query = select(events.c.body).where((events.c.session == session.name) & (events.c.seq == 0))
            forms: Any = json.loads(source.connection.execute(query).scalar_one()).get("lab_forms")
            if forms:
                questions |= {question.name: question for question in LabForms.from_definition(forms).questions}
        of_person: Row = {
            **{"participant": session.participant, "group": session.row["group_name"]},
            **{"counterbalancing_row": session.row["row"], "sessions": 0},
            "simulated": bool(session.row["simulated"]),
        }
        row = rows.setdefault(session.participant, of_person)
        row["sessions"] = int(row["sessions"] or 0) + 1
        for answer in SessionRows(source, session).answers():
            if answer["form"] == FORM and answer["value"] is not None:
                name = _name(str(answer["item"]))
                number = questions.get(str(answer["item"]))
                is_number = number is not None and number.kind == "number"
                row[name] = answer["value_number"] if is_number else answer["value"]
    sidecar = source.lab / SIDECAR
    described = described_columns(sidecar) if sidecar.is_file() else {}
    further = (_column(question, described.get(name, {})) for name, question in questions.items())
    kinds = {name: (_name(name), question.kind) for name, question in questions.items()}
    groups = {
        str(group): ("; ".join(f"{column}: {', '.join(some)}" for column, some in levels.items()) or "all stimuli")
        for group, levels in source.study.groups.items()
    }
    own_columns = (
        Column("participant", "Pseudonym of the participant. Never a name.", key=True),
        Column("group", "Group of the study that the participant was in.", levels=groups),
        Column("counterbalancing_row", "Row of the counterbalancing square, from 0, that ordered the trials.", "whole"),
        Column("sessions", "Sessions of the participant in this data set.", "whole"),
        Column("simulated", "Whether a simulated participant gave the answers, not a person.", "truth"),
    )
    return ParticipantTable((*own_columns, *further), tuple(rows.values()), kinds)


def without_small_groups(people: ParticipantTable, least: int) -> tuple[ParticipantTable, tuple[str, ...]]:
    """Return the people without answers about themselves that fewer than `least` of them share, and notes on changes.

    A choice that fewer made is withheld; if that leaves fewer than `least` without an answer, the next rarest choice is
    withheld too, since the blank would reveal the first. Numbers become means of at least `least` people with similar
    numbers (univariate microaggregation, Defays & Nanopoulos 1993), to one decimal. Answers in words are unchanged.
    """
    rows, columns, measures = [dict(row) for row in people.rows], list(people.columns), []
    for question, (name, kind) in people.kinds.items():
        answered = [row for row in rows if row.get(name) is not None]
        if kind == "choice":
            counts = Counter(str(row[name]) for row in answered)
            withheld = {level for level, number in counts.items() if number < least}
            left = sorted(counts.keys() - withheld, key=lambda level: (counts[level], level))
            while withheld and left and sum(counts[level] for level in withheld) < least:
                withheld.add(left.pop(0))
            for row in answered:
                row[name] = None if str(row[name]) in withheld else row[name]
            if withheld:
                measures.append(f"{question}: answers of fewer than {least} participants are withheld (empty).")
        elif kind == "number" and _average_small_groups(answered, name, least):
            measures.append(f"{question}: each number is the mean of at least {least} participants of like {question}.")
    measure_of = {line.partition(":")[0]: line.partition(": ")[2] for line in measures}
    for place, column in enumerate(columns):
        question = next((item for item, (name, _) in people.kinds.items() if name == column.name), "")
        if question in measure_of:
            columns[place] = replace(column, description=f"{column.description} {measure_of[question].capitalize()}")
    return replace(people, columns=tuple(columns), rows=tuple(rows)), tuple(measures)


def _average_small_groups(answered: list[dict[str, Any]], name: str, least: int) -> bool:
    """Replace numbers by means of small groups, or withhold all if they are too few; return whether any changed."""
    before = [row[name] for row in answered]
    ordered = sorted(answered, key=lambda row: float(row[name]))
    groups = [ordered[first : first + least] for first in range(0, len(ordered), least)]
    if len(groups) > 1 and len(groups[-1]) < least:
        groups[-2:] = [groups[-2] + groups[-1]]
    for group in groups:
        values = [float(row[name]) for row in group]
        for row in group:
            row[name] = None if len(group) < least else round(fsum(values) / len(values), 1)
    return before != [row[name] for row in answered]


def _column(question: Question, described: Mapping[str, Any]) -> Column:
    labels = {value: level_label(label) or value for value, label in described.get("Levels", {}).items()}
    question_text = f"Asked: {question.text}"
    description = f"{described['Description']} {question_text}" if "Description" in described else question_text
    capped = f" {OLDEST} stands for {OLDEST} and above." if question.name == AGE and "above" not in description else ""
    return Column(
        _name(question.name),
        description + capped,
        "number" if question.kind == "number" else "text",
        unit=described.get("Units") or question.unit or ("years" if question.name == AGE else ""),
        levels={value: labels.get(value, label) for value, label in question.levels},
        free_answer=question.kind in ("text", "number"),
    )


def _name(question: str) -> str:
    """Return the column of a question: its name, unless the table already has such a column."""
    return f"answer_{question}" if question in _OWN else question
