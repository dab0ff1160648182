"""participants.tsv: one row per participant in BIDS form, from the answers about themselves in ledgers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sqlalchemy import select

from palpate.protocols.files import write_text
from palpate.protocols.wording import some
from palpate.studies.lab import ParticipantError
from palpate.studies.participants import schema
from palpate.studies.participants.allocations import every_allocation
from palpate.studies.participants.registry import Registry, reading
from palpate.studies.participants.sidecar import columns, identifying, question, sidecar_file
from palpate.studies.sessions.record import LedgerError, read
from palpate.studies.sessions.session_files import ledgers_in

STUDIES = "studies"
_OLDEST = 89
"""The age from which BIDS recommends one common value: people of such an age are few enough to be recognised."""
TABLE = "participants.tsv"
KEY = "participant_id"
MISSING = "n/a"
Row = dict[str, str]
FORM = "demographics"


@dataclass(frozen=True)
class Exported:
    """The outcome of an export: what was written, and what was left out and why."""

    file: Path
    participants: tuple[str, ...]
    withdrawn: tuple[str, ...]
    simulated: tuple[str, ...]
    refused: tuple[str, ...]


def export(registry: Registry, with_simulated: bool = False) -> Exported:
    """Write LAB/participants.tsv: a row for everybody in the registry or in a session here who has not withdrawn.

    An answer in a ledger replaces the table's; cells without an answer in a ledger are kept. Raises ParticipantError on
    a participants.json or a table that cannot be used, or an answer that is not valid.
    """
    lab = registry.lab
    sidecar = sidecar_file(lab)
    described = columns(sidecar)
    before = read_table(lab / TABLE, list(described))
    answers = demographics(lab, with_simulated)
    people = schema.participants
    with reading(registry) as connection:
        rows_of_people = connection.execute(select(people.c.participant, people.c.status))
        status = {row.participant: row.status for row in rows_of_people}
    gone = {who for who, state in status.items() if state == "withdrawn"}
    everybody = sorted((set(status) | set(answers.given)) - gone)
    # participant -> studies, by rows held and by sessions
    studies = {who: set(studies) for who, studies in answers.studies.items()}
    for allocation in every_allocation(registry):
        if allocation.holds:
            studies.setdefault(allocation.participant, set()).add(allocation.study)
    rows = []
    for who in everybody:
        given = answers.given.get(who, {}).items()
        checked = {name: _checked(sidecar, described, name, *answer) for name, answer in given if name in described}
        taken_part = ";".join(sorted(studies.get(who, set())))
        rows.append({**before.get(bids_id(who), {}), **checked, KEY: bids_id(who), STUDIES: taken_part})
    write_table(lab / TABLE, list(described), rows)
    return Exported(
        lab / TABLE, tuple(everybody), tuple(sorted(gone)), tuple(answers.simulated), tuple(answers.refused)
    )


def forget(lab: Path, participant: str) -> bool:
    """Remove a participant from LAB/participants.tsv; return whether they were in it."""
    return drop_row(lab / TABLE, participant)


def _checked(file: Path, described: Mapping[str, Any], name: str, value: Any, session: str) -> str:
    """Return an answer as a cell. Raises ParticipantError where participants.json does not allow it."""
    problem = question(f"{file}: {name}", name, {"Question": name, **described[name]}).problem(value)
    if problem is not None:
        raise ParticipantError(f"{session}: {problem}; {file} must describe every answer that was given")
    if type(value) not in (int, float):
        return str(value)
    number = min(value, _OLDEST) if name == "age" else value
    return str(int(number)) if number == int(number) else repr(number)


def bids_id(participant: str) -> str:
    """Return the BIDS name of a participant: sub-P001 for P001."""
    return f"sub-{participant}"


def read_table(file: Path, known: Sequence[str]) -> dict[str, Row]:
    """Return the rows by participant_id; none where there is no file.

    Raises ParticipantError on a column that participants.json (`known`) does not describe, an uneven row, a participant
    who occurs twice.
    """
    if not file.is_file():
        return {}
    try:
        lines = file.read_text("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise ParticipantError(f"{file}: byte {error.start} is not UTF-8; save the table as UTF-8") from None
    header = lines[0].split("\t") if lines else [KEY]
    if header[0] != KEY or len(set(header)) != len(header):
        raise ParticipantError(f"{file}: line 1: {KEY} first, and no column twice, is expected; found {some(header)}")
    for name in header:
        if word := identifying(name):
            raise ParticipantError(f"{file}: line 1: a column about {word!r} would identify a person; take it out")
        if name not in known:
            raise ParticipantError(
                f"{file}: line 1: column {name!r} is not described in participants.json; add it there"
            )
    rows: dict[str, Row] = {}
    for number, line in enumerate(lines[1:], start=2):
        if line:
            cells = line.split("\t")
            if len(cells) != len(header):
                raise ParticipantError(
                    f"{file}: line {number}: {len(cells)} cells, {len(header)} columns are expected (divided by tabs)"
                )
            row = dict(zip(header, cells, strict=True))
            if row[KEY] in rows:
                raise ParticipantError(
                    f"{file}: line {number}: {row[KEY]} appears there twice; one row each is expected"
                )
            rows[row[KEY]] = row
    return rows


def write_table(file: Path, columns: Sequence[str], rows: Iterable[Mapping[str, str]]) -> None:
    """Write a table in place of the file, atomically; a missing cell becomes n/a."""
    lines = [
        "\t".join(columns),
        *("\t".join(" ".join((row.get(name) or "").split()) or MISSING for name in columns) for row in rows),
    ]
    write_text(file, "\n".join(lines) + "\n")


def drop_row(file: Path, participant: str) -> bool:
    """Remove a participant's row from a table, whatever its columns; return whether there was one."""
    if not file.is_file():
        return False
    lines = file.read_text("utf-8-sig", errors="surrogateescape").splitlines(keepends=True)
    left = [line for line in lines if line.rstrip("\r\n").split("\t")[0] != bids_id(participant)]
    if len(left) == len(lines):
        return False
    write_text(file, "".join(left), errors="surrogateescape")
    return True


@dataclass(frozen=True)
class Answers:
    """Answers of participants about themselves.

    `given`: participant -> question -> (the last valid answer, its session). `simulated` and `refused` name the
    sessions that were left out; `studies`: participant -> studies taken part in.
    """

    given: dict[str, dict[str, tuple[Any, str]]] = field(default_factory=dict)
    studies: dict[str, set[str]] = field(default_factory=dict)
    simulated: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)


def demographics(lab: Path, with_simulated: bool = False) -> Answers:
    """Return the answers of participants about themselves in the lab's sessions; the latest session counts.

    Simulated sessions are left out unless `with_simulated`.
    """
    answers = Answers()
    records = []
    for path in ledgers_in(lab):
        try:
            records.append(read(path))
        except LedgerError as error:
            answers.refused.append(str(error))
    for record in sorted(records, key=lambda record: (record.run_notes[0].value["at"], record.path.name)):
        if record.header["rig"]["kind"] == "simulated" and not with_simulated:
            answers.simulated.append(record.path.name)
            continue
        who = record.header["participant"]
        answers.studies.setdefault(who, set()).add(record.header["study"]["study"])
        given = answers.given.setdefault(who, {})
        for answer in record.state.answers:
            if answer.form == FORM:
                given |= {name: (value, record.path.name) for name, value in answer.values.items() if value is not None}
    return answers
