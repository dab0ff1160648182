"""The ratings of a study, read from a collected database: which of its sessions are analysed, and their answers.

One session file and a whole lab take the same path.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd
from sqlalchemy import Connection, Engine, text
from sqlalchemy.exc import SQLAlchemyError

from palpate.analysis.ratings.dataset import (
    RESERVED,
    Crossing,
    DataRefused,
    Exclusion,
    Input,
    Ratings,
    Scale,
    crossed_columns,
    levels_of,
)
from palpate.analysis.ratings.sample import DoneSession, achieved_sample
from palpate.protocols.canonical import parse
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.forms import own_tables
from palpate.protocols.study import Study
from palpate.protocols.tasks import TASKS, gives_ratings
from palpate.protocols.wording import count, some
from palpate.studies.messages import database_reason, describe_url

__all__ = ["Crossing", "DataRefused", "Exclusion", "Input", "Ratings", "Scale", "read_ratings"]

SOURCE = "source"
"""The column of a stimulus table that says whether a stimulus was measured or simulated."""

_SESSIONS = text(
    "SELECT session, study_digest, participant, group_name, seed, simulated, status, trials_planned, trials_answered,"
    " head_hash, file, file_sha256, number, duration_s FROM sessions WHERE study = :study ORDER BY participant, session"
)
_RATINGS = text(
    "SELECT session, participant, group_name, trial, block, practice, stimulus, attribute, value,"
    " response_time_s, revised FROM ratings WHERE study = :study ORDER BY participant, session, trial"
)
STATUSES = ("complete", "interrupted", "aborted", "declined", "ineligible", "withdrawn")
NEVER = {"withdrawn": "withdrew", "declined": "declined to take part", "ineligible": "was not eligible"}
"""States of sessions that never count, and what is said of their participants."""
OTHER_KIND = {True: "a simulated session", False: "a real session, only simulated ones were requested"}
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


@dataclass(frozen=True, slots=True)
class Rating:
    """A row of the view `ratings`: the counting answer to one attribute in one trial."""

    session: str
    participant: str
    group_name: str | None
    trial: int
    block: int | str | None
    practice: bool
    stimulus: str
    attribute: str
    value: Any
    response_time_s: float | None
    revised: bool


def read_ratings(
    source: Engine | Connection,
    study: str,
    *,
    digest: str | None = None,
    include_incomplete: bool = False,
    simulated: bool | None = None,
    withdrawn: Collection[str] = (),
) -> Ratings:
    """Return the ratings of `study` without practice trials; without interrupted sessions, too, by default.

    Every session and practice trial left out has a line in `exclusions`. `digest` (or its beginning) chooses one
    version of a study that was changed between participants; `simulated` keeps only simulated or only real
    sessions where there are both. Nobody in `withdrawn` is among them, whatever the database says of their sessions.
    Raises DataRefused where either is needed and not given, where the database is
    not a collected one, holds no such study or no session to analyse, and where an answer is no number.
    """
    with nullcontext(source) if isinstance(source, Connection) else source.connect() as connection:
        definition, choice = chosen(
            connection, study, digest=digest, include_incomplete=include_incomplete, simulated=simulated,
            withdrawn=withdrawn,
        )  # fmt: skip
        ratings = [Rating(*row) for _, row in _rows(connection, _RATINGS, study)]
    return assembled(definition, choice, ratings)


def chosen(
    connection: Connection, study: str, *, digest: str | None, include_incomplete: bool, simulated: bool | None,
    withdrawn: Collection[str] = (),
) -> tuple[Study, Choice]:  # fmt: skip
    """Return the version of the study that is analysed, and which of its sessions are. Raises DataRefused as above."""
    rows = [SessionRow(**row) for row in query(connection, _SESSIONS, study)]
    if not rows:
        known = [row["study"] for row in query(connection, text("SELECT DISTINCT study FROM sessions"), study)]
        raise DataRefused(
            f"no session of study {study!r} is collected; {nearest(study, sorted(known))}"
            if known
            else "the collected database holds no session; collect the session files first"
        )
    choice = choose_sessions(rows, study, digest, include_incomplete, simulated, withdrawn)
    return _definition(connection, study, choice.digest), choice


def choose_sessions(
    rows: Sequence[SessionRow], study: str, digest: str | None, include_incomplete: bool, simulated: bool | None,
    withdrawn: Collection[str] = (),
) -> Choice:  # fmt: skip
    """Return the sessions of one version of the study, all real or all simulated, only complete ones by default.

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
    """Yield the rows of the statement by the names of its columns; equal texts are one object."""
    for names, row in _rows(connection, statement, study):
        yield dict(zip(names, row, strict=True))


