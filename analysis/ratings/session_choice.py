"""The choice of sessions to analyse: one version of a study, all real or all simulated, by default only complete ones.

A single session file and a whole lab are treated in the same way.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from sqlalchemy import Connection, text
from sqlalchemy.exc import SQLAlchemyError

from palpate.analysis.ratings.dataset import DataRefused, Input
from palpate.analysis.ratings.sample import DoneSession, achieved_sample
from palpate.protocols.canonical import parse
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.study import Study
from palpate.protocols.wording import count, some
from palpate.studies.messages import database_reason, describe_url

_SESSIONS = text(
    "SELECT session, study_digest, participant, group_name, seed, simulated, status, trials_planned, trials_answered,"
    " head_hash, file, file_sha256, number, duration_s, certificates"
    " FROM sessions WHERE study = :study ORDER BY participant, session"
)
STATUSES = ("complete", "interrupted", "aborted", "declined", "ineligible", "withdrawn")
NEVER = {"withdrawn": "withdrew", "declined": "declined to take part", "ineligible": "was not eligible"}
"""States of sessions that never count, and descriptions of their participants."""
OTHER_KIND = {True: "a simulated session", False: "a real session, only simulated ones were requested"}
"""Sessions that no analysis may use, whatever the request."""


@dataclass(frozen=True)
class SessionRow:
    """A row of the table `sessions` with the columns that the analysis needs."""

    session: str
    study_digest: str
    participant: str
    group_name: str | None
    seed: int
    simulated: bool
    status: str
    trials_planned: int
    trials_answered: int
    head_hash: str
    file: str
    file_sha256: str
    number: int = 1
    duration_s: float = 0.0
    certificates: str = "{}"
    """What was measured of the onset of stimuli, as JSON: {device: certificate}."""


@dataclass(frozen=True)
class Choice:
    """The analysed version of the study, its sessions that count, and the others with the reason."""

    digest: str
    sessions: tuple[SessionRow, ...]
    left_out: tuple[tuple[SessionRow, str], ...]


def chosen(
    connection: Connection, study: str, *, digest: str | None, include_incomplete: bool, simulated: bool | None,
    withdrawn: Collection[str] = (),
) -> tuple[Study, Choice]:  # fmt: skip
    """Return the analysed version of the study and the choice of its sessions. Raises as `choose_sessions` does."""
    rows = [SessionRow(**row) for row in query(connection, _SESSIONS, study)]
    if not rows:
        known = [row["study"] for row in query(connection, text("SELECT DISTINCT study FROM sessions"), study)]
        raise DataRefused(
            f"no session of study {study!r} is collected; {nearest(study, sorted(known))}"
            if known
            else "the collected database holds no session; collect the session files first"
        )
    choice = choose_sessions(rows, study, digest, include_incomplete, simulated, withdrawn)
    definitions = query(connection, text("SELECT study_digest, definition FROM studies WHERE study = :study"), study)
    stored = next((row["definition"] for row in definitions if row["study_digest"] == choice.digest), None)
    if stored is None:
        raise DataRefused(f"study {study!r}: its definition {choice.digest[:12]} is not in the database; collect again")
    try:
        return Study.model_validate(parse(stored.encode()) if isinstance(stored, str) else stored), choice
    except ValueError as error:
        lines = str(error).splitlines()
        raise DataRefused(f"study {study!r}: the stored definition cannot be read: {' '.join(lines[1:3])}") from None


def choose_sessions(
    rows: Sequence[SessionRow], study: str, digest: str | None, include_incomplete: bool, simulated: bool | None,
    withdrawn: Collection[str] = (),
) -> Choice:  # fmt: skip
    """Return the sessions of one version of the study, all real or all simulated, only complete ones by default.

    People in `withdrawn` are left out, whatever the rows say about their sessions. Raises DataRefused if the user must
    choose, and if nothing is left.
    """
    rows = [replace(row, status="withdrawn") if row.participant in withdrawn else row for row in rows]
    chosen = _one_version(rows, study, digest)
    left_out: list[tuple[SessionRow, str]] = []

    def keep(
        sessions: Sequence[SessionRow], counts: Callable[[SessionRow], bool], why: Callable[[SessionRow], str]
    ) -> list[SessionRow]:
        left_out.extend((session, why(session)) for session in sessions if not counts(session))
        return [session for session in sessions if counts(session)]

    other = "recorded with another version of the study"
    sessions = keep(rows, lambda s: s.study_digest == chosen, lambda s: f"{other} ({s.study_digest[:12]})")
    made_up = sum(bool(session.simulated) for session in sessions)
    if simulated is None and 0 < made_up < len(sessions):
        raise DataRefused(
            f"study {study!r}: {made_up} simulated and {len(sessions) - made_up} real sessions;"
            " they are not analysed together: choose with --real or --simulated (evaluate, train, textures: --sessions"
            " real or --sessions simulated)"
        )
    kind = made_up > 0 if simulated is None else simulated
    sessions = keep(sessions, lambda s: bool(s.simulated) == kind, lambda s: OTHER_KIND[bool(s.simulated)])
    for session in sessions:
        if session.status not in STATUSES:
            known = nearest(session.status, STATUSES)
            raise DataRefused(f"session {session.session}: status {session.status!r}; {known}")
    sessions = keep(sessions, lambda s: s.status not in NEVER, lambda s: f"the participant {NEVER[s.status]}")
    sessions = keep(
        sessions,
        lambda s: include_incomplete or s.status == "complete",
        lambda s: f"{s.status} after {s.trials_answered} of {s.trials_planned} trials",
    )
    if not sessions:
        reasons = some((f"{session.participant}: {why}" for session, why in left_out), 5, "; ")
        raise DataRefused(f"study {study!r}: no session is left to analyse ({reasons})")
    return Choice(chosen, tuple(sessions), tuple(left_out))


def _one_version(rows: Sequence[SessionRow], study: str, digest: str | None) -> str:
    versions = Counter(session.study_digest for session in rows)
    if digest is None and len(versions) == 1:
        return rows[0].study_digest
    listed = ", ".join(f"{version[:12]} ({count(number, 'session')})" for version, number in sorted(versions.items()))
    if digest is None:
        raise DataRefused(
            f"study {study!r} was changed between participants: {listed}; sessions of different versions"
            " are not analysed together: choose one with --digest"
        )
    matching = [version for version in versions if version.startswith(digest)] if digest else []
    if len(matching) != 1:
        raise DataRefused(f"study {study!r}: {len(matching)} versions begin with {digest!r}; found: {listed}")
    return matching[0]


def query(connection: Connection, statement: Any, study: str) -> Iterator[dict[str, Any]]:
    """Yield the rows of the statement by column name.

    Equal texts are one object, as a large study repeats its names. Raises DataRefused where the database is not a
    collected one.
    """
    texts: dict[str, str] = {}
    try:
        result = connection.execute(statement, {"study": study})
        names = tuple(result.keys())
        for row in result:
            cells = (texts.setdefault(cell, cell) if type(cell) is str else cell for cell in row)
            yield dict(zip(names, cells, strict=True))
    except SQLAlchemyError as error:
        where, why = describe_url(connection.engine.url), database_reason(error)
        raise DataRefused(f"{where}: not a collected database ({why}); make one with: palpate collect") from None


def inputs_of(study: Study, choice: Choice) -> tuple[Input, ...]:
    """Return the study and every session file, used or left out, by their SHA-256."""
    sessions = (*choice.sessions, *(session for session, _ in choice.left_out))
    return (
        Input(f"study {study.study}", choice.digest, "the compiled study"),
        *(Input(s.file, s.file_sha256, f"session {s.session}, last event {s.head_hash}") for s in sessions),
    )


def collected_sample(study: Study, sessions: Iterable[SessionRow]) -> dict[str, Any]:
    """Return the planned and the achieved sample of collected sessions; only complete ones are done."""
    complete = [session for session in sessions if session.status == "complete"]
    return achieved_sample(
        study, [DoneSession(s.participant, s.group_name, s.number, s.duration_s / 60) for s in complete]
    )
