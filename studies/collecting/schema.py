"""The collected database: one tidy relational projection of many ledgers, at any SQLAlchemy URL."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import filterfalse
from typing import Any

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    Connection,
    Float,
    ForeignKey,
    Integer,
    MetaData,
    Select,
    String,
    Table,
    Text,
    insert,
    inspect,
    select,
    true,
)
from sqlalchemy.types import TypeEngine

from palpate.protocols import forms
from palpate.protocols.extensions import finder, is_own
from palpate.protocols.forms import OwnTable

VERSION = 5
NAME = String(200)
metadata = MetaData()

palpate = Table("palpate", metadata, Column("version", Integer, primary_key=True))
studies = Table(
    "studies",
    metadata,
    Column("study_digest", String(64), primary_key=True),
    Column("study", NAME, nullable=False),
    Column("title", Text),
    Column("definition", Text, nullable=False),
)
participants = Table(
    "participants",
    metadata,
    Column("study", NAME, primary_key=True),
    Column("participant", NAME, primary_key=True),
    Column("group_name", NAME),
    Column("row", Integer, nullable=False),
)
sessions = Table(
    "sessions",
    metadata,
    Column("session", NAME, primary_key=True),
    Column("study", NAME, nullable=False),
    Column("study_digest", String(64), ForeignKey("studies.study_digest"), nullable=False),
    Column("participant", NAME, nullable=False),
    Column("number", Integer, nullable=False),
    Column("group_name", NAME),
    Column("row", Integer, nullable=False),
    Column("seed", BigInteger, nullable=False),
    Column("simulated", Boolean, nullable=False),
    Column("status", NAME, nullable=False),
    Column("trials_planned", Integer, nullable=False),
    Column("trials_answered", Integer, nullable=False),
    Column("events", Integer, nullable=False),
    Column("first_hash", String(64), nullable=False),
    Column("head_hash", String(64), nullable=False),
    Column("file", Text, nullable=False),
    Column("file_sha256", String(64), nullable=False),
    Column("started_at", NAME, nullable=False),
    Column("sittings", Integer, nullable=False),
    Column("duration_s", Float(53), nullable=False),
    Column("palpate_version", NAME, nullable=False),
    Column("certificates", Text, nullable=False),
)


def _session_key() -> Column[str]:
    return Column("session", NAME, ForeignKey("sessions.session"), primary_key=True)


trials = Table(
    "trials",
    metadata,
    _session_key(),
    Column("trial", Integer, primary_key=True),
    Column("block", NAME, nullable=False),
    Column("practice", Boolean, nullable=False),
    Column("stimulus", NAME, nullable=False),
    Column("attempts", Integer, nullable=False),
    Column("status", NAME, nullable=False),
)
responses = Table(
    "responses",
    metadata,
    _session_key(),
    Column("trial", Integer, primary_key=True),
    Column("attempt", Integer, primary_key=True),
    Column("attribute", NAME, primary_key=True),
    Column("antonym", NAME, nullable=False),
    Column("value", Float(53), nullable=False),
    Column("response_time_s", Float(53)),
    Column("revised", Boolean, nullable=False),
    Column("counts", Boolean, nullable=False),
)
events = Table(
    "events",
    metadata,
    _session_key(),
    Column("seq", Integer, primary_key=True),
    Column("t_ns", BigInteger, nullable=False),
    Column("kind", NAME, nullable=False),
    Column("trial", Integer),
    Column("attempt", Integer),
    Column("body", Text, nullable=False),
    Column("hash", String(64), nullable=False),
)
streams = Table(
    "streams",
    metadata,
    _session_key(),
    Column("seq", Integer, primary_key=True),
    Column("block", Integer, primary_key=True),
    Column("trial", Integer),
    Column("attempt", Integer),
    Column("stream", NAME, nullable=False),
    Column("channels", Text, nullable=False),
    Column("units", Text, nullable=False),
    Column("rate_hz", Float(53), nullable=False),
    Column("t0_ns", BigInteger, nullable=False),
    Column("first", BigInteger, nullable=False),
    Column("clock", NAME, nullable=False),
    Column("samples", Integer, nullable=False),
    Column("sha256", String(64), nullable=False),
)
words = Table(
    "words",
    metadata,
    _session_key(),
    Column("seq", Integer, primary_key=True),
    Column("n", Integer, primary_key=True),
    Column("form", NAME, nullable=False),
    Column("trial", Integer),
    Column("attempt", Integer),
    Column("kind", NAME, nullable=False),
    Column("word", NAME, nullable=False),
    Column("counts", Boolean, nullable=False),
)
answers = Table(
    "answers",
    metadata,
    _session_key(),
    Column("seq", Integer, primary_key=True),
    Column("item", NAME, primary_key=True),
    Column("form", NAME, nullable=False),
    Column("kind", NAME, nullable=False),
    Column("value", Text, nullable=False),
    Column("number", Float(53)),
)
switches = Table(
    "switches",
    metadata,
    _session_key(),
    Column("seq", Integer, primary_key=True),
    Column("n", Integer, primary_key=True),
    Column("trial", Integer),
    Column("side", NAME, nullable=False),
    Column("at_s", Float(53), nullable=False),
)
anchors = Table(
    "anchors",
    metadata,
    Column("session", NAME, primary_key=True),  # no foreign key: as for `ledgers`
    Column("seq", Integer, primary_key=True),
    Column("block", NAME, nullable=False),
    Column("number", Integer, nullable=False),
    Column("stimulus", NAME, nullable=False),
    Column("label", Text, nullable=False),
    Column("attribute", NAME),
    Column("value", Float(53)),
    Column("felt", Integer, nullable=False),
)
"""References that were felt before a block; they are not trials."""
ledgers = Table(
    "ledgers",
    metadata,
    Column(
        "session", NAME, primary_key=True
    ),  # no foreign key: an older Palpate, which knows no such rows, may collect
    Column("size", BigInteger, nullable=False),
    Column("mtime_ns", BigInteger, nullable=False),
    Column("wal_size", BigInteger, nullable=False),
    Column("wal_mtime_ns", BigInteger, nullable=False),
)
"""The state of each session's file when it was read: a file that is still in this state is not read again."""
OF_KINDS: Mapping[str, Callable[[bool], TypeEngine[Any]]] = {
    "text": lambda key: NAME if key else Text(),
    "number": lambda _key: Float(53),
    "whole": lambda _key: Integer(),
    "truth": lambda _key: Boolean(),
}
"""The type of a column of an own table, by its kind and by whether it is part of the key."""


