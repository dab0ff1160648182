"""Which sessions of a study are analysed, and why the others are not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

from palpate.analysis.ratings.dataset import DataRefused
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count, some

STATUSES = ("complete", "interrupted", "aborted", "declined", "ineligible", "withdrawn")
NEVER = ("declined", "ineligible", "withdrawn")
"""Sessions that no analysis may hold, whatever was asked for."""


@dataclass(frozen=True)
class SessionRow:
    """A row of the table `sessions`, as far as the analysis needs it."""

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


@dataclass(frozen=True)
class Choice:
    """The version of the study that is analysed, the sessions kept, and each one left out with the reason."""

    digest: str
    kept: tuple[SessionRow, ...]
    left_out: tuple[tuple[SessionRow, str], ...]


def choose_sessions(
    rows: Sequence[SessionRow], study: str, digest: str | None, include_incomplete: bool, simulated: bool | None,
    withdrawn: Collection[str] = (),
) -> Choice:  # fmt: skip
    """Return the sessions of one version of the study, all real or all simulated, and complete unless told otherwise.

    Nobody in `withdrawn` is among them, whatever the rows say of their sessions.
    Raises DataRefused where the choice is not the program's to make, and where nothing is left.
    """
    rows = [replace(row, status="withdrawn") if row.participant in withdrawn else row for row in rows]
    chosen = _one_version(rows, study, digest)
    left_out: list[tuple[SessionRow, str]] = []
    sessions = _keep(rows, left_out, lambda s: s.study_digest == chosen, _other_version)
    choice = _real_or_simulated(sessions, study, simulated)
    sessions = _keep(sessions, left_out, lambda s: bool(s.simulated) == choice, _other_kind)
    for session in sessions:
        _check_status(session)
    sessions = _keep(sessions, left_out, lambda s: s.status not in NEVER, _unwanted)
    sessions = _keep(sessions, left_out, lambda s: include_incomplete or s.status == "complete", _interrupted)
    if not sessions:
        raise DataRefused(_nothing_left(study, left_out))
    return Choice(chosen, tuple(sessions), tuple(left_out))


def _keep(
    rows: Sequence[SessionRow],
    left_out: list[tuple[SessionRow, str]],
    counts: Callable[[SessionRow], bool],
    why: Callable[[SessionRow], str],
) -> list[SessionRow]:
    left_out.extend((session, why(session)) for session in rows if not counts(session))
    return [session for session in rows if counts(session)]


def _other_version(session: SessionRow) -> str:
    return f"made with another version of the study ({session.study_digest[:12]})"


def _other_kind(session: SessionRow) -> str:
    return "a simulated session" if session.simulated else "a real session, only simulated ones were asked for"


def _unwanted(session: SessionRow) -> str:
    why = {"withdrawn": "withdrew", "declined": "declined to take part", "ineligible": "was not eligible"}
    return f"the participant {why[session.status]}"


def _interrupted(session: SessionRow) -> str:
    return f"{session.status} after {session.trials_answered} of {session.trials_planned} trials"


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


def _real_or_simulated(rows: Sequence[SessionRow], study: str, simulated: bool | None) -> bool:
    made_up = sum(bool(session.simulated) for session in rows)
    if simulated is not None:
        return simulated
    if 0 < made_up < len(rows):
        raise DataRefused(
            f"study {study!r}: {made_up} simulated and {len(rows) - made_up} real sessions;"
            " they are not analysed together: choose with --real or --simulated (evaluate, train, textures: --sessions"
            " real or --sessions simulated)"
        )
    return made_up > 0


def _check_status(session: SessionRow) -> None:
    if session.status not in STATUSES:
        raise DataRefused(f"session {session.session}: status {session.status!r}; {nearest(session.status, STATUSES)}")


def _nothing_left(study: str, left_out: Sequence[tuple[SessionRow, str]]) -> str:
    reasons = some((f"{session.participant}: {why}" for session, why in left_out), 5, "; ")
    return f"study {study!r}: no session is left to analyse ({reasons})"
