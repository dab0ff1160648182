"""The versions of models that a study's sessions played, by name and SHA-256."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from palpate.studies.sessions.record import LedgerError, read

SHOWN = 12
"""How many digits of a digest a message shows."""


def models_in(reply: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the name and the SHA-256 of each model that made what a reply records."""
    if texture := reply.get("rendered"):
        yield texture["model"], texture["sha256"]
    if door := reply.get("made"):
        models = door["models"]
        for role in ("force", "perception"):
            yield models[f"{role}_model"], models[f"{role}_sha256"]


def models_before(names: Iterable[str], ledgers: Iterable[Path]) -> dict[str, tuple[str, Path]]:
    """Return the SHA-256 that each named model had when it was last played, and the ledger that says so.

    `ledgers` are read in their order, no further than needed; refused ones are skipped.
    """
    missing, before = set(names), dict[str, tuple[str, Path]]()
    for path in ledgers:
        if not missing:
            break
        try:
            replies = [event.value for event in read(path).events if event.kind == "reply"]
        except LedgerError:
            continue
        last = dict(model for reply in replies for model in models_in(reply))
        before |= {name: (last[name], path) for name in missing & last.keys()}
        missing -= last.keys()
    return before
