"""A lab's registry: one SQLite file, or a database that several stations share; every write is one transaction.

Writers come one after another (a write lock in SQLite, an advisory lock in PostgreSQL), and a partial unique index lets
no row be held twice, even if a writer ignores the lock.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from sqlalchemy import URL, Connection, Engine, NullPool, create_engine, event, insert, inspect, make_url, select
from sqlalchemy.exc import ArgumentError, IntegrityError, SQLAlchemyError

from palpate.protocols.canonical import canonical
from palpate.protocols.files import make_folder
from palpate.studies.lab import SETTINGS, ParticipantError, settings
from palpate.studies.messages import database_reason, describe_url
from palpate.studies.participants import schema
from palpate.studies.sessions.environment import wall_time
from palpate.studies.sessions.ledger_schema import DURABLE

T = TypeVar("T")
TRIES = 20
WAIT_S = 60
_WRITES = "palpate_writes"


@dataclass(frozen=True)
class Registry:
    """A registry that can be connected to; no connection stays open between two calls."""

    lab: Path
    engine: Engine


def registry_url(lab: Path) -> URL:
    """Return the URL of the lab's registry: LAB/participants/registry.sqlite, or what lab.yaml says.

    A relative SQLite path starts at the lab's folder. Raises ParticipantError on a URL that cannot be used.
    """
    url_text = settings(lab).registry
    if url_text is None:
        return URL.create("sqlite", database=str(lab / "participants" / "registry.sqlite"))
    try:
        url = make_url(url_text)
    except (ArgumentError, ValueError) as error:
        raise ParticipantError(f"{lab / SETTINGS}: registry: {database_reason(error, url_text)}") from None
    dialect = url.get_backend_name()
    if dialect not in {"sqlite", "postgresql"}:
        raise ParticipantError(f"{lab / SETTINGS}: registry: found {dialect}; expected postgresql+psycopg or sqlite")
    if dialect == "sqlite":
        if url.database in {None, "", ":memory:"}:
            raise ParticipantError(
                f"{lab / SETTINGS}: registry: a database in memory is lost when the command ends; name a file"
            )
        url = url.set(database=str(lab / str(url.database)))
    return url


def find_registry(lab: Path) -> Registry | None:
    """Return the lab's registry to read, or None if it has none yet. Writes nothing.

    Raises ParticipantError where it cannot be reached or is newer.
    """
    url = registry_url(lab)
    if url.get_backend_name() == "sqlite" and not Path(str(url.database)).is_file():
        return None
    registry = _at(lab, url)
    with reading(registry) as connection:
        exists = inspect(connection).has_table(schema.registry.name)
        if exists:
            _demand_version(connection, url)
    return registry if exists else None


def open_registry(lab: Path) -> Registry:
    """Return the lab's registry to write, and create missing tables.

    Raises ParticipantError where it cannot be reached or is newer.
    """
    existing = find_registry(lab)
    if existing is not None:
        return existing
    url = registry_url(lab)
    if settings(lab).registry is None:
        make_folder(Path(str(url.database)).parent)
    registry = _at(lab, url)

    def create(connection: Connection) -> None:
        schema.metadata.create_all(connection)
        if connection.execute(select(schema.registry.c.version)).first() is None:
            connection.execute(insert(schema.registry), {"version": schema.VERSION})
        _demand_version(connection, url)

    write(registry, create)
    return registry


@contextmanager
def reading(registry: Registry) -> Iterator[Connection]:
    """Open a connection that sees the registry at one moment."""
    with _database_errors(registry), registry.engine.connect() as connection, connection.begin():
        yield connection


def write(registry: Registry, act: Callable[[Connection], T]) -> T:
    """Run `act` in one transaction that no other process or station interleaves with, again after a conflict.

    Raises ParticipantError where the registry cannot be written.
    """
    engine, conflict = registry.engine.execution_options(**{_WRITES: True}), ""
    for _ in range(TRIES):
        try:
            with _database_errors(registry), engine.connect() as connection, connection.begin():
                if connection.dialect.name == "postgresql":
                    connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({schema.LOCK})")
                return act(connection)
        except IntegrityError as error:
            conflict = str(error.orig).strip()
    raise ParticipantError(f"{where(registry)}: {conflict}; tried {TRIES} times")


def note(connection: Connection, what: str, body: dict[str, Any]) -> None:
    """Add a line to the audit trail; `body` holds pseudonyms, never identities."""
    connection.execute(insert(schema.audit), {"at": wall_time(), "what": what, "body": canonical(body).decode()})


def withdrawn(lab: Path) -> set[str]:
    """Return the pseudonyms of those who withdrew: their sessions are not to be collected, analysed or exported."""
    registry = find_registry(lab)
    if registry is None:
        return set()
    with reading(registry) as connection:
        return gone(connection)


def gone(connection: Connection) -> set[str]:
    """Return the pseudonyms of those who withdrew."""
    people = schema.participants
    return set(connection.execute(select(people.c.participant).where(people.c.status == "withdrawn")).scalars())


def where(registry: Registry) -> str:
    """Return the registry's location for messages, without a password."""
    return f"registry {_shown(registry.engine.url)}"


def _shown(url: URL) -> str:
    return str(url.database) if url.get_backend_name() == "sqlite" else describe_url(url)


def _at(lab: Path, url: URL) -> Registry:
    sqlite = url.get_backend_name() == "sqlite"
    try:
        engine = create_engine(
            url, poolclass=NullPool, connect_args={"timeout": WAIT_S} if sqlite else {"connect_timeout": 10}
        )
    except (ModuleNotFoundError, SQLAlchemyError) as error:
        raise ParticipantError(f"registry {_shown(url)}: {database_reason(error, url)}") from None
    if sqlite:
        _take_begin_over(engine)
    return Registry(lab, engine)


def _take_begin_over(engine: Engine) -> None:
    """Let SQLAlchemy begin transactions: SQLite's driver would begin one only at its first write, which is too late."""

    @event.listens_for(engine, "connect")
    def by_hand(connection: Any, _record: Any) -> None:
        connection.isolation_level = None
        connection.execute("PRAGMA foreign_keys=ON")
        for pragma in DURABLE:
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        writes = connection.get_execution_options().get(_WRITES)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


@contextmanager
def _database_errors(registry: Registry) -> Iterator[None]:
    try:
        yield
    except IntegrityError:
        raise
    except SQLAlchemyError as error:
        raise ParticipantError(f"{where(registry)}: {database_reason(error, registry.engine.url)}") from None


def _demand_version(connection: Connection, url: URL) -> None:
    version = connection.execute(select(schema.registry.c.version)).scalar()
    if version != schema.VERSION:
        raise ParticipantError(
            f"registry {_shown(url)}: written in version {version}, this Palpate reads {schema.VERSION}: "
            "update Palpate on this station"
        )