def _rows(connection: Connection, statement: Any, study: str) -> Iterator[tuple[tuple[str, ...], list[Any]]]:
    """Yield the names of the columns, and a row; equal texts are one object, as a large study repeats its names."""
    texts: dict[str, str] = {}
    try:
        result = connection.execute(statement, {"study": study})
        names = tuple(result.keys())
        for row in result:
            yield names, [texts.setdefault(cell, cell) if type(cell) is str else cell for cell in row]
    except SQLAlchemyError as error:
        where, why = describe_url(connection.engine.url), database_reason(error)
        raise DataRefused(f"{where}: not a collected database ({why}); make one with: palpate collect") from None


def _definition(connection: Connection, study: str, digest: str) -> Study:
    """Return one version of the study as it is stored. Raises DataRefused where it is missing or cannot be read."""
    rows = query(connection, text("SELECT study_digest, definition FROM studies WHERE study = :study"), study)
    stored = next((row["definition"] for row in rows if row["study_digest"] == digest), None)
    if stored is None:
        raise DataRefused(f"study {study!r}: its definition {digest[:12]} is not in the database; collect again")
    definition = parse(stored.encode()) if isinstance(stored, str) else stored
    try:
        return Study.model_validate(definition)
    except ValueError as error:
        lines = str(error).splitlines()
        raise DataRefused(f"study {study!r}: the stored definition cannot be read: {' '.join(lines[1:3])}") from None


def assembled(study: Study, choice: Choice, ratings: Sequence[Rating]) -> Ratings:
    """Return the ratings of these sessions, wherever their rows come from. Raises DataRefused as `read_ratings`."""
    if not gives_ratings(study):
        own = own_tables().get(TASKS[study.task].answers)
        where = "tables words, answers and streams" if own is None else f"table {own.name}"
        raise DataRefused(
            f"study {study.study!r}: its task is {study.task}, which gives no ratings; its answers are in the"
            f" {where} of the collected database"
        )
    sessions = {session.session for session in choice.kept}
    counted = [rating for rating in ratings if rating.session in sessions and not rating.practice]
    within, crossings = _factors(study)
    stimuli = {rating.stimulus for rating in counted}
    columns = [stimulus.columns for stimulus in study.stimuli if stimulus.id in stimuli]
    has_sources = all(SOURCE in own for own in columns)
    return Ratings(
        name=study.study,
        table=_table(study, counted, [rating for rating in ratings if rating.session in sessions]),
        within=within,
        between=("group",) if len({session.group_name for session in choice.kept}) > 1 else (),
        attributes=tuple(attribute.name for attribute in study.attributes),
        scale=None if study.scale is None else Scale(study.scale.low, study.scale.high, study.scale.step),
        inputs=inputs_of(study, choice),
        exclusions=(*left_out_sessions(choice, ratings), *_other_exclusions(choice, ratings)),
        antonyms={a.name: a.high for a in study.attributes if a.outcome is None},
        categories={a.name: a.category for a in study.attributes if a.category is not None},
        crossings=crossings,
        repeats=study.order.repeats,
        sessions=study.sessions,
        pooled=column_name((study.analysis and study.analysis.pooled) or ""),
        families=column_name((study.analysis and study.analysis.families) or ""),
        simulated=any(session.simulated for session in choice.kept),
        interrupted=tuple(
            f"{session.participant}, session {session.session}: {session.trials_answered} of"
            f" {session.trials_planned} trials"
            for session in choice.kept
            if session.status != "complete"
        ),
        seeds=tuple(sorted({session.seed for session in choice.kept if session.simulated})),
        stimulus_sources=dict(Counter(own[SOURCE] for own in columns)) if has_sources else {},
        sample=collected_sample(study, choice.kept),
    )


def column_name(stimulus_column: str) -> str:
    """Return the table's name for a column of the stimulus table: its own, unless that name has another meaning."""
    return f"stimulus.{stimulus_column}" if stimulus_column in RESERVED else stimulus_column


