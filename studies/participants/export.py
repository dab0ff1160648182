"""Writing participants.tsv: who took part, by pseudonym, with what they said about themselves and nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import select

from palpate.studies.participants import schema
from palpate.studies.participants.allocations import every_allocation
from palpate.studies.participants.answers import Answers, demographics
from palpate.studies.participants.errors import ParticipantError
from palpate.studies.participants.people_table import KEY, TABLE, Row, bids_id, drop_row, read_table, write_table
from palpate.studies.participants.questions import question
from palpate.studies.participants.registry import Registry, reading
from palpate.studies.participants.sidecar import columns, sidecar_file

STUDIES = "studies"
_OLDEST = 89
"""BIDS recommends this for all ages from here on: the oldest are few enough to be known by their age."""


@dataclass(frozen=True)
class Exported:
    """What was written, and what was left out and why."""

    file: Path
    participants: tuple[str, ...]
    withdrawn: tuple[str, ...]
    simulated: tuple[str, ...]
    refused: tuple[str, ...]


def export(registry: Registry, with_simulated: bool = False) -> Exported:
    """Write LAB/participants.tsv: a row for everybody in the registry or in a session here who has not withdrawn.

    An answer in a ledger overrules what stands in the table; what no ledger answers is kept as it stands.
    Raises ParticipantError on a participants.json or a table that cannot be used, or an answer that is none.
    """
    lab = registry.lab
    sidecar = sidecar_file(lab)
    described = columns(sidecar)
    before = read_table(lab / TABLE, list(described))
    answers = demographics(lab, with_simulated)
    status = _people(registry)
    gone = {who for who, state in status.items() if state == "withdrawn"}
    everybody = sorted((set(status) | set(answers.given)) - gone)
    studies = _studies(registry, answers)
    rows = []
    for who in everybody:
        asked = {name: _checked(sidecar, described, name, *said) for name, said in answers.given.get(who, {}).items()
                 if name in described}  # fmt: skip
        rows.append(_row(who, before.get(bids_id(who), {}), asked, studies.get(who, set())))
    write_table(lab / TABLE, list(described), rows)
    return Exported(
        lab / TABLE, tuple(everybody), tuple(sorted(gone)), tuple(answers.simulated), tuple(answers.refused)
    )


def forget(lab: Path, participant: str) -> bool:
    """Take a participant out of LAB/participants.tsv; returns whether they were in it."""
    return drop_row(lab / TABLE, participant)


def _row(who: str, before: Row, asked: Row, studies: set[str]) -> Row:
    return {**before, **asked, KEY: bids_id(who), STUDIES: ";".join(sorted(studies))}


def _people(registry: Registry) -> dict[str, str]:
    people = schema.participants
    with reading(registry) as connection:
        return {
            row.participant: row.status for row in connection.execute(select(people.c.participant, people.c.status))
        }


def _studies(registry: Registry, answers: Answers) -> dict[str, set[str]]:
    """Participant -> studies, by rows held and by sessions."""
    found = {who: set(studies) for who, studies in answers.studies.items()}
    for each in every_allocation(registry):
        if each.holds:
            found.setdefault(each.participant, set()).add(each.study)
    return found


def _checked(file: Path, described: Mapping[str, Any], name: str, value: Any, session: str) -> str:
    """An answer as a cell. Raises ParticipantError where participants.json no longer knows it."""
    problem = question(f"{file}: {name}", name, {"Question": name, **described[name]}).problem(value)
    if problem is not None:
        raise ParticipantError(f"{session}: {problem}; {file} must describe every answer that was given")
    return _told(name, value)


def _told(name: str, value: Any) -> str:
    if type(value) not in (int, float):
        return str(value)
    number = min(value, _OLDEST) if name == "age" else value
    return str(int(number)) if number == int(number) else repr(number)
