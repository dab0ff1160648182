"""The shared data: one version of a study and its sessions, in a collected database."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Protocol

from sqlalchemy import Connection, select
from sqlalchemy.exc import SQLAlchemyError

from palpate.analysis.exporting.tabular import ExportRefused
from palpate.analysis.ratings.dataset import natural_key
from palpate.analysis.ratings.session_choice import SessionRow, choose_sessions
from palpate.analysis.ratings.sources import IMPORTED, DataRequest
from palpate.protocols.canonical import parse
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.study import Study
from palpate.studies.collecting import schema
from palpate.studies.collecting.collect import fill, open_database, scratch_database
from palpate.studies.messages import database_reason, describe_url
from palpate.studies.participants.registry import find_registry, withdrawn
from palpate.studies.sessions.session_files import in_person, ledgers_in
from palpate.studies.sessions.tables import session_number

_CHOICE_COLUMNS = tuple(column.name for column in fields(SessionRow))


class Watch(Protocol):
    """A function that passes items through one by one, and may show progress."""

    def __call__(self, items: Iterable[Any], doing: str, total: int | None = None, /) -> Iterable[Any]: ...


def no_progress(items: Iterable[Any], _doing: str, _total: int | None = None, /) -> Iterable[Any]:
    """Return the items without showing progress."""
    return items


@dataclass(frozen=True)
class SharedSession:
    """A shared session: the row of the table `sessions`, and its number among the participant's."""

    name: str
    participant: str
    number: int
    row: dict[str, Any]


@dataclass(frozen=True)
class Source:
    """A study as it was run, the sessions that are shared, the others with the reason, and where rows are."""

    lab: Path
    study: Study
    definition: dict[str, Any]
    digest: str
    sessions: tuple[SharedSession, ...]
    left_out: tuple[tuple[SessionRow, str], ...]
    simulated: bool
    connection: Connection

    @property
    def of_people(self) -> bool:
        """Whether a real person took part in any of the sessions; devices may have been simulated."""
        events = schema.events
        first = select(events.c.body).where(
            events.c.seq == 0, events.c.session.in_([session.name for session in self.sessions])
        )
        return any(in_person(json.loads(body)) for body in self.connection.execute(first).scalars())

    @property
    def participants(self) -> tuple[str, ...]:
        """The pseudonyms in natural order."""
        return tuple(dict.fromkeys(session.participant for session in self.sessions))

    def of(self, session: SharedSession, table: Any, *order: str) -> list[dict[str, Any]]:
        """Return the session's rows of a collected table."""
        query = select(table).where(table.c.session == session.name).order_by(*(table.c[name] for name in order))
        return [dict(row) for row in self.connection.execute(query).mappings()]


@contextmanager
def open_source(request: DataRequest, watch: Watch = no_progress) -> Iterator[Source]:
    """Yield the requested study and sessions; session files are first collected into a temporary database.

    Sessions of people who withdrew, declined or were not eligible are left out. Raises ExportRefused or DataRefused
    where there are none, and LedgerError or CollectError on an unusable file or database.
    """
    engine = scratch_database() if request.url is None else open_database(request.url, lab=request.lab)
    try:
        if request.url is None:
            paths = ledgers_in(request.lab, request.name)
            if not paths:
                raise ExportRefused(_no_sessions_message(request))
            with closing(fill(engine, paths)) as reading:
                for _ in watch(reading, "reading", len(paths)):
                    pass
        with engine.connect() as connection:
            yield _source(request, connection)
    finally:
        engine.dispose()


def _no_sessions_message(request: DataRequest) -> str:
    if (request.lab / IMPORTED / request.name).is_dir():
        return (
            f"{request.name!r} was imported, not recorded here: share {request.lab / IMPORTED / request.name} as it is,"
            " by the licence of its source"
        )
    known = sorted({path.name.rsplit("_", 2)[0] for path in ledgers_in(request.lab)})
    if not known:
        return f"{request.lab}: no sessions; run one first, or name the lab with --lab or its database with --database"
    return f"{request.lab}: no sessions of a study {request.name!r}; {nearest(request.name, known)}"


def _source(request: DataRequest, connection: Connection) -> Source:
    rows = {row["session"]: row for row in _sessions(connection, request)}
    rows_of_choice = [SessionRow(**{name: row[name] for name in _CHOICE_COLUMNS}) for row in rows.values()]
    # Only the lab knows of withdrawals since a database was collected, so one of real people is refused without its
    # lab.
    real = not all(session.simulated for session in rows_of_choice)
    if request.url is not None and real and find_registry(request.lab) is None:
        raise ExportRefused(
            f"{request.lab}: holds no registry of participants, which says who withdrew since the database was"
            " collected; name the lab with --lab"
        )
    choice = choose_sessions(
        rows_of_choice,
        request.name,
        request.digest,
        request.include_incomplete,
        request.simulated,
        withdrawn(request.lab),
    )
    sessions: list[SharedSession] = []
    for session in choice.sessions:
        row = rows[session.session]
        number = session_number(row["session"])
        if not (row["participant"].isascii() and row["participant"].isalnum() and number.isdecimal()):
            raise ExportRefused(
                f"session {row['session']!r}: STUDY/PSEUDONYM/NUMBER is expected, as door_ratings/P001/1"
            )
        sessions.append(SharedSession(row["session"], row["participant"], int(number), row))
    table = schema.studies
    text = connection.execute(select(table.c.definition).where(table.c.study_digest == choice.digest)).scalar_one()
    definition: dict[str, Any] = parse(text.encode())
    return Source(
        lab=request.lab,
        study=Study.model_validate(definition),
        definition=definition,
        digest=choice.digest,
        sessions=tuple(sorted(sessions, key=lambda session: (natural_key(session.participant), session.number))),
        left_out=choice.left_out,
        simulated=any(row.simulated for row in choice.sessions),
        connection=connection,
    )


def _sessions(connection: Connection, request: DataRequest) -> list[dict[str, Any]]:
    table = schema.sessions
    query = select(table).where(table.c.study == request.name).order_by(table.c.participant, table.c.session)
    try:
        rows = [dict(row) for row in connection.execute(query).mappings()]
        if rows:
            return rows
        known = sorted(connection.execute(select(table.c.study).distinct()).scalars())
    except SQLAlchemyError as error:
        raise ExportRefused(
            f"{describe_url(connection.engine.url)}: not a collected database ({database_reason(error)})"
        ) from None
    raise ExportRefused(f"no session of study {request.name!r} is collected; {nearest(request.name, known)}")