def _factors(study: Study) -> tuple[tuple[str, ...], tuple[Crossing, ...]]:
    """Return the within factors, and the cells that are expected of each group."""
    groups = {group: [s.columns for s in study.stimuli_of(group)] for group in (study.groups or [None])}
    named = study.analysis.within if study.analysis is not None else ()
    for name in named:
        if any(name not in stimulus.columns for stimulus in study.stimuli):
            raise DataRefused(f"study {study.study!r}: not every stimulus has the within factor {name!r}")
    crossed = crossed_columns(list(groups.values()), only=named)
    crossings = []
    for group, stimuli in groups.items():
        levels = {column_name(c): ls for c, ls in levels_of(crossed, stimuli).items()}
        if not crossed:
            levels = {"stimulus": tuple(s.id for s in study.stimuli_of(group))}
        crossings.append(Crossing({"group": group} if len(groups) > 1 and group else {}, levels))
    within = tuple(column_name(name) for name in named or crossed) or ("stimulus",)
    return within, tuple(crossings)


def _table(study: Study, counted: Sequence[Rating], ratings: Sequence[Rating]) -> pd.DataFrame:
    """Return the long table of the ratings that count. Raises DataRefused where one of `ratings` is foreign to it."""
    order = {attribute.name: place for place, attribute in enumerate(study.attributes)}
    stimuli = {stimulus.id: stimulus.columns for stimulus in study.stimuli}
    for rating in ratings:
        for what, name, known in (("attribute", rating.attribute, order), ("stimulus", rating.stimulus, stimuli)):
            if name not in known:
                raise DataRefused(
                    f"session {rating.session}, trial {rating.trial}: {what} {name!r} is not in the study;"
                    f" {nearest(name, known)}"
                )
    rows = sorted(counted, key=lambda r: (r.participant, r.session, r.trial, order[r.attribute]))
    shared = [name for name in study.stimuli[0].columns if all(name in columns for columns in stimuli.values())]
    return pd.DataFrame(
        {
            "participant": [r.participant for r in rows],
            "attribute": [r.attribute for r in rows],
            "value": pd.Series([_number(r) for r in rows], dtype="float64"),
            "group": [r.group_name or "" for r in rows],
            **{column_name(name): [stimuli[r.stimulus][name] for r in rows] for name in shared},
            "study": [study.study for _ in rows],
            "session": [r.session for r in rows],
            "trial": [r.trial for r in rows],
            "block": ["" if r.block is None else str(r.block) for r in rows],
            "stimulus": [r.stimulus for r in rows],
            "response_time_s": pd.Series([r.response_time_s for r in rows], dtype="float64"),
            "revised": pd.Series([bool(r.revised) for r in rows], dtype="bool"),
        }
    )


def _number(rating: Rating) -> float:
    if rating.value is None:
        return float("nan")
    if isinstance(rating.value, bool) or not isinstance(rating.value, int | float):
        raise DataRefused(
            f"session {rating.session}, trial {rating.trial}: {rating.attribute} was answered with"
            f" {rating.value!r}, a number is expected: these answers are not ratings"
        )
    return float(rating.value)


def inputs_of(study: Study, choice: Choice) -> tuple[Input, ...]:
    """Return the study and every session file, kept or left out, by their SHA-256."""
    sessions = (*choice.kept, *(session for session, _ in choice.left_out))
    return (
        Input(f"study {study.study}", choice.digest, "the compiled study"),
        *(Input(s.file, s.file_sha256, f"session {s.session}, last event {s.head_hash}") for s in sessions),
    )


def left_out_sessions(choice: Choice, ratings: Sequence[Rating] = ()) -> tuple[Exclusion, ...]:
    """Return a line for every session that is not analysed, with how many of these ratings it has."""
    rows = Counter(rating.session for rating in ratings if not rating.practice)
    return tuple(
        Exclusion("session", f"{session.participant}, session {session.session}", why, rows[session.session])
        for session, why in choice.left_out
    )


def _other_exclusions(choice: Choice, ratings: Sequence[Rating]) -> Iterator[Exclusion]:
    """Yield a line for each analysed session without a rating, which no row of the table shows, and for practice."""
    rated = {rating.session for rating in ratings if not rating.practice}
    sessions = {session.session for session in choice.kept}
    for session in choice.kept:
        if session.session not in rated:
            yield Exclusion("session", f"{session.participant}, session {session.session}", "holds no rating", 0)
    practised = Counter(
        (rating.participant, rating.session) for rating in ratings if rating.practice and rating.session in sessions
    )
    for (participant, name), rows in practised.items():
        yield Exclusion("practice", f"{participant}, session {name}", "practice trials do not count", rows)


def collected_sample(study: Study, sessions: Iterable[SessionRow]) -> dict[str, Any]:
    """Return what was planned and what came of it in collected sessions; only complete ones are done."""
    complete = [session for session in sessions if session.status == "complete"]
    return achieved_sample(
        study, [DoneSession(s.participant, s.group_name, s.number, s.duration_s / 60) for s in complete]
    )
