"""The answers of a study in a collected database: ratings alone, or with words, forms, trials and people."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import pandas as pd
from sqlalchemy import Connection, Engine, text

from palpate.analysis.ratings.collected_choices import TABLE as CHOICES
from palpate.analysis.ratings.collected_choices import catch_exclusions, catch_lines
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
from palpate.analysis.ratings.own_answers import counted_answers, practice_lines, read_own_answers
from palpate.analysis.ratings.people import People, people_of
from palpate.analysis.ratings.session_choice import Choice, SessionRow, chosen, collected_sample, inputs_of, query
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.extensions import is_own
from palpate.protocols.forms import own_tables
from palpate.protocols.needs import NEEDS
from palpate.protocols.study import Study
from palpate.protocols.tasks import TASKS, gives_ratings
from palpate.protocols.wording import count
from palpate.studies.sessions.model_versions import models_in

SOURCE = "source"
"""The column of a stimulus table with the origin of a stimulus: measured or simulated."""
OF_A_RATING = ("attribute", "value", "response_time_s", "revised")
"""The columns of a rating that its trial does not have."""
_NO_WORDS: Mapping[str, Any] = MappingProxyType({})
_RATINGS = text(
    "SELECT session, participant, group_name, trial, block, practice, stimulus, attribute, value,"
    " response_time_s, revised FROM ratings WHERE study = :study ORDER BY participant, session, trial"
)
_TRIALS = text(
    "SELECT trials.session, trials.trial, trials.block, trials.practice, trials.stimulus, trials.status FROM trials"
    " JOIN sessions ON sessions.session = trials.session WHERE sessions.study = :study"
)
_WORDS = text(
    "SELECT words.session, words.form, words.trial, words.kind, words.word, words.counts FROM words"
    " JOIN sessions ON sessions.session = words.session WHERE sessions.study = :study"
)
_ANSWERS = text(
    "SELECT answers.session, answers.form, answers.item, answers.kind, answers.value, answers.number FROM answers"
    " JOIN sessions ON sessions.session = answers.session WHERE sessions.study = :study"
)
_REPLIES = text(
    "SELECT events.session, events.body FROM events JOIN sessions ON sessions.session = events.session"
    " WHERE sessions.study = :study AND events.kind = 'reply'"
)


@dataclass(frozen=True, slots=True)
class Rating:
    """A row of the view `ratings`: the answer that counts to one attribute in one trial."""

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
    """Return the ratings of `study` without practice trials, and by default without interrupted sessions.

    Every session and practice trial left out has a line in `exclusions`. `digest` (or its beginning) chooses one
    version of a study that was changed between participants; `simulated` keeps only simulated or only real sessions
    where there are both. People in `withdrawn` are left out, whatever the database says about their sessions. Raises
    DataRefused if either is needed and not given, if the database is not a collected one, has no such study or no
    session to analyse, and for an answer that is no number.
    """
    with nullcontext(source) if isinstance(source, Connection) else source.connect() as connection:
        definition, choice = chosen(
            connection, study, digest=digest, include_incomplete=include_incomplete, simulated=simulated,
            withdrawn=withdrawn,
        )  # fmt: skip
        ratings = [Rating(**row) for row in query(connection, _RATINGS, study)]
    return assembled(definition, choice, ratings)


def assembled(study: Study, choice: Choice, ratings: Sequence[Rating]) -> Ratings:
    """Return the ratings of these sessions, whatever the source of the rows.

    Raises DataRefused as `read_ratings` does.
    """
    if not gives_ratings(study):
        own = own_tables().get(TASKS[study.task].answers)
        where = "tables words, answers and streams" if own is None else f"table {own.name}"
        raise DataRefused(
            f"study {study.study!r}: its task is {study.task}, which gives no ratings; its answers are in the"
            f" {where} of the collected database; an analysis.yaml asks about them: palpate regenerate {study.study}"
        )
    sessions = {session.session for session in choice.sessions}
    counted = [rating for rating in ratings if rating.session in sessions and not rating.practice]
    within, crossings = _factors(study)
    stimuli = {rating.stimulus for rating in counted}
    columns = [stimulus.columns for stimulus in study.stimuli if stimulus.id in stimuli]
    has_sources = all(SOURCE in own for own in columns)
    return Ratings(
        name=study.study,
        table=_table(study, counted, [rating for rating in ratings if rating.session in sessions]),
        within=within,
        between=("group",) if len({session.group_name for session in choice.sessions}) > 1 else (),
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
        simulated=any(session.simulated for session in choice.sessions),
        interrupted=tuple(
            f"{session.participant}, session {session.session}: {session.trials_answered} of"
            f" {session.trials_planned} trials"
            for session in choice.sessions
            if session.status != "complete"
        ),
        seeds=tuple(sorted({session.seed for session in choice.sessions if session.simulated})),
        stimulus_sources=dict(Counter(own[SOURCE] for own in columns)) if has_sources else {},
        sample=collected_sample(study, choice.sessions),
    )


def column_name(stimulus_column: str) -> str:
    """Return the table's name for a column of the stimulus table: its own, unless that is reserved."""
    return f"stimulus.{stimulus_column}" if stimulus_column in RESERVED else stimulus_column


