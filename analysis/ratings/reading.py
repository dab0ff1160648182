"""The ratings of a study, read from a collected database: one path for one session file and for a whole lab."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import combinations
from math import prod
from typing import Any

import pandas as pd
from sqlalchemy import Connection, Engine, text
from sqlalchemy.exc import SQLAlchemyError

from palpate.analysis.ratings.collected_sessions import Choice, SessionRow, choose_sessions
from palpate.analysis.ratings.column_names import RESERVED
from palpate.analysis.ratings.dataset import Crossing, DataRefused, Exclusion, Input, Ratings, Scale
from palpate.analysis.ratings.sample import collected_sample
from palpate.protocols.canonical import parse
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.study import Study
from palpate.studies.messages import database_reason, describe_url

__all__ = ["Crossing", "DataRefused", "Exclusion", "Input", "Ratings", "Scale", "read_ratings"]

SOURCE = "source"
"""The column of a stimulus table that says whether a stimulus was measured or simulated."""
Columns = Mapping[str, str]

_SESSIONS = text(
    "SELECT session, study_digest, participant, group_name, seed, simulated, status, trials_planned, trials_answered,"
    " head_hash, file, file_sha256, number, duration_s FROM sessions WHERE study = :study ORDER BY participant, session"
)
_RATINGS = text(
    "SELECT session, participant, group_name, trial, block, practice, stimulus, attribute, value,"
    " response_time_s, revised FROM ratings WHERE study = :study ORDER BY participant, session, trial"
)


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
    """Return the ratings of `study`, without practice trials and, unless told, without interrupted sessions.

    Every session and practice trial left out has a line in `exclusions`. `digest` (or its beginning) chooses one
    version of a study that was changed between participants; `simulated` keeps only simulated or only real
    sessions where there are both. Nobody in `withdrawn` is among them, whatever the database says of their sessions.
    Raises DataRefused where either is needed and not given, where the database is
    not a collected one, holds no such study or no session to analyse, and where an answer is no number.
    """
    with _connected(source) as connection:
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
        raise DataRefused(_no_sessions(connection, study))
    choice = choose_sessions(rows, study, digest, include_incomplete, simulated, withdrawn)
    return _definition(connection, study, choice.digest), choice


def left_out_sessions(choice: Choice) -> tuple[Exclusion, ...]:
    """Return a line for every session that is not analysed, where the study rates nothing."""
    return tuple(
        Exclusion("session", f"{session.participant}, session {session.session}", why, 0)
        for session, why in choice.left_out
    )


@contextmanager
def _connected(source: Engine | Connection) -> Iterator[Connection]:
    if isinstance(source, Connection):
        yield source
        return
    with source.connect() as connection:
        yield connection


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


def _no_sessions(connection: Connection, study: str) -> str:
    known = [row["study"] for row in query(connection, text("SELECT DISTINCT study FROM sessions"), study)]
    if not known:
        return "the collected database holds no session; collect the session files first"
    return f"no session of study {study!r} is collected; {nearest(study, sorted(known))}"


def _definition(connection: Connection, study: str, digest: str) -> Study:
    rows = query(connection, text("SELECT study_digest, definition FROM studies WHERE study = :study"), study)
    for row in rows:
        if row["study_digest"] == digest:
            stored = row["definition"]
            return _study(parse(stored.encode()) if isinstance(stored, str) else stored, study)
    raise DataRefused(f"study {study!r}: its definition {digest[:12]} is not in the database; collect again")


def _study(definition: Any, study: str) -> Study:
    try:
        return Study.model_validate(definition)
    except ValueError as error:
        lines = str(error).splitlines()
        raise DataRefused(f"study {study!r}: the stored definition cannot be read: {' '.join(lines[1:3])}") from None


def assembled(study: Study, choice: Choice, ratings: Sequence[Rating]) -> Ratings:
    """Return the ratings of these sessions, wherever their rows come from. Raises DataRefused as `read_ratings`."""
    if not study.attributes:
        raise DataRefused(
            f"study {study.study!r}: its task is {study.task}, which gives no ratings; what was answered lies in the"
            " tables words, answers and streams of the collected database"
        )
    sessions = {session.session for session in choice.kept}
    counted = [rating for rating in ratings if rating.session in sessions and not rating.practice]
    within, crossings = _factors(study)
    return Ratings(
        name=study.study,
        table=_table(study, counted, [rating for rating in ratings if rating.session in sessions]),
        within=within,
        between=("group",) if len({session.group_name for session in choice.kept}) > 1 else (),
        attributes=tuple(attribute.name for attribute in study.attributes),
        scale=None if study.scale is None else Scale(study.scale.low, study.scale.high, study.scale.step),
        inputs=inputs_of(study, choice),
        exclusions=(*_left_out(choice, ratings), *_without_ratings(choice, counted), *_practice(sessions, ratings)),
        antonyms={a.name: a.high for a in study.attributes if a.outcome is None},
        categories={a.name: a.category for a in study.attributes if a.category is not None},
        crossings=crossings,
        repeats=study.order.repeats,
        sessions=study.sessions,
        pooled=column_name((study.analysis and study.analysis.pooled) or ""),
        families=column_name((study.analysis and study.analysis.families) or ""),
        simulated=any(session.simulated for session in choice.kept),
        interrupted=tuple(_describe(session) for session in choice.kept if session.status != "complete"),
        seeds=tuple(sorted({session.seed for session in choice.kept if session.simulated})),
        stimulus_sources=_sources(study, {rating.stimulus for rating in counted}),
        sample=collected_sample(study, choice.kept),
    )


def _describe(session: SessionRow) -> str:
    answered = f"{session.trials_answered} of {session.trials_planned} trials"
    return f"{session.participant}, session {session.session}: {answered}"


def _sources(study: Study, stimuli: set[str]) -> dict[str, int]:
    """Return how many of the stimuli that were met have each value in the column `source`, where the study has one."""
    columns = [stimulus.columns for stimulus in study.stimuli if stimulus.id in stimuli]
    return dict(Counter(column[SOURCE] for column in columns)) if all(SOURCE in column for column in columns) else {}


def column_name(stimulus_column: str) -> str:
    """Return the table's name for a column of the stimulus table: its own, unless that name has another meaning."""
    return f"stimulus.{stimulus_column}" if stimulus_column in RESERVED else stimulus_column


