"""A cache in the lab of finished sessions as the monitor shows them, so that the next monitor need not read them."""

from __future__ import annotations

import json
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from palpate.analysis.monitoring.raters import Rated
from palpate.analysis.monitoring.sessions import Note, Session
from palpate.analysis.ratings.diagnostics import Diagnostic
from palpate.protocols.files import write_text
from palpate.protocols.study import Study
from palpate.studies.sessions.environment import palpate_version
from palpate.studies.sessions.ledger_state import FileState, file_state, last_hash

FILE = Path(".cache") / "monitor.jsonl"
"""The cache file: a line for the version, and one per study and finished session; it may be removed at any time."""


@dataclass(frozen=True)
class Finished:
    """A finished session whose ledger was closed: the state of its file, the end of its chain, and what is shown.

    `order` are the stimuli of its plan without practice. `session` ignores withdrawals.
    """

    state: FileState
    head: str
    order: tuple[str, ...]
    session: Session


def load_finished(lab: Path, paths: Iterable[Path]) -> tuple[dict[Path, Finished], dict[str, Study]]:
    """Return the cached sessions of these ledgers that are still valid, and the versions of studies by digest.

    A ledger is unchanged if its size and time, those of its write-ahead log, and the last hash of its chain are.
    Entries of another version of Palpate, and unreadable ones, are ignored.
    """
    finished: dict[str, Finished] = {}
    studies: dict[str, Study] = {}
    with suppress(OSError, ValueError, TypeError, KeyError), (lab / FILE).open(encoding="utf-8") as file:
        if json.loads(file.readline()) != _version():
            return {}, {}
        for line in file:
            stored = json.loads(line)
            if "study" in stored:
                studies[stored["digest"]] = Study.model_validate(stored["study"])
            else:
                finished[stored["session"]["file"]] = _finished(stored)
    unchanged: dict[Path, Finished] = {}
    for path in paths:
        one = finished.get(path.name)
        with suppress(OSError):
            known = one is not None and one.session.digest in studies
            if one is not None and known and file_state(path) == one.state and last_hash(path) == one.head:
                unchanged[path] = one
    return unchanged, studies


def save_finished(lab: Path, finished: Iterable[Finished], studies: dict[str, Study]) -> None:
    """Add these sessions and studies to the cache, if the lab is writable."""
    lines = [{"digest": digest, "study": study.definition()} for digest, study in studies.items()]
    lines += [
        {"state": asdict(one.state), "head": one.head, "order": one.order, "session": asdict(one.session)}
        for one in finished
    ]
    head = f"{json.dumps(_version())}\n"
    text_before = ""
    with suppress(OSError, UnicodeDecodeError):
        text_before = (lab / FILE).read_text(encoding="utf-8")
    text = "".join(f"{json.dumps(line)}\n" for line in lines)
    with suppress(OSError):
        write_text(
            lab / FILE, (text_before if text_before.startswith(head) and text_before.endswith("\n") else head) + text
        )


def _version() -> dict[str, str]:
    return {"palpate monitor": palpate_version()}


def _finished(entry: dict[str, Any]) -> Finished:
    session = entry["session"]
    rated = None
    if (stored := session["rated"]) is not None:
        signs, (low, high) = tuple(Diagnostic(**sign) for sign in stored["signs"]), stored["ends"]
        rated = Rated(stored["kind"], signs, tuple(stored["seconds"]), tuple(stored["histogram"]), (low, high))
    return Finished(
        FileState(**entry["state"]),
        entry["head"],
        tuple(entry["order"]),
        Session(**session | {
            "notes": tuple(Note(**note) for note in session["notes"]),
            "rated": rated,
        }),
    )  # fmt: skip
