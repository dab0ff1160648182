"""Gather ledgers into one database, session by session: repeatable, and the database can be dropped and rebuilt."""

from __future__ import annotations

import shlex
import sqlite3
from collections import Counter
from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, fields
from functools import cached_property, lru_cache, partial
from operator import itemgetter
from pathlib import Path
from typing import Any

from sqlalchemy import (
    URL,
    Connection,
    Dialect,
    Engine,
    StaticPool,
    Table,
    create_engine,
    delete,
    insert,
    inspect,
    make_url,
    select,
    update,
)
from sqlalchemy.exc import OperationalError, SQLAlchemyError

from palpate.protocols.extensions import finder
from palpate.studies.collecting import schema
from palpate.studies.messages import database_reason, describe_url
from palpate.studies.participants.schema import metadata as registry
from palpate.studies.sessions.ledger_schema import APPLICATION_ID
from palpate.studies.sessions.ledger_state import FileState, file_state, last_hash
from palpate.studies.sessions.record import LedgerError, read
from palpate.studies.sessions.tables import Row, SessionTables, tables
from palpate.studies.workers import map_in_order, workers_for

DATABASE = "lab.sqlite"
LOCK = 0x50414C43
"""Key of the PostgreSQL advisory lock that lets stations collect into one database one after another."""
_KNOWN = select(
    *(schema.sessions.c[name] for name in ("session", "file", "participant", "status", "trials_answered", "head_hash")),
    *(schema.ledgers.c[column.name] for column in fields(FileState)),
).join(schema.ledgers, schema.ledgers.c.session == schema.sessions.c.session)


@dataclass(frozen=True)
class Collected:
    """The outcome of collecting one ledger."""

    path: Path
    session: str
    what: str
    trials_answered: int


@dataclass(frozen=True)
class Refused:
    """A ledger that cannot be trusted, or contradicts the database, and why."""

    path: Path
    problem: str