def _factors(study: Study) -> tuple[tuple[str, ...], tuple[Crossing, ...]]:
    """Return the within factors, and the cells expected of each group."""
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
    """Return the long table of the ratings that count. Raises DataRefused if one of `ratings` does not belong to it."""
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
    for r in rows:
        if r.value is not None and (isinstance(r.value, bool) or not isinstance(r.value, int | float)):
            raise DataRefused(
                f"session {r.session}, trial {r.trial}: {r.attribute} was answered with"
                f" {r.value!r}, a number is expected: these answers are not ratings"
            )
    return pd.DataFrame(
        {
            "participant": [r.participant for r in rows],
            "attribute": [r.attribute for r in rows],
            "value": pd.Series([r.value for r in rows], dtype="float64"),
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


def left_out_sessions(choice: Choice, ratings: Sequence[Rating] = ()) -> tuple[Exclusion, ...]:
    """Return a line for every session that is not analysed, with how many of these ratings it has."""
    rows = Counter(rating.session for rating in ratings if not rating.practice)
    return tuple(
        Exclusion("session", f"{session.participant}, session {session.session}", why, rows[session.session])
        for session, why in choice.left_out
    )


def _other_exclusions(choice: Choice, ratings: Sequence[Rating]) -> Iterator[Exclusion]:
    """Yield a line for each analysed session without a rating, which is in no row of the table, and for practice."""
    rated = {rating.session for rating in ratings if not rating.practice}
    sessions = {session.session for session in choice.sessions}
    for session in choice.sessions:
        if session.session not in rated:
            yield Exclusion("session", f"{session.participant}, session {session.session}", "holds no rating", 0)
    practised = Counter(
        (rating.participant, rating.session) for rating in ratings if rating.practice and rating.session in sessions
    )
    for (participant, name), rows in practised.items():
        yield Exclusion("practice", f"{participant}, session {name}", "practice trials do not count", rows)


@dataclass(frozen=True)
class Material:
    """The answers of one version of a study, without practice trials.

    `ratings` is None for a study that rates nothing. `trials` has one row per answered trial; `words` one per word of
    an answer that counts; `forms` one per answered item of a form (questionnaire, demographics). All three have
    participant, session and group; trials and words also trial, stimulus and the stimulus columns. `planned` counts the
    trials of each session that were to be answered. `levels` maps each of these columns to its levels in the study's
    order. `study` is None for an imported data set. `people` are the answers about themselves that may be columns,
    `sessions` those that count.
    """

    name: str
    title: str
    study: Study | None
    ratings: Ratings | None
    trials: pd.DataFrame
    words: pd.DataFrame
    forms: pd.DataFrame
    planned: Mapping[str, int]
    simulated: bool
    seeds: tuple[int, ...]
    inputs: tuple[Input, ...]
    exclusions: tuple[Exclusion, ...]
    levels: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: _NO_WORDS)
    people: People = field(default_factory=People)
    sessions: tuple[SessionRow, ...] = ()
    own: Mapping[str, pd.DataFrame] = field(default_factory=lambda: _NO_WORDS)
    """The answers that count in each table that the study's form brings of its own, the one with its answers first."""
    versions: tuple[Input, ...] = ()
    """The versions of the study or of a model, if sessions had different ones, with the numbers of their sessions."""

    def filtered(self, stays: Callable[[pd.DataFrame], Any]) -> Material:
        """Return the material with the rows of each table for which `stays(table)` is true."""

        def part(table: pd.DataFrame) -> pd.DataFrame:
            return table[stays(table)].reset_index(drop=True) if len(table) else table

        ratings = self.ratings
        return replace(
            self,
            ratings=None if ratings is None else replace(ratings, table=part(ratings.table)),
            trials=part(self.trials),
            words=part(self.words),
            forms=part(self.forms),
            own={name: part(table) for name, table in self.own.items()},
        )

    @property
    def choices(self) -> pd.DataFrame:
        """One row for each choice that counts, catch trials among them; empty where the study has none."""
        return self.own.get(CHOICES, pd.DataFrame())

    @property
    def participants(self) -> tuple[str, ...]:
        """Everyone with an answered trial or form, in the order of their pseudonyms."""
        return tuple(sorted({*self.trials["participant"], *self.forms["participant"]}))


def read_material(
    engine: Engine, name: str, *, digest: str | None, include_incomplete: bool, simulated: bool | None,
    withdrawn: Collection[str] = (),
) -> Material:  # fmt: skip
    """Return the material of a study in a collected database. Raises as `read_ratings` does."""
    options: dict[str, Any] = {
        "digest": digest, "include_incomplete": include_incomplete, "simulated": simulated, "withdrawn": withdrawn,
    }  # fmt: skip
    with engine.connect() as connection:
        study, choice = chosen(connection, name, **options)
        ratings = read_ratings(connection, name, **options) if gives_ratings(study) else None
        rows = CollectedRows(
            trials=_rows(connection, _TRIALS, study, choice),
            words=_rows(connection, _WORDS, study, choice),
            answers=_rows(connection, _ANSWERS, study, choice),
            own=read_own_answers(connection, study, choice),
        )
        versions = tuple(_versions(connection, study, choice))
    return replace(material_of(study, choice, ratings, rows), versions=versions)


def _versions(connection: Connection, study: Study, choice: Choice) -> Iterator[Input]:
    """Yield the versions of the study and of each model, if the sample has several, with the numbers of their sessions.

    Only one version of the study is analysed, with whatever models its sessions had.
    """
    sessions = (*choice.sessions, *(session for session, _ in choice.left_out))
    counts = Counter(session.study_digest for session in sessions)
    for digest, number in sorted(counts.items()) if len(counts) > 1 else ():
        left_out = "" if digest == choice.digest else ", left out"
        yield Input(f"study {study.study}", digest, f"{count(number, 'session')}{left_out}")
    if not any(NEEDS[need].plays_models for need in study.needs if not is_own(need)):
        return
    counted = {session.session for session in choice.sessions}
    played: dict[str, dict[str, set[str]]] = {}
    for session, body in connection.execute(_REPLIES, {"study": study.study}):
        for name, sha256 in models_in(json.loads(body)) if session in counted else ():
            played.setdefault(name, {}).setdefault(sha256, set()).add(session)
    for name, versions in sorted(played.items()):
        for sha256, own in sorted(versions.items()) if len(versions) > 1 else ():
            yield Input(f"model {name}", sha256, count(len(own), "session"))


@dataclass(frozen=True)
class CollectedRows:
    """Rows of the collected tables trials, words, answers, and of forms' own, each with participant and group."""

    trials: list[dict[str, Any]]
    words: list[dict[str, Any]]
    answers: list[dict[str, Any]]
    own: Mapping[str, list[dict[str, Any]]] = field(default_factory=lambda: _NO_WORDS)


def material_of(study: Study, choice: Choice, ratings: Ratings | None, rows: CollectedRows) -> Material:
    """Return the material of these sessions, whatever the source of the rows."""
    trials = _trials(rows.trials, study)
    words = _words(rows.words, trials)
    forms = _forms(rows.answers)
    stimuli, declared = stimulus_table(study), own_tables()
    practice = practice_lines(next(iter(rows.own.values()), ()))
    material = Material(
        name=study.study,
        title=study.title or study.study,
        study=study,
        ratings=ratings,
        trials=trials,
        words=words,
        forms=forms,
        planned=Counter(row["session"] for row in rows.trials if not row["practice"]),
        simulated=any(session.simulated for session in choice.sessions),
        seeds=tuple(sorted({session.seed for session in choice.sessions if session.simulated})),
        inputs=inputs_of(study, choice),
        exclusions=(
            *(ratings.exclusions if ratings is not None else left_out_sessions(choice)),
            *practice,
            *catch_lines(rows.own.get(CHOICES, ())),
        ),
        levels=study_levels(study, trials),
        people=people_of(rows.answers),
        sessions=choice.sessions,
        own={name: counted_answers(own, declared[name], trials, stimuli) for name, own in rows.own.items()},
    )
    inattentive = catch_exclusions(study, material.choices)
    return _without(material, inattentive) if inattentive else material


def _without(material: Material, lines: Sequence[Exclusion]) -> Material:
    """Return the material without the participants of these lines."""
    people = {line.who for line in lines}
    rest = material.filtered(lambda table: ~table["participant"].isin(people))
    return replace(rest, exclusions=(*material.exclusions, *lines))


def imported_material(ratings: Ratings, title: str) -> Material:
    """Return the material of an imported data set: its ratings; a trial is one participant's row of them."""
    others = [column for column in ratings.table.columns if column not in OF_A_RATING]
    trials = ratings.table[others].drop_duplicates().reset_index(drop=True)
    columns = (*ratings.within, *ratings.between)
    levels = {column: ratings.levels(column) for column in ("participant", "attribute", *columns)}
    return Material(
        name=ratings.name,
        title=title or ratings.name,
        study=None,
        ratings=ratings,
        trials=trials,
        words=pd.DataFrame(columns=["participant", "word"]),
        forms=pd.DataFrame(columns=["participant", "attribute", "value"]),
        planned={},
        simulated=ratings.simulated,
        seeds=ratings.seeds,
        inputs=ratings.inputs,
        exclusions=ratings.exclusions,
        levels=levels,
    )


def study_levels(study: Study, trials: pd.DataFrame) -> dict[str, tuple[str, ...]]:
    """Return the levels of every text column in the study's order."""
    levels: dict[str, tuple[str, ...]] = {"stimulus": tuple(stimulus.id for stimulus in study.stimuli)}
    for name in study.stimuli[0].columns if study.stimuli else ():
        listed = dict.fromkeys(stimulus.columns.get(name, "") for stimulus in study.stimuli)
        levels[column_name(name)] = tuple(listed)
    levels["group"] = tuple(study.groups) or ("",)
    items = study.questionnaire.items if study.questionnaire is not None else ()
    levels["attribute"] = (*(attribute.name for attribute in study.attributes), *(item.name for item in items))
    levels["participant"] = tuple(sorted(set(trials["participant"])))
    return levels


def _rows(connection: Connection, statement: Any, study: Study, choice: Choice) -> list[dict[str, Any]]:
    """Return the statement's rows of the sessions that count, with participant and group."""
    sessions = {session.session: session for session in choice.sessions}
    rows = query(connection, statement, study.study)
    return [
        {"participant": sessions[row["session"]].participant, "group": sessions[row["session"]].group_name or "", **row}
        for row in rows
        if row["session"] in sessions
    ]


def stimulus_table(study: Study) -> pd.DataFrame:
    """Return the stimuli of a study with their columns as they are named in tables of answers."""
    names = list(study.stimuli[0].columns if study.stimuli else ())
    rows = [{column_name(name): stimulus.columns.get(name) for name in names} for stimulus in study.stimuli]
    table = pd.DataFrame(rows, columns=[column_name(name) for name in names])
    table.insert(0, "stimulus", [stimulus.id for stimulus in study.stimuli])
    return table


def _trials(answered: Sequence[Mapping[str, Any]], study: Study) -> pd.DataFrame:
    columns = {stimulus.id: {column_name(k): v for k, v in stimulus.columns.items()} for stimulus in study.stimuli}
    rows = [
        {key: row[key] for key in ("participant", "session", "group", "trial", "block", "stimulus")}
        | columns.get(row["stimulus"], {})
        for row in answered
        if not row["practice"] and row["status"] in ("answered", "captured")
    ]
    own = [column_name(name) for name in (study.stimuli[0].columns if study.stimuli else ())]
    head = ["participant", "session", "group", "trial", "block", "stimulus", *own]
    return _sorted(rows, head, ("participant", "session", "trial"))


def _words(written: Sequence[Mapping[str, Any]], trials: pd.DataFrame) -> pd.DataFrame:
    """Return the words of answers that count; a word without a trial (a closing suggestion) has an empty stimulus."""
    keys = zip(trials["session"], trials["trial"], strict=True) if written else ()
    records = trials.to_dict("records") if written else ()
    of_trial: dict[Any, dict[Any, Any]] = dict(zip(keys, records, strict=True))
    rows = []
    for row in written:
        own_trial = of_trial.get((row["session"], row["trial"]))
        if row["counts"] and (own_trial is not None or row["trial"] is None):
            rows.append(
                {**(own_trial or {}), **{k: row[k] for k in ("participant", "session", "group", "kind", "word")}}
            )
    head = [*trials.columns, "kind", "word"]
    table = _sorted(rows, head, ("participant", "session", "trial", "kind", "word"))
    numbers = [None if pd.isna(trial) else int(trial) for trial in table["trial"]]
    return table.assign(trial=pd.Series(numbers, dtype="object"))


def _forms(answers: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Return the answers outside trials, except free text of an interview, which no report repeats."""
    rows = [
        {
            **{key: row[key] for key in ("participant", "session", "group", "form")},
            **{"attribute": row["item"], "value": row["number"], "text": row["value"]},
        }
        for row in answers
        if row["form"] != "interview"
    ]
    head = ["participant", "session", "group", "form", "attribute", "value", "text"]
    return _sorted(rows, head, ("participant", "session", "form", "attribute")).astype({"value": "float64"})


def _sorted(rows: Sequence[Mapping[str, Any]], head: Sequence[str], by: Sequence[str]) -> pd.DataFrame:
    table = pd.DataFrame(list(rows), columns=list(head))
    for name in head:
        if name in ("stimulus", "block", "group", "kind"):
            table[name] = table[name].fillna("").astype(str)
    return table.sort_values(list(by), kind="stable", ignore_index=True)
