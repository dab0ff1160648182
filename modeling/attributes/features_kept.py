"""Features kept by content: under the digest of what they were made from, how, and by which code; LAB/features.

Nothing there is needed: the folder may be removed at any time, and what lacks is made anew.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from palpate.modeling.attributes.material import MaterialError, Rows
from palpate.modeling.files.finished import put_down, taken_up
from palpate.protocols.extras import installed_version

FOLDER = "features"
"""Of a lab."""
KEY, SHA256 = "key", "sha256"
Entry: TypeAlias = tuple[dict[str, Rows], dict[str, Any]]
"""Rows by kind, and what is told of them (what JSON holds)."""


def key_of(decides: Mapping[str, object], code: Sequence[str], packages: Sequence[str]) -> str:
    """32 hexadecimal digits that change with what decides the rows: their source, settings, our files, their versions.

    `code` are digests of the files that make them, `packages` the installed packages that do.
    """
    told = {
        "decides": {name: str(value) for name, value in decides.items()},
        "code": list(code),
        "packages": {name: installed_version(name) or "" for name in packages},
    }
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:32]


def keep(folder: Path | None, key: str, rows: Mapping[str, Rows], told: Mapping[str, Any]) -> None:
    """Write an entry, whole or not at all; without a folder nothing is kept. Raises MaterialError on a full disk."""
    if folder is None:
        return
    try:
        put_down(folder / key, rows, {**told, KEY: key, SHA256: _digest(rows)})
    except OSError as error:
        raise MaterialError(
            f"{folder}: features cannot be kept there ({error.strerror}); make room, or let it be written to"
        ) from None


def kept(folder: Path | None, key: str) -> Entry | None:
    """The entry of that key as it was written; None where there is none, or a damaged one, or another one's."""
    return None if folder is None else taken_up(folder / key, lambda told, rows: _entry(key, told, rows))


def _entry(key: str, told: Mapping[str, Any], rows: dict[str, Any]) -> Entry:
    if told[KEY] != key or told[SHA256] != _digest(rows):
        raise ValueError("another entry, or not as it was written")
    return rows, {name: value for name, value in told.items() if name not in (KEY, SHA256)}


def _digest(rows: Mapping[str, Rows]) -> str:
    found = hashlib.sha256()
    for kind in sorted(rows):
        found.update(f"{kind} {rows[kind].dtype.str} {rows[kind].shape}\0".encode())
        found.update(np.ascontiguousarray(rows[kind]).tobytes())
    return found.hexdigest()