def open_database(url: str | URL, rebuild: bool = False, lab: Path | None = None) -> Engine:
    """Open a database to collect into, and create its missing tables; `rebuild` drops them first, and nothing else.

    `lab` is the folder that a message about rebuilding it names.

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
            _demand_version(connection, lab)
    except CollectError as error:
        engine.dispose()
        raise CollectError(f"{describe_url(url)}: {error}") from None
    except (SQLAlchemyError, ModuleNotFoundError, ValueError) as error:
        raise CollectError(f"{describe_url(url)}: {database_reason(error, url)}") from None
    return engine


def collect(
    paths: Iterable[Path], engine: Engine, withdrawn: Collection[str] = (), verify: bool = False
) -> Iterator[Collected]:
    """Collect each ledger's session into the database, one transaction each; a repeated call changes nothing.

    Raises as `Collector.bring` does.
    """
    collector = Collector(engine, withdrawn, verify)
    return map(collector.bring, paths)


def scratch_database(cache_MB: int = 64) -> Engine:
    """Return an empty database for one run: in memory, and beyond `cache_MB` in a nameless temporary file."""

    def connect() -> sqlite3.Connection:
        connection = sqlite3.connect("")
        connection.execute(f"PRAGMA cache_size = -{1000 * cache_MB}")
        connection.execute("PRAGMA synchronous = OFF")
        return connection

    engine = create_engine("sqlite://", creator=connect, poolclass=StaticPool)
    with engine.begin() as connection:
        _demand_version(connection)
    return engine


def fill(
    engine: Engine, paths: Sequence[Path], withdrawn: Collection[str] = (), with_events: bool = True,
    workers: int | None = None,
) -> Generator[Path]:  # fmt: skip
    """Read these ledgers, every chain verified, into an empty database; yield each path once its session is in.

    Where there are many, several processes read. Raises as `Collector.bring` does.
    """
    reading = partial(_read_tables, withdrawn=frozenset(withdrawn), with_events=with_events)
    sessions = map_in_order(reading, paths, workers_for(len(paths), workers))
    with closing(sessions), engine.begin() as connection:
        for path, session in zip(paths, sessions, strict=True):
            try:
                bring_in(connection, session, path)
            except SQLAlchemyError as error:
                raise CollectError(f"{path}: could not be brought in ({database_reason(error)})") from None
            yield path


def _read_tables(path: Path, withdrawn: Collection[str], with_events: bool) -> SessionTables:
    record = read(path)
    return tables(record, record.header["participant"] in withdrawn, with_events)


def _read_with_state(path: Path, withdrawn: Collection[str]) -> tuple[FileState | None, SessionTables]:
    """Return the session, and the state of its file before it was read."""
    state = file_state(path) if path.is_file() else None
    return state, _read_tables(path, withdrawn, with_events=True)


def _read_or_refuse(path: Path, withdrawn: Collection[str]) -> tuple[FileState | None, SessionTables] | Refused:
    try:
        return _read_with_state(path, withdrawn)
    except LedgerError as error:
        return Refused(path, str(error))


@dataclass
class Collector:
    """A collector of ledgers into a database, which reads only those that changed since they were collected.

    Sessions of the pseudonyms in `withdrawn` are marked, so that no analysis uses them. With `verify` every ledger is
    read and its chain checked, also where its file is as it was.
    """

    engine: Engine
    withdrawn: Collection[str] = ()
    verify: bool = False

    def bring(self, path: Path) -> Collected:
        """Collect one ledger in one transaction.

        Raises LedgerError on a refused ledger, CollectError on one that contradicts the database.
        """
        return self._unchanged(path) or self._write(path, *_read_with_state(path, self.withdrawn))

    def bring_all(self, paths: Sequence[Path], workers: int | None = None) -> Generator[Collected | Refused]:
        """Collect these ledgers, the unchanged ones first; where many changed, several processes read them.

        This process alone writes to the database. A ledger that is refused stops no other.
        """
        changed = []
        for path in paths:
            if (collected := self._unchanged(path)) is None:
                changed.append(path)
            else:
                yield collected
        reading = partial(_read_or_refuse, withdrawn=frozenset(self.withdrawn))
        sessions = map_in_order(reading, changed, workers_for(len(changed), workers))
        with closing(sessions):
            for path, read_session in zip(changed, sessions, strict=True):
                if isinstance(read_session, Refused):
                    yield read_session
                    continue
                try:
                    yield self._write(path, *read_session)
                except CollectError as error:
                    yield Refused(path, str(error))

    def _unchanged(self, path: Path) -> Collected | None:
        """Return the result of the earlier collection if the ledger has not changed since; None if it must be read.

        It is unchanged if its file, the end of its chain and the participant's withdrawal are as when it was collected.
        """
        known = self._known.get(path.name)
        if known is None or self.verify or not path.is_file():
            return None
        if file_state(path) != known.state or (known.participant in self.withdrawn) != known.is_withdrawn:
            return None
        if last_hash(path) != known.head_hash:
            return None
        return Collected(path, known.session, "unchanged", known.trials_answered)

    def _write(self, path: Path, state: FileState | None, session: SessionTables) -> Collected:
        try:
            with self.engine.begin() as connection:
                _wait_for_others(connection)
                what = bring_in(connection, session, path)
                if state is not None:
                    name = session.session["session"]
                    connection.execute(delete(schema.ledgers).where(schema.ledgers.c.session == name))
                    connection.execute(insert(schema.ledgers), {"session": name, **asdict(state)})
        except SQLAlchemyError as error:
            reason = database_reason(error, self.engine.url)
            raise CollectError(f"{path}: could not be collected: {reason}") from None
        return Collected(path, session.session["session"], what, session.session["trials_answered"])

    @cached_property
    def _known(self) -> dict[str, _Known]:
        """Return the collected sessions by the name of their file; names that several sessions share are left out."""
        with self.engine.connect() as connection:
            rows = connection.execute(_KNOWN).all()
        times = Counter(row.file for row in rows)
        return {row.file: _known(row) for row in rows if times[row.file] == 1}


@dataclass(frozen=True)
class _Known:
    """A session as it was collected, and the state of its file then."""

    session: str
    participant: str
    is_withdrawn: bool
    trials_answered: int
    head_hash: str
    state: FileState


def _known(row: Any) -> _Known:
    state = FileState(row.size, row.mtime_ns, row.wal_size, row.wal_mtime_ns)
    is_withdrawn = row.status == "withdrawn"
    return _Known(row.session, row.participant, is_withdrawn, row.trials_answered, row.head_hash, state)


def _wait_for_others(connection: Connection) -> None:
    """Take the lock under which writers come in turn: two at once would each find a table or a study missing."""
    if connection.dialect.name == "sqlite":
        try:
            connection.exec_driver_sql("BEGIN IMMEDIATE")
        except OperationalError as error:
            if "readonly" not in str(error):  # a database that is only read needs no lock
                raise
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({LOCK})")


def rebuild_command(url: URL, lab: Path | None) -> str:
    """Return the command that rebuilds a collected database, and say where its URL is shown without the password."""
    words = ["palpate", "collect", "--rebuild", "--lab", "LAB" if lab is None else str(lab)]
    shown = url._replace(password=None).difference_update_query(  # `set` takes None for unchanged
        [key for key in url.query if "password" in key.lower() or key.lower() in {"pwd", "passwd"}]
    )
    if lab is None or url != URL.create("sqlite", database=str(lab / DATABASE)):
        words += ["--to", shown.render_as_string(hide_password=False)]
    return shlex.join(words) + ("" if shown == url else " (the URL is shown without its password: add it)")


def _demand_version(connection: Connection, lab: Path | None = None) -> None:
    """Create what is missing. Raises CollectError where what is there is of another version."""
    schema.palpate.create(connection, checkfirst=True)
    version = connection.execute(select(schema.palpate.c.version)).scalar_one_or_none()
    if version is None:
        connection.execute(insert(schema.palpate), {"version": schema.VERSION})
    elif version != schema.VERSION:
        raise CollectError(
            f"collected in version {version}, and this Palpate writes {schema.VERSION}; collect again from the ledgers:"
            f" {rebuild_command(connection.engine.url, lab)}"
        )
    schema.create_all(connection)


def _demand_ours(connection: Connection) -> None:
    """Raise CollectError unless the database is empty or has the table `palpate`, the mark of a collected database.

    In PostgreSQL a lab's registry may lie beside it. A table under one of our names must have our key columns.
    """
    sqlite = connection.dialect.name == "sqlite"
    if sqlite and connection.exec_driver_sql("PRAGMA application_id").scalar_one() == APPLICATION_ID:
        raise CollectError("this file is a session's ledger; collect into another database")
    inspector = inspect(connection)
    names = {*inspector.get_table_names(), *inspector.get_view_names()} - (set() if sqlite else set(registry.tables))
    columns = {
        name: {str(column["name"]) for column in inspector.get_columns(name)}
        for name in names.intersection(schema.metadata.tables)
    }
    if names and columns.get(schema.palpate.name) != {"version"}:
        raise CollectError(
            f"holds the table {min(names)}, and no mark of palpate collect; nothing was changed. Collect "
            "into a new database" + ("" if sqlite else ", or a new schema: add ?options=-csearch_path%3DSCHEMA")
        )
    for name, present in sorted(columns.items()):
        if missing := {column.name for column in schema.metadata.tables[name].primary_key} - present:
            raise CollectError(
                f"its table {name} has no column {min(missing)}: palpate collect did not write it; nothing changed. "
                "Rename that table, or collect into a new database"
            )


def of_a_session() -> tuple[Table, ...]:
    """Return all tables with rows of a session, those first that refer to others."""
    return (
        schema.ledgers, schema.streams, schema.events, schema.anchors, schema.switches, schema.answers, schema.words,
        schema.responses, *schema.form_tables().values(), schema.trials, schema.sessions,
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
    for extension in session.extensions:
        finder().load(extension)
    if session.extensions:
        schema.add_own_tables(connection)
    if held is not None:
        _demand_continuation(connection, session, path)
        for table in of_a_session():
            connection.execute(delete(table).where(table.c.session == name))
    _insert(connection, session)
    return "new" if held is None else "updated"


def _demand_continuation(connection: Connection, session: SessionTables, path: Path) -> None:
    """Raise CollectError unless the session still begins with what was collected of it: it may only grow."""
    name = session.session["session"]
    query = select(schema.events.c.seq, schema.events.c.hash).where(schema.events.c.session == name)
    now = {row["seq"]: row["hash"] for row in session.events}
    for seq, link in connection.execute(query.order_by(schema.events.c.seq)):
        if now.get(seq) != link:
            how = "is cut short" if seq not in now else "is another session, or was changed,"
            raise CollectError(
                f"{path}: session {name} {how} compared with the one collected before (event {seq}); "
                "if it was run again, collect with --rebuild; labs that share a database need distinct pseudonyms"
            )


def _insert(connection: Connection, session: SessionTables) -> None:
    # Study and participant may be there from an earlier session. Of one version of a study (its sample may change) the
    # definition of the session that started last stands.
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
    connection.execute(insert(schema.sessions), session.session)
    for table, rows in (
        (schema.trials, session.trials),
        (schema.responses, session.responses),
        (schema.words, session.words),
        (schema.answers, session.answers),
        (schema.switches, session.switches),
        (schema.anchors, session.anchors),
        *((schema.form_tables()[name], rows) for name, rows in session.own.items()),
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
    """Return the SQL that inserts these columns, and a function that takes a row's cells in their order."""
    statement = insert(table).values(dict.fromkeys(names)).compile(dialect=dialect)
    return str(statement), itemgetter(*statement.positiontup or names)


def _is_latest(connection: Connection, session: SessionTables) -> bool:
    """Return whether no session of this version of the study started later; equal times are ordered by name."""
    row, table = session.session, schema.sessions
    starts = select(table.c.started_at, table.c.session).where(table.c.study_digest == row["study_digest"])
    return all(tuple(other) <= (row["started_at"], row["session"]) for other in connection.execute(starts))
