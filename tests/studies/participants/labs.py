"""Labs with people in them: registries at SQLite and PostgreSQL, and sessions as real people leave them."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import create_engine

from palpate.protocols.canonical import canonical
from palpate.protocols.events import Event
from palpate.protocols.study import Study
from palpate.studies.participants.lab_template import make_lab
from palpate.studies.participants.people import add
from palpate.studies.participants.registry import Registry, open_registry
from palpate.studies.sessions.ledger import create, open_for_append
from palpate.studies.sessions.session_files import ledger_path
from tests.protocols.studies_for_tests import toy
from tests.studies.labs import HEADER

GROUPS = {"x": {"kind": ["x"]}, "y": {"kind": ["y"]}}


def grouped(**changes: Any) -> Study:
    """The toy study with two groups, x and y."""
    return toy(groups=GROUPS, **changes)


@contextmanager
def postgres_schema() -> Iterator[str]:
    """The URL of an empty place in the PostgreSQL server to test with: the test needs `psycopg` and `postgres`."""
    url = os.environ["PALPATE_TEST_POSTGRES"]
    name, engine = f"registry_{uuid.uuid4().hex}", create_engine(url)
    with engine.begin() as connection:
        connection.exec_driver_sql(f"CREATE SCHEMA {name}")
    try:
        yield f"{url}?options=-csearch_path%3D{name}"
    finally:
        with engine.begin() as connection:
            connection.exec_driver_sql(f"DROP SCHEMA {name} CASCADE")
        engine.dispose()


def filled(registry: Registry, people: int) -> Registry:
    """The same registry with P001, P002, ... added."""
    for _ in range(people):
        add(registry)
    return registry


def new_lab(path: Path, url: str | None = None) -> Registry:
    """A lab made by `init`, its registry at a URL or where it lies by default."""
    make_lab(path)
    if url is not None:
        (path / "lab.yaml").write_text(f"registry: {url}\n")
    return open_registry(path)


def record_session(
    lab: Path, participant: str, answers: dict[str, Any] | None = None, at: str = "2026-01-01T00:00:00+00:00",
    number: int = 1, kind: str = "live", row: tuple[str | None, int] = (None, 0), study: str = "toy", seed: int = 0,
) -> Path:  # fmt: skip
    """Write a session's ledger with what concerns people: who, which row, and their answers about themselves."""
    header = {
        **HEADER, "study": {"study": study}, "participant": participant, "group": row[0], "row": row[1], "seed": seed,
        "rig": {"kind": kind}, "session": number,
    }  # fmt: skip
    path = ledger_path(lab, study, participant, number)
    create(path, header, {"at": at})
    ledger = open_for_append(path, {"at": at})
    if answers is not None:
        ask = {"do": "ask", "form": "demographics", "items": sorted(answers), "back": False, "previous": None}
        ledger.append(Event(1, 1, "request", canonical(ask)))
        ledger.append(Event(2, 2, "reply", canonical({"answers": answers})))
    ledger.close({"at": at})
    return path
