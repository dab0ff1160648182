"""Writing one session's rows into a collected database."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from operator import itemgetter
from pathlib import Path

from sqlalchemy import Connection, Dialect, Table, delete, insert, select, update

from palpate.studies.collecting import schema
from palpate.studies.sessions.tables import Row, SessionTables

OF_A_SESSION = (
    schema.ledgers, schema.streams, schema.events, schema.anchors, schema.switches, schema.answers, schema.words,
    schema.responses, schema.trials, schema.sessions,
)  # fmt: skip


class CollectError(ValueError):
    """The database cannot be used, or a ledger contradicts what it holds."""


def bring_in(connection: Connection, session: SessionTables, path: Path) -> str:
    """Write the session's rows where they are new, and return what was done: new, updated or unchanged.

    Raises CollectError where the session is not the continuation of the one that the database holds.
    """
    name, head = session.session["session"], session.session["head_hash"]
    held = connection.execute(select(schema.sessions).where(schema.sessions.c.session == name)).one_or_none()
    same = ("file_sha256", "status")
    if held is not None and held.head_hash == head and all(getattr(held, k) == session.session[k] for k in same):
        return "unchanged"
    if held is not None:
        _demand_continuation(connection, session, path)
        for table in OF_A_SESSION:
            connection.execute(delete(table).where(table.c.session == name))
    _insert(connection, session)
    return "new" if held is None else "updated"


def _demand_continuation(connection: Connection, session: SessionTables, path: Path) -> None:
    """A session may only grow: what was collected of it must be how it still begins."""
    name = session.session["session"]
    query = select(schema.events.c.seq, schema.events.c.hash).where(schema.events.c.session == name)
    now = {row["seq"]: row["hash"] for row in session.events}
    for seq, link in connection.execute(query.order_by(schema.events.c.seq)):
        if now.get(seq) != link:
            how = "is cut short" if seq not in now else "is another session, or was changed,"
            raise CollectError(
                f"{path}: session {name} {how} compared with the one collected before (event {seq}); "
                "if it was run anew, collect with --rebuild; labs that share a database need distinct pseudonyms"
            )


def _insert(connection: Connection, session: SessionTables) -> None:
    _insert_missing(connection, session)
    connection.execute(insert(schema.sessions), session.session)
    for table, rows in (
        (schema.trials, session.trials),
        (schema.responses, session.responses),
        (schema.words, session.words),
        (schema.answers, session.answers),
        (schema.switches, session.switches),
        (schema.anchors, session.anchors),
        (schema.events, session.events),
        (schema.streams, session.streams),
    ):
        if rows:
            _insert_rows(connection, table, rows)


def _insert_rows(connection: Connection, table: Table, rows: Sequence[Row]) -> None:
    """Insert rows of the same columns; into SQLite past SQLAlchemy, which would take longer for a row than SQLite."""
    if connection.dialect.name != "sqlite":
        connection.execute(insert(table), rows)
        return
    statement, cells = _statement(table, tuple(rows[0]), connection.dialect)
    connection.exec_driver_sql(statement, [cells(row) for row in rows])


@lru_cache
def _statement(table: Table, names: tuple[str, ...], dialect: Dialect) -> tuple[str, Callable[[Row], object]]:
    """SQL that inserts these columns, and what takes a row's cells in its order."""
    statement = insert(table).values(dict.fromkeys(names)).compile(dialect=dialect)
    return str(statement), itemgetter(*statement.positiontup or names)


def _insert_missing(connection: Connection, session: SessionTables) -> None:
    """The study and the participant, where no earlier session brought them.

    Of one version of a study (its sample may change) the definition of the session that was begun last stands.
    """
    study, who = session.study, session.participant
    mine = schema.studies.c.study_digest == study["study_digest"]
    held = connection.execute(select(schema.studies.c.definition).where(mine)).scalar_one_or_none()
    if held is None:
        connection.execute(insert(schema.studies), study)
    elif held != study["definition"] and _is_latest(connection, session):
        connection.execute(update(schema.studies).where(mine).values(study))
    same = (schema.participants.c.study == who["study"]) & (schema.participants.c.participant == who["participant"])
    if not connection.execute(select(schema.participants.c.row).where(same)).first():
        connection.execute(insert(schema.participants), who)


def _is_latest(connection: Connection, session: SessionTables) -> bool:
    """Whether no session of the same version of the study was begun later, by time and name."""
    row, table = session.session, schema.sessions
    begun = select(table.c.started_at, table.c.session).where(table.c.study_digest == row["study_digest"])
    return all(tuple(other) <= (row["started_at"], row["session"]) for other in connection.execute(begun))
