"""participants.tsv: one row for each participant, as BIDS wants it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from palpate.protocols.files import write_text
from palpate.protocols.wording import some
from palpate.studies.participants.errors import ParticipantError
from palpate.studies.participants.sidecar import identifying

TABLE = "participants.tsv"
KEY = "participant_id"
MISSING = "n/a"
Row = dict[str, str]


def bids_id(participant: str) -> str:
    """sub-P001 for P001."""
    return f"sub-{participant}"


def read_table(file: Path, known: Sequence[str]) -> dict[str, Row]:
    """The rows by participant_id; none where there is no file.

    Raises ParticipantError on a column that participants.json (`known`) does not describe, an uneven row, a participant
    who stands there twice.
    """
    if not file.is_file():
        return {}
    try:
        lines = file.read_text("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise ParticipantError(f"{file}: byte {error.start} is not UTF-8; save the table as UTF-8") from None
    header = lines[0].split("\t") if lines else [KEY]
    _demand_header(file, header, known)
    rows: dict[str, Row] = {}
    for number, line in enumerate(lines[1:], start=2):
        if line:
            row = _row(f"{file}: line {number}", header, line.split("\t"))
            if row[KEY] in rows:
                raise ParticipantError(
                    f"{file}: line {number}: {row[KEY]} stands there twice; one row each is expected"
                )
            rows[row[KEY]] = row
    return rows


def write_table(file: Path, columns: Sequence[str], rows: Iterable[Mapping[str, str]]) -> None:
    """Put a table in the file's place, whole or not at all; a cell that is missing is n/a."""
    lines = ["\t".join(columns), *("\t".join(_cell(row.get(name)) for name in columns) for row in rows)]
    write_text(file, "\n".join(lines) + "\n")


def drop_row(file: Path, participant: str) -> bool:
    """Take a participant's row out of a table, whatever its columns; returns whether there was one."""
    if not file.is_file():
        return False
    lines = file.read_text("utf-8-sig", errors="surrogateescape").splitlines(keepends=True)
    left = [line for line in lines if line.rstrip("\r\n").split("\t")[0] != bids_id(participant)]
    if len(left) == len(lines):
        return False
    write_text(file, "".join(left), errors="surrogateescape")
    return True


def _demand_header(file: Path, header: list[str], known: Sequence[str]) -> None:
    if header[0] != KEY or len(set(header)) != len(header):
        raise ParticipantError(f"{file}: line 1: {KEY} first, and no column twice, is expected; found {some(header)}")
    for name in header:
        if word := identifying(name):
            raise ParticipantError(f"{file}: line 1: a column about {word!r} would say who somebody is; take it out")
        if name not in known:
            raise ParticipantError(
                f"{file}: line 1: column {name!r} is not described in participants.json; add it there"
            )


def _row(where: str, header: list[str], cells: list[str]) -> Row:
    if len(cells) != len(header):
        raise ParticipantError(f"{where}: {len(cells)} cells, {len(header)} columns are expected (divided by tabs)")
    return dict(zip(header, cells, strict=True))


def _cell(text: str | None) -> str:
    return " ".join(text.split()) or MISSING if text is not None else MISSING
