"""Watching a lab: results of reading are cached, even between monitors, and only changed files are read again."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from threading import Lock
from typing import Any

from palpate.analysis.monitoring.balance_grid import Holder, StudyBalance, balance_of
from palpate.analysis.monitoring.finished import Finished, load_finished, save_finished
from palpate.analysis.monitoring.following import Followed, catch_up, follow
from palpate.analysis.monitoring.raters import Rated, rated
from palpate.analysis.monitoring.sessions import Session, session_of, status_of
from palpate.analysis.ratings.diagnostics import DiagnosticsError
from palpate.analysis.ratings.sample import DoneSession, achieved_sample
from palpate.protocols.canonical import digest
from palpate.protocols.plan import Plan
from palpate.protocols.progress import Progress
from palpate.protocols.study import Study
from palpate.studies.lab import ParticipantError
from palpate.studies.participants.allocations import Allocation, every_allocation
from palpate.studies.participants.registry import find_registry, withdrawn
from palpate.studies.sessions.ledger_state import FileState, file_state, held
from palpate.studies.sessions.record import LedgerError
from palpate.studies.sessions.replay import plan_from_header
from palpate.studies.sessions.session_files import ledgers_in, others_in
from palpate.studies.workers import map_in_order, workers_for

AGAIN_S = 5.0
"""Seconds between readings of the registry, which may be on a server."""


@dataclass(frozen=True)
class People:
    """Pseudonyms that withdrew, and the allocations by study; `problem` says why they are unknown."""

    withdrawn: frozenset[str] = frozenset()
    allocations: Mapping[str, tuple[Allocation, ...]] = field(default_factory=dict)
    problem: str | None = None
    read_at: float = float("-inf")


def read_people(lab: Path, known: People, now: float) -> People:
    """Return the people in the lab's registry, none without one; `known` if it was read a moment ago.

    If the registry cannot be read, the result is `known` with the problem.
    """
    if 0 <= now - known.read_at < AGAIN_S:
        return known
    try:
        registry = find_registry(lab)
        if registry is None:
            return People(read_at=now)
        by_study: dict[str, list[Allocation]] = {}
        for allocation in every_allocation(registry):
            by_study.setdefault(allocation.study, []).append(allocation)
        allocations = {study: tuple(own) for study, own in by_study.items()}
        return People(frozenset(withdrawn(lab)), allocations, read_at=now)
    except ParticipantError as error:
        return replace(known, problem=f"Who withdrew or holds a row may be out of date: {error}", read_at=now)


class MonitorError(ValueError):
    """The lab cannot be watched; the message says why."""


@dataclass(frozen=True)
class Refused:
    """A ledger that cannot be trusted, and the reason."""

    file: str
    reason: str


@dataclass(frozen=True)
class Snapshot:
    """The lab at one moment. `unread` ledgers are left for the next look."""

    lab: str
    at: float
    sessions: tuple[Session, ...]
    refused: tuple[Refused, ...]
    others: tuple[str, ...]
    unread: int
    balances: tuple[StudyBalance, ...]
    people_problem: str | None


@dataclass
class _Known:
    """A ledger as far as it was read, its plan, and the diagnostics of its answers at that length."""

    followed: Followed
    digest: str
    plan: Plan
    rated: Rated | None = None
    rated_at: tuple[int, bool] = (-1, False)

    @property
    def order(self) -> tuple[str, ...]:
        """The stimuli of the plan, without practice."""
        return tuple(trial.stimulus.id for trial in self.plan.felt_in_trials if not trial.practice)

    def diagnosed(self, over: bool) -> Rated | None:
        at = (len(self.followed.times_ns), over)
        if self.rated_at != at:
            self.rated, self.rated_at = rated(self.followed.session, self.plan, over), at
        return self.rated


@dataclass
class _Bad:
    state: FileState
    reason: str


def _followed(path: Path) -> Followed | _Bad | None:
    """Return the ledger as far as it is readable, or the reason why it is refused; None if it is gone."""
    try:
        state = file_state(path)
        try:
            return follow(path)
        except LedgerError as error:
            return _Bad(state, str(error))
    except FileNotFoundError:
        return None


@dataclass
class Watch:
    """The cached state of a lab between looks; several threads may look."""

    lab: Path
    now: Callable[[], float] = time.time
    known: dict[Path, _Known] = field(default_factory=dict)
    finished: dict[Path, Finished] | None = None
    bad: dict[Path, _Bad] = field(default_factory=dict)
    studies: dict[str, Study] = field(default_factory=dict)
    versions: dict[str, tuple[str, Study]] = field(default_factory=dict)
    """Digest of a study in a ledger -> the digest of its conditions, which identifies it, and the study."""
    balances: dict[str, tuple[Any, StudyBalance]] = field(default_factory=dict)
    people: People = field(default_factory=People)
    looking: Lock = field(default_factory=Lock)
    progress: Progress = lambda *_: None

    def look(self, budget_s: float | None = None) -> Snapshot:
        """Return the lab as it is now; after `budget_s` seconds, new ledgers are left for later.

        Raises MonitorError if the folder does not exist.
        """
        if not self.lab.is_dir():
            raise MonitorError(f"{self.lab}: no such folder; give the lab's with --lab")
        with self.looking:
            paths = ledgers_in(self.lab)
            if self.finished is None:
                self.finished, self.studies = load_finished(self.lab, paths)
            states: dict[Path, FileState] = {}
            for path in paths:
                with suppress(FileNotFoundError):
                    states[path] = file_state(path)
            for gone in (self.known.keys() | self.bad.keys()) - states.keys():
                self.known.pop(gone, None)
                self.bad.pop(gone, None)
            self.finished = {path: one for path, one in self.finished.items() if states.get(path) == one.state}
            unread = self._read({path: at for path, at in states.items() if path not in self.finished}, budget_s)
            now = self.now()
            self.people = read_people(self.lab, self.people, now)
            sessions = tuple(self._sessions(self.finished, now))
            return Snapshot(
                lab=str(self.lab.resolve()),
                at=now,
                sessions=sessions,
                refused=tuple(Refused(path.name, bad.reason) for path, bad in sorted(self.bad.items())),
                others=tuple(path.name for path in others_in(self.lab)),
                unread=unread,
                balances=tuple(self._balances(sessions, self.finished)),
                people_problem=self.people.problem,
            )

    def _read(self, states: dict[Path, FileState], budget_s: float | None) -> int:
        """Update every ledger, growing ones first; return how many were left unread for lack of time."""
        latest_first = sorted(states, key=lambda path: states[path].changed_at, reverse=True)
        if budget_s is None:
            # Read ledgers that were never read, where they are many in several processes.
            paths = [path for path in latest_first if path not in self.known and path not in self.bad]
            with closing(map_in_order(_followed, paths, workers_for(len(paths)))) as reading:
                for done, (path, result) in enumerate(zip(paths, reading, strict=True), start=1):
                    if isinstance(result, Followed):
                        try:
                            self.known[path] = _Known(result, *self._planned(result))
                        except LedgerError as error:
                            self.bad[path] = _Bad(result.file, str(error))
                    elif result is not None:
                        self.bad[path] = result
                    self.progress(done, len(paths), "reading")
        start, unread = time.monotonic(), 0
        for path in latest_first:
            late = budget_s is not None and time.monotonic() - start > budget_s
            if late and path not in self.known and path not in self.bad:
                unread += 1
                continue
            self._bring(path)
            self.progress(len(self.known), len(states), "reading")
        return unread

    def _bring(self, path: Path) -> None:
        bad = self.bad.get(path)
        try:
            if bad is not None and bad.state == file_state(path) and "cannot be read here" not in bad.reason:
                return
            known = self.known.get(path)
            followed = follow(path) if known is None else catch_up(known.followed)
            if known is not None and followed.session is known.followed.session:
                known.followed = followed
            else:  # It is read for the first time, or another session lies there now.
                self.known[path] = _Known(followed, *self._planned(followed))
            self.bad.pop(path, None)
        except FileNotFoundError:
            self.known.pop(path, None)
            self.bad.pop(path, None)
        except LedgerError as error:
            self.known.pop(path, None)
            self.bad[path] = _Bad(file_state(path), str(error))

    def _planned(self, followed: Followed) -> tuple[str, Plan]:
        """Return the digest of the study's conditions and the session's plan.

        Raises LedgerError on what this version cannot compile.
        """
        header = followed.session.header
        try:
            definition = digest(header["study"])
            if definition not in self.versions:
                study = Study.model_validate(header["study"])
                self.versions[definition] = digest(study.conditions()), study
            name, study = self.versions[definition]
            plan = plan_from_header(header, study)
            self.studies[name] = study  # of one version the sample that was read last
        except (KeyError, TypeError, ValueError) as error:
            raise LedgerError(
                f"{followed.path}: its first event declares no session that this version reads: {error}"
            ) from None
        order = {trial.number: trial.stimulus.id for trial in plan.trials}
        if any(order.get(attempt.trial) != attempt.stimulus for attempt in followed.session.attempts):
            raise LedgerError(f"{followed.path}: the recorded study now compiles to another order of trials")
        return name, plan

    def _sessions(self, finished: dict[Path, Finished], now: float) -> Iterator[Session]:
        before, studies = set(finished), {one.session.digest for one in finished.values()}
        for path in sorted(self.known.keys() | finished.keys()):
            if path not in finished:
                session = self._session(path, finished, now)
            elif (session := finished[path].session).participant in self.people.withdrawn:
                session = replace(session, withdrawn=True, rated=None)
            if session is not None:
                yield session
        new = [one for path, one in finished.items() if path not in before]
        if new:
            versions = {one.session.digest for one in new} - studies
            save_finished(self.lab, new, {digest: self.studies[digest] for digest in versions})

    def _session(self, path: Path, finished: dict[Path, Finished], now: float) -> Session | None:
        """Return the session in a ledger that was read; an ended one is added to `finished`."""
        known = self.known[path]
        followed, state = known.followed, known.followed.session
        might_run = state.ended is None and not followed.laid_down
        status = status_of(followed, might_run and held(path))
        withdrawn = state.header["participant"] in self.people.withdrawn
        try:
            answers = None if withdrawn else known.diagnosed(over=status == "complete")
        except DiagnosticsError as error:
            del self.known[path]
            self.bad[path] = _Bad(followed.file, f"{path}: {error}")
            return None
        session = session_of(followed, status, known.digest, answers, withdrawn, now, known.plan.study)
        if state.ended is not None and followed.laid_down and not withdrawn:
            finished[path] = Finished(followed.file, followed.head, known.order, session)
            del self.known[path]
        return session

    def _balances(self, sessions: tuple[Session, ...], finished: dict[Path, Finished]) -> Iterator[StudyBalance]:
        """Yield a balance for every version of a study, computed again only if somebody's row or status changed."""
        orders = {path.name: known.order for path, known in self.known.items()}
        orders |= {path.name: one.order for path, one in finished.items()}
        holders: dict[str, list[Holder]] = {}
        done: dict[str, list[DoneSession]] = {}
        for session in sessions:
            given = self.people.allocations.get(session.study, ())
            # A participant who withdrew or was released gave up the row.
            released = any(row.participant == session.participant and not row.holds for row in given)
            standing = "withdrawn" if session.withdrawn else "released" if released else session.status
            order = orders[session.file]
            several = self.studies[session.digest].sessions > 1 or session.number > 1
            number = session.number if several else None
            holder = Holder(session.participant, session.group, session.row, standing, order, number)
            holders.setdefault(session.digest, []).append(holder)
            if session.status == "complete" and not session.withdrawn:
                one = DoneSession(session.participant, session.group, session.number, session.elapsed_s / 60)
                done.setdefault(session.digest, []).append(one)
        for name, with_session in holders.items():
            study = self.studies[name]
            started = {holder.participant for holder in with_session}
            without_session = [
                Holder(allocation.participant, allocation.group, allocation.row, "allocated")
                for allocation in self.people.allocations.get(study.study, ())
                if allocation.holds and allocation.participant not in started
            ]
            everybody = (*with_session, *without_session)
            sample = achieved_sample(study, done.get(name, ()))
            if name not in self.balances or self.balances[name][0] != (everybody, sample):
                self.balances[name] = (everybody, sample), balance_of(study, name, everybody, sample)
            yield self.balances[name][1]
