"""Identities behind pseudonyms: a separate store that only its owner can read, and that erases for good."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from datetime import date
from pathlib import Path
from typing import Any

from sqlalchemy import (
    URL,
    Column,
    Connection,
    Engine,
    MetaData,
    NullPool,
    String,
    Table,
    Text,
    create_engine,
    delete,
    event,
    insert,
    inspect,
    select,
    update,
)
from sqlalchemy.exc import SQLAlchemyError

from palpate.protocols.files import make_folder, write_text
from palpate.studies.lab import ParticipantError
from palpate.studies.messages import database_reason
from palpate.studies.sessions.ledger_schema import DURABLE

metadata = MetaData()
table = Table(
    "identities",
    metadata,
    Column("pseudonym", String(16), primary_key=True),
    Column("name", Text),
    Column("contact", Text),
    Column("consented", String(10)),
    Column("note", Text),
)

_FORGETTING = ("secure_delete=ON", "temp_store=MEMORY", *DURABLE)
_ALONE = (*_FORGETTING, "locking_mode=EXCLUSIVE", "journal_mode=PERSIST")
"""Pragmas for erasing: the journal stays in place until it is overwritten, and nobody else writes meanwhile."""


@dataclass(frozen=True)
class Identity:
    """A person; `consented` is the ISO date of the signed consent; None means not known."""

    name: str | None = None
    contact: str | None = None
    consented: str | None = None
    note: str | None = None

    def to_dict(self) -> dict[str, str]:
        """Return the known fields."""
        return {key: value for key, value in asdict(self).items() if value is not None}


def store(lab: Path) -> Path:
    """Return the path of the lab's identities: LAB/private/identities.sqlite."""
    return lab / "private" / "identities.sqlite"


def demand_private(lab: Path) -> None:
    """Raise ParticipantError if anybody but the owner can read the store; do nothing if there is none.

    On Windows, the owner must set the access (docs/reference/participants.md): it has no such permissions.
    """
    for path, mode in ((store(lab).parent, "700"), (store(lab), "600")):
        if os.name == "posix" and path.exists() and stat.S_IMODE(path.stat().st_mode) & 0o077:
            raise ParticipantError(
                f"{path}: others than its owner can look into it, which holds people's names: chmod {mode} {path}"
            )


def identify(lab: Path, pseudonym: str, identity: Identity) -> None:
    """Add or correct the identity behind a pseudonym; fields that are None stay unchanged.

    Raises ParticipantError on an empty text, one with line breaks, an invalid date, or a store open to others.
    """
    demand_good(identity)
    known = identity.to_dict()
    if not known:
        return
    with _opened(lab) as connection:
        mine = table.c.pseudonym == pseudonym
        if connection.execute(update(table).where(mine).values(known)).rowcount == 0:
            connection.execute(insert(table), {"pseudonym": pseudonym, **known})


def demand_good(identity: Identity) -> None:
    """Raise ParticipantError on an empty text, a text of several lines, or an invalid date."""
    for what, text in identity.to_dict().items():
        if not text.strip() or not text.isprintable():
            raise ParticipantError(f"{what}: found {text!r:.60}, a text of one line is expected")
    if identity.consented is None:
        return
    try:
        good = date.fromisoformat(identity.consented).isoformat() == identity.consented
    except ValueError:
        good = False
    if not good:
        raise ParticipantError(f"consented: found {identity.consented!r}, a date as 2026-03-31 is expected")


def demand_nameless(lab: Path, participant: str, why: str) -> None:
    """Raise ParticipantError on a reason that is empty or names the participant: it is stored for good."""
    if not why.strip():
        raise ParticipantError("--why: a reason is expected")
    known, text = identities(lab).get(participant, Identity()), why.casefold()
    whole = [entry.casefold() for entry in (known.name, known.contact) if entry]
    parts = {part for part in (known.name or "").casefold().split() if len(part) > 2}
    if any(entry in text for entry in whole) or parts & set(re.findall(r"\w+", text)):
        raise ParticipantError(
            f"--why: it tells who {participant} is, and it stays in the audit trail: say it without name and contact"
        )


def identities(lab: Path) -> dict[str, Identity]:
    """Return all identities by pseudonym; none if there is no store.

    Raises ParticipantError if others can read the store.
    """
    demand_private(lab)
    if not store(lab).exists():
        return {}
    with _opened(lab) as connection:
        return {
            row.pseudonym: Identity(row.name, row.contact, row.consented, row.note)
            for row in connection.execute(select(table).order_by(table.c.pseudonym))
        }


def erase(lab: Path, pseudonym: str) -> bool:
    """Erase a person so that no byte of them is left in the file; return whether there was anything to erase.

    Freed pages are overwritten (secure_delete), the file is rewritten (VACUUM), its journal overwritten.
    """
    demand_private(lab)
    if not store(lab).exists():
        return False
    with _database_errors(lab), _engine(lab, _ALONE).connect() as connection:
        if not inspect(connection).has_table(table.name):
            return False
        erased = connection.execute(delete(table).where(table.c.pseudonym == pseudonym)).rowcount > 0
        connection.commit()
        connection.exec_driver_sql("VACUUM")
        _wipe(store(lab).with_name(f"{store(lab).name}-journal"))
    return erased


def _wipe(journal: Path) -> None:
    """Overwrite the journal, which holds the erased data."""
    if not journal.exists():
        return
    with journal.open("r+b") as file:
        file.write(bytes(journal.stat().st_size))
        file.flush()
        os.fsync(file.fileno())
    journal.unlink()


@contextmanager
def _opened(lab: Path) -> Iterator[Connection]:
    demand_private(lab)
    # The folder, kept out of version control, and the file: for their owner only before they hold anything.
    file = store(lab)
    if not file.parent.exists():
        make_folder(file.parent, 0o700)
        write_text(file.parent / ".gitignore", "*\n")
    with suppress(FileExistsError):
        os.close(os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
    with _database_errors(lab), _engine(lab).begin() as connection:
        if not inspect(connection).has_table(table.name):
            metadata.create_all(connection)
        yield connection


def _engine(lab: Path, pragmas: tuple[str, ...] = _FORGETTING) -> Engine:
    engine = create_engine(URL.create("sqlite", database=str(store(lab))), poolclass=NullPool)

    @event.listens_for(engine, "connect")
    def forgetting(connection: Any, _record: Any) -> None:
        for pragma in pragmas:
            connection.execute(f"PRAGMA {pragma}")

    return engine


@contextmanager
def _database_errors(lab: Path) -> Iterator[None]:
    try:
        yield
    except SQLAlchemyError as error:
        raise ParticipantError(f"{store(lab)}: {database_reason(error)}") from None