def _own_table(own: OwnTable, among: MetaData) -> Table:
    """Return the table of a form that has one of its own: whose answers, its own columns, and whether they count."""
    return Table(
        own.name,
        among,
        Column("session", NAME, primary_key=True),  # no foreign key: as for `ledgers`
        Column("seq", Integer, primary_key=True),
        Column("participant", NAME, nullable=False),
        Column("session_number", Integer, nullable=False),
        Column("trial", Integer, nullable=False),
        Column("attempt", Integer, nullable=False),
        Column("block", NAME, nullable=False),
        Column("practice", Boolean, nullable=False),
        *(Column(column.name, OF_KINDS[column.kind](column.key), primary_key=column.key) for column in own.columns),
        Column("counts", Boolean, nullable=False),
    )


_SHIPPED = {name: _own_table(own, metadata) for name, own in forms.own_tables(filterfalse(is_own, forms.FORMS)).items()}


def form_tables() -> Mapping[str, Table]:
    """Return the tables of forms that have one of their own, by name, with those of the extensions that were loaded."""
    return {**_SHIPPED, **_tables_of_extensions()}


def _tables_of_extensions() -> Mapping[str, Table]:
    """Return the own tables of loaded extensions; another lab may have others of the same names."""
    own = forms.own_tables(finder().parts("forms"))
    return {name: _own_table(table, MetaData()) for name, table in own.items()}


own_tables = Table(
    "own_tables",
    metadata,
    Column("name", NAME, primary_key=True),
)
"""The names of tables that extensions brought, so that they can be emptied where the extension is not there."""


def add_own_tables(connection: Connection) -> None:
    """Create the tables of the extensions that were loaded, where they are missing."""
    known = set(connection.execute(select(own_tables.c.name)).scalars())
    for name, table in _tables_of_extensions().items():
        table.create(connection, checkfirst=True)
        if name not in known:
            connection.execute(insert(own_tables), {"name": name})


RATINGS = "ratings"


def ratings_query() -> Select[tuple[object, ...]]:
    """Return the query of the view `ratings`: one row per rating that counts, with stimulus and attribute."""
    joined = responses.join(trials, (responses.c.session == trials.c.session) & (responses.c.trial == trials.c.trial))
    return (
        select(
            sessions.c.session,
            sessions.c.study,
            sessions.c.participant,
            sessions.c.number,
            sessions.c.group_name,
            sessions.c.status,
            sessions.c.simulated,
            trials.c.trial,
            trials.c.block,
            trials.c.practice,
            trials.c.stimulus,
            responses.c.attribute,
            responses.c.antonym,
            responses.c.value,
            responses.c.response_time_s,
            responses.c.revised,
        )
        .select_from(joined.join(sessions, sessions.c.session == trials.c.session))
        .where(responses.c.counts == true())
    )


def drop_all(connection: Connection) -> None:
    """Drop the view and all tables but `palpate`, which marks the database as ours and loses its stored version."""
    connection.exec_driver_sql(f"DROP VIEW IF EXISTS {RATINGS}")
    if inspect(connection).has_table(own_tables.name):
        for name in connection.execute(select(own_tables.c.name)).scalars().all():
            Table(name, MetaData()).drop(connection, checkfirst=True)
    metadata.drop_all(connection, tables=[table for table in metadata.sorted_tables if table is not palpate])
    if inspect(connection).has_table(palpate.name):
        connection.execute(palpate.delete())


def create_all(connection: Connection) -> None:
    """Create the tables and the view where they are missing."""
    metadata.create_all(connection)
    if RATINGS not in inspect(connection).get_view_names():
        query = ratings_query().compile(connection, compile_kwargs={"literal_binds": True})
        connection.exec_driver_sql(f"CREATE VIEW {RATINGS} AS {query}")
