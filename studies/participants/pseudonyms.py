"""Pseudonyms: what one looks like, and the next that is free."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from palpate.protocols.lookalikes import looks
from palpate.studies.participants.errors import ParticipantError

_PSEUDONYM = re.compile(r"^[A-Za-z][A-Za-z0-9]{0,14}[0-9]$")
_OF_SESSION = re.compile(r"_([A-Za-z0-9]+)_s[0-9]+\.sqlite$")


def demand_pseudonym(text: str) -> None:
    """Raise ParticipantError unless the text is letters and digits, a digit last: a given name is no pseudonym."""
    if not _PSEUDONYM.fullmatch(text):
        raise ParticipantError(
            f"participant {text!r}: a pseudonym as P001 is expected: a letter, up to 15 letters or digits, a digit last"
        )


def next_pseudonym(known: Iterable[str]) -> str:
    """The first of P001, P002, ... that was never given, nor one that looks like it (p1, P0001)."""
    given = {looks(each) for each in known}
    number = 1
    while looks(f"P{number:03d}") in given:
        number += 1
    return f"P{number:03d}"


def in_sessions(lab: Path) -> set[str]:
    """The pseudonyms that the names of the lab's session files hold."""
    found = (_OF_SESSION.search(path.name) for path in (lab / "sessions").glob("*.sqlite"))
    return {match[1] for match in found if match}
