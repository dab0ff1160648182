"""What sessions began as, from their first events alone."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.protocols.trial import ParticipantRow
from palpate.studies.record import LedgerError, read_header


@dataclass(frozen=True)
class Begun:
    """A session: whose, in which study, with which row and seed, and whether a person sat there."""

    study: str
    who: ParticipantRow
    seed: int | None
    in_person: bool


def in_person(header: dict[str, Any]) -> bool:
    """Whether a session is a real participant's: simulated ones and rehearsals are nobody's."""
    return bool(header["rig"]["kind"] == "live")


def by_twins(header: dict[str, Any]) -> bool:
    """Whether what a session recorded was made by twins, whoever sat there."""
    return not in_person(header) or bool(header["rig"].get("twins"))


def wanted_kind(met: Collection[bool], asked: bool | None) -> bool:
    """Which sessions count, those of twins (True) or real ones, where they are never mixed: what was `asked` for, else
    the real ones, where any of those that were `met` is."""
    return all(met) if asked is None else asked


def left_out(what: str, wanted: bool) -> str:
    """The note on those that do not count."""
    return f"{what} of {'real' if wanted else 'simulated'} sessions are left out: they are not mixed with others"


def begun_in(ledgers: Iterable[Path]) -> Iterator[Begun]:
    """What the ledgers began as, in their order; one whose first event cannot be read is passed over."""
    for path in ledgers:
        try:
            header = read_header(path)
            who = ParticipantRow(header["participant"], header["group"], header["row"])
            yield Begun(header["study"]["study"], who, header.get("seed"), in_person(header))
        except (LedgerError, KeyError, TypeError):
            continue
