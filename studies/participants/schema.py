"""The tables of a lab's registry: participants, who holds which row of which study, and what was done when."""

from __future__ import annotations

from sqlalchemy import (
    CheckConstraint,
    Column,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    String,
    Table,
    Text,
    func,
)

VERSION = 1
HOLDING = ("active", "finished")
"""States of an allocation in which its row is nobody else's."""
LOCK = 0x50414C50
"""Key of the PostgreSQL advisory lock under which writers of a registry come one after another."""

metadata = MetaData()
registry = Table("registry", metadata, Column("version", Integer, primary_key=True, autoincrement=False))
participants = Table(
    "registry_participants",
    metadata,
    Column("participant", String(16), primary_key=True),
    Column("status", String(16), CheckConstraint("status IN ('active', 'withdrawn')"), nullable=False),
    Column("added_at", String(32), nullable=False),
)
Index("registry_one_of_a_name", func.lower(participants.c.participant), unique=True)
allocations = Table(
    "registry_allocations",
    metadata,
    Column("study", String(64), primary_key=True),
    Column("participant", String(16), ForeignKey("registry_participants.participant"), primary_key=True),
    # '' where the study has no groups: NULLs are never equal, so that an index would let a row be held twice.
    Column("group_name", String(200), nullable=False),
    Column("row", Integer, CheckConstraint('"row" >= 0'), nullable=False),
    Column("status", String(16), CheckConstraint("status IN ('active', 'released', 'finished')"), nullable=False),
    Column("replaces", String(16)),
    Column("at", String(32), nullable=False),
)
_HELD = allocations.c.status.in_(HOLDING)
Index(
    "registry_one_holder_of_a_row",
    allocations.c.study,
    allocations.c.group_name,
    allocations.c.row,
    unique=True,
    sqlite_where=_HELD,
    postgresql_where=_HELD,
)
audit = Table(
    "registry_audit",
    metadata,
    Column("n", Integer, primary_key=True, autoincrement=True),
    Column("at", String(32), nullable=False),
    Column("what", String(32), nullable=False),
    Column("body", Text, nullable=False),
)