def _factors(study: Study) -> tuple[tuple[str, ...], tuple[Crossing, ...]]:
    """Return the within factors, and the cells that each group owes."""
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
    order = {attribute.name: place for place, attribute in enumerate(study.attributes)}
    stimuli = {stimulus.id: stimulus.columns for stimulus in study.stimuli}
    for rating in ratings:
        _check(rating, order, stimuli)
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


def _check(rating: Rating, attributes: dict[str, int], stimuli: dict[str, dict[str, str]]) -> None:
    where = f"session {rating.session}, trial {rating.trial}"
    if rating.attribute not in attributes:
        raise DataRefused(
            f"{where}: attribute {rating.attribute!r} is not in the study; {nearest(rating.attribute, attributes)}"
        )
    if rating.stimulus not in stimuli:
        raise DataRefused(
            f"{where}: stimulus {rating.stimulus!r} is not in the study; {nearest(rating.stimulus, stimuli)}"
        )


def _number(rating: Rating) -> float:
    if rating.value is None:
        return float("nan")
    if isinstance(rating.value, bool) or not isinstance(rating.value, int | float):
        raise DataRefused(
            f"session {rating.session}, trial {rating.trial}: {rating.attribute} was answered with"
            f" {rating.value!r}, a number is expected: these answers are no ratings"
        )
    return float(rating.value)


def inputs_of(study: Study, choice: Choice) -> tuple[Input, ...]:
    """Return the study and every session file, kept or left out, by their SHA-256."""
    sessions = (*choice.kept, *(session for session, _ in choice.left_out))
    return (
        Input(f"study {study.study}", choice.digest, "the compiled study"),
        *(Input(s.file, s.file_sha256, f"session {s.session}, last event {s.head_hash}") for s in sessions),
    )


def _left_out(choice: Choice, ratings: Sequence[Rating]) -> Iterator[Exclusion]:
    rows = Counter(rating.session for rating in ratings if not rating.practice)
    for session, why in choice.left_out:
        yield Exclusion("session", f"{session.participant}, session {session.session}", why, rows[session.session])


def _without_ratings(choice: Choice, counted: Sequence[Rating]) -> Iterator[Exclusion]:
    """Yield a session kept but empty has no row in the table, so only this line tells of it."""
    rated = {rating.session for rating in counted}
    for session in choice.kept:
        if session.session not in rated:
            yield Exclusion("session", f"{session.participant}, session {session.session}", "holds no rating", 0)


def _practice(sessions: set[str], ratings: Sequence[Rating]) -> Iterator[Exclusion]:
    practised = Counter(
        (rating.participant, rating.session) for rating in ratings if rating.practice and rating.session in sessions
    )
    for (participant, session), rows in practised.items():
        yield Exclusion("practice", f"{participant}, session {session}", "practice trials do not count", rows)


def crossed_columns(groups: Sequence[Sequence[Columns]], only: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the largest set of columns that names every stimulus of every group by a full crossing, each cell once.

    `groups` holds, for each group of participants, the columns of the stimuli that it is given. A column with
    one level is no factor; `only`, where given, are the columns to choose from. Of two sets of one size the one
    with the earlier columns wins. Returns () where only the stimulus itself names a stimulus.
    """
    columns = [name for name in only or _shared(groups) if _may_cross(name, groups)]
    for size in range(len(columns), 0, -1):
        for chosen in combinations(columns, size):
            if all(_is_full_crossing(chosen, stimuli) for stimuli in groups):
                return chosen
    return ()


def levels_of(columns: Sequence[str], stimuli: Sequence[Columns]) -> dict[str, tuple[str, ...]]:
    """Return the levels of each column in the order in which the study lists them."""
    return {name: tuple(dict.fromkeys(stimulus[name] for stimulus in stimuli)) for name in columns}


def _shared(groups: Sequence[Sequence[Columns]]) -> list[str]:
    stimuli = [stimulus for group in groups for stimulus in group]
    if not stimuli:
        return []
    return [name for name in stimuli[0] if all(name in stimulus for stimulus in stimuli)]


def _may_cross(name: str, groups: Sequence[Sequence[Columns]]) -> bool:
    """Return whether the column has several levels in each group, and their number divides that of the stimuli."""
    counts = [(len({stimulus[name] for stimulus in group}), len(group)) for group in groups]
    return all(levels > 1 and stimuli % levels == 0 for levels, stimuli in counts)


def _is_full_crossing(columns: tuple[str, ...], stimuli: Sequence[Columns]) -> bool:
    cells = {tuple(stimulus[name] for name in columns) for stimulus in stimuli}
    full = prod(len(levels) for levels in levels_of(columns, stimuli).values())
    return len(cells) == len(stimuli) == full
