"""The sessions of a study that may be used: nobody's who withdrew, and either real or simulated ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol, TypeVar

from palpate.studies.participants.registry import withdrawn
from palpate.studies.sessions.record import LedgerError, Record, read, read_header
from palpate.studies.sessions.session_files import ledgers_in


class Recorded(Protocol):
    """Anything that a session recorded."""

    @property
    def simulated(self) -> bool:
        """Whether simulated devices made it."""


T = TypeVar("T", bound=Recorded)


def headers_of(source: Path, study: str) -> Iterator[tuple[Path, dict[str, Any] | None]]:
    """Yield the ledgers of a study with their first events, None where that cannot be read.

    `source` is a lab's folder, or one session's file in its `sessions`. Those of people who withdrew are left out.
    """
    one = source.is_file()
    gone = withdrawn(source.parent.parent if one else source)
    for path in [source] if one else ledgers_in(source, study):
        header: dict[str, Any] | None = None
        with suppress(LedgerError):
            header = read_header(path)
        if header is None or header["participant"] not in gone:
            yield path, header


def sessions_of(source: Path, study: str) -> Iterator[Record]:
    """Yield the verified sessions of a study, one at a time, of nobody who withdrew.

    `source` is as in `headers_of`. Of a person who withdrew only the first event is read. Raises LedgerError on a
    damaged file.
    """
    for path, _ in headers_of(source, study):
        yield read(path)


def real_or_simulated(items: Sequence[T], simulated: bool | None, what: str) -> tuple[list[T], tuple[str, ...]]:
    """Return the items of one kind, and a note where there are `what` of the other kind too: the two are never mixed.

    `simulated` says which kind; None takes the real ones where there are any.
    """
    kinds = {item.simulated for item in items}
    kind = all(kinds) if simulated is None else simulated
    note = f"{what} of {'real' if kind else 'simulated'} sessions are left out: they are not mixed with others"
    return [item for item in items if item.simulated == kind], (note,) if kinds - {kind} else ()
