"""Which sessions of a study are analysed, and why the others are not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

from palpate.analysis.ratings.dataset import DataRefused
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count, some

STATUSES = ("complete", "interrupted", "aborted", "declined", "ineligible", "withdrawn")
NEVER = {"withdrawn": "withdrew", "declined": "declined to take part", "ineligible": "was not eligible"}
"""States of sessions that never count, and what is said of their participants."""
OTHER_KIND = {True: "a simulated session", False: "a real session, only simulated ones were asked for"}
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

    def keep(
        sessions: Sequence[SessionRow], counts: Callable[[SessionRow], bool], why: Callable[[SessionRow], str]
    ) -> list[SessionRow]:
        left_out.extend((session, why(session)) for session in sessions if not counts(session))
        return [session for session in sessions if counts(session)]

    other = "made with another version of the study"
    sessions = keep(rows, lambda s: s.study_digest == chosen, lambda s: f"{other} ({s.study_digest[:12]})")
    choice = _real_or_simulated(sessions, study, simulated)
    sessions = keep(sessions, lambda s: bool(s.simulated) == choice, lambda s: OTHER_KIND[bool(s.simulated)])
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
