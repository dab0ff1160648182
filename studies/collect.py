"""Gathering ledgers into one database: idempotent, and always free to be dropped and rebuilt."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import URL, Connection, Engine, create_engine, delete, insert, inspect, make_url, select
from sqlalchemy.exc import ArgumentError, SQLAlchemyError

from studies import collected_schema as schema
from studies.ledger_schema import APPLICATION_ID
from studies.participants.schema import metadata as registry
from studies.record import read
from studies.tables import SessionTables, tables

LOCK = 0x50414C43
"""Key of the PostgreSQL advisory lock that lets stations collect into one database one after another."""
OF_A_SESSION = (
    schema.streams, schema.events, schema.switches, schema.answers, schema.words, schema.responses, schema.trials,
    schema.sessions,
)  # fmt: skip


class CollectError(ValueError):
    """The database cannot be used, or a ledger contradicts what it holds."""


@dataclass(frozen=True)
class Collected:
    """What became of one ledger."""

    path: Path
    session: str
    what: str
    trials_answered: int


def ledgers_in(lab: Path, study: str | None = None) -> list[Path]:
    """The lab's ledgers, by name; those of one study if it is given."""
    wanted = re.compile(rf"{re.escape(study) if study else '[^.].*'}_[A-Za-z0-9]+_s[0-9]+\.sqlite")
    return sorted(path for path in (lab / "sessions").glob("*.sqlite") if wanted.fullmatch(path.name))


def others_in(lab: Path) -> list[Path]:
    """SQLite files among the lab's sessions that are not named as a session: copies, for instance."""
    named = set(ledgers_in(lab))
    return sorted(path for path in (lab / "sessions").glob("*.sqlite") if path not in named and path.name[0] != ".")


def open_database(url: str | URL, rebuild: bool = False) -> Engine:
    """A database for collecting, its tables made where missing; to `rebuild` drops them first, and nothing else.

    Raises CollectError on a URL that cannot be used, a database of another version, or one that holds other tables.
    """
    try:
        target = make_url(url)
        engine = create_engine(target, connect_args={"timeout": 60} if target.drivername.startswith("sqlite") else {})
        with engine.begin() as connection:
            _wait_for_others(connection)
            _demand_ours(connection)
            if rebuild:
                schema.drop_all(connection)
            _demand_version(connection)
    except CollectError as error:
        engine.dispose()
        raise CollectError(f"{_without_password(str(url))}: {error}") from None
    except (SQLAlchemyError, ModuleNotFoundError) as error:
        reason = "not a database URL" if isinstance(error, ArgumentError) else str(getattr(error, "orig", error))
        raise CollectError(f"{_without_password(str(url))}: {reason.strip() or type(error).__name__}") from None
    return engine


def collect(paths: Iterable[Path], engine: Engine, withdrawn: Collection[str] = ()) -> Iterator[Collected]:
    """Bring each ledger's session into the database, one transaction each; again is as good as once.

    Sessions of the pseudonyms in `withdrawn` are marked, so that no analysis holds them.

    Raises LedgerError on a refused ledger, CollectError on one that contradicts the database.
    """
    for path in paths:
        record = read(path)
        session = tables(record, record.header["participant"] in withdrawn)
        try:
            with engine.begin() as connection:
                _wait_for_others(connection)
                what = _bring(connection, session, path)
        except SQLAlchemyError as error:
            raise CollectError(
                f"{path}: could not be brought in ({getattr(error, 'orig', error)}); try again"
            ) from None
        yield Collected(path, session.session["session"], what, session.session["trials_answered"])


def _bring(connection: Connection, session: SessionTables, path: Path) -> str:
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
        (schema.events, session.events),
        (schema.streams, session.streams),
    ):
        if rows:
            connection.execute(insert(table), rows)


def _insert_missing(connection: Connection, session: SessionTables) -> None:
    """The study and the participant, where no earlier session brought them."""
    study, who = session.study, session.participant
    if not connection.execute(
        select(schema.studies.c.study).where(schema.studies.c.study_digest == study["study_digest"])
    ).first():
        connection.execute(insert(schema.studies), study)
    same = (schema.participants.c.study == who["study"]) & (schema.participants.c.participant == who["participant"])
    if not connection.execute(select(schema.participants.c.row).where(same)).first():
        connection.execute(insert(schema.participants), who)


def _wait_for_others(connection: Connection) -> None:
    """Two stations that make a table, or bring the same study, at once would each find it missing."""
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({LOCK})")


def _demand_version(connection: Connection) -> None:
    """Make what is missing; what is there must be of this version."""
    schema.palpate.create(connection, checkfirst=True)
    found = connection.execute(select(schema.palpate.c.version)).scalar_one_or_none()
    if found is None:
        connection.execute(insert(schema.palpate), {"version": schema.VERSION})
    elif found != schema.VERSION:
        raise CollectError(
            f"the database was collected in version {found}, this Palpate writes {schema.VERSION}: collect --rebuild"
        )
    schema.create_all(connection)


def _demand_ours(connection: Connection) -> None:
    """Raise CollectError unless the database is empty or holds the table `palpate`, the mark of a collected database.

    In PostgreSQL a lab's registry may lie beside it. A table under one of our names must have our key columns.
    """
    sqlite = connection.dialect.name == "sqlite"
    if sqlite and connection.exec_driver_sql("PRAGMA application_id").scalar_one() == APPLICATION_ID:
        raise CollectError("this file is a session's ledger; collect into a database of its own")
    inspector = inspect(connection)
    names = {*inspector.get_table_names(), *inspector.get_view_names()} - (set() if sqlite else set(registry.tables))
    columns = {
        name: {str(column["name"]) for column in inspector.get_columns(name)}
        for name in names.intersection(schema.metadata.tables)
    }
    if names and columns.get(schema.palpate.name) != {"version"}:
        raise CollectError(
            f"holds the table {min(names)}, and no mark that palpate collect made it; nothing was changed. Collect "
            "into a new database" + ("" if sqlite else ", or a schema of its own: add ?options=-csearch_path%3DSCHEMA")
        )
    for name, present in sorted(columns.items()):
        if missing := {column.name for column in schema.metadata.tables[name].primary_key} - present:
            raise CollectError(
                f"its table {name} has no column {min(missing)}: palpate collect did not make it; nothing was changed. "
                "Rename that table, or collect into a new database"
            )


def _without_password(url: str) -> str:
    head, at, tail = url.rpartition("@")
    return f"{head.split('://')[0]}://...{at}{tail}" if at else url
