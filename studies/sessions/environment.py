"""The environment of a session: version, code and packages, and the wall clock."""

from __future__ import annotations

import platform
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from palpate.protocols.code_digest import files_digest, sources_in
from palpate.protocols.extras import installed_version

ROOMS = ("protocols", "signals", "devices", "studies")
PACKAGES = ("pydantic", "pyyaml", "sqlalchemy", "filelock", "psychopy", "pyserial")


def palpate_version() -> str:
    """Return the installed version of Palpate."""
    return installed_version("palpate") or "unknown"


def session_code_digest() -> str:
    """Return the SHA-256 over the sources that run a session: two sessions with one digest ran the same code."""
    root = Path(__file__).resolve().parents[2]
    return files_digest(source for room in ROOMS for source in sources_in(root / room))


@cache
def environment() -> dict[str, Any]:
    """Return versions for the ledger: Palpate, its code, Python, platform, and the packages that a session uses."""
    return {
        "palpate": palpate_version(),
        "code": session_code_digest(),
        "python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
        "packages": {name: found for name in PACKAGES if (found := installed_version(name)) is not None},
    }


def wall_time() -> str:
    """Return the wall clock in UTC, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")
