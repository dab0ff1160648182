"""What the sessions of a study hold for an analysis: ratings, words, forms and trials as tables, and the people.

What participants answered about themselves may be columns: closed questions only, never free text.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import pandas as pd
from sqlalchemy import Connection, Engine, text

from palpate.analysis.ratings.dataset import DataRefused, Exclusion, Input, Ratings
from palpate.analysis.ratings.reading import (
    Choice,
    SessionRow,
    chosen,
    column_name,
    inputs_of,
    left_out_sessions,
    query,
    read_ratings,
)
from palpate.protocols.needs import NEEDS
from palpate.protocols.study import Study
from palpate.protocols.tasks import gives_ratings
from palpate.protocols.wording import count
from palpate.studies.sessions.model_versions import models_in
from palpate.studies.sessions.tables import session_number

SESSION = "session"
ANSWER = "answer."
"""What may stand before a question's name, and must where a column of the stimuli has the same."""
CLOSED = ("number", "choice", "points")
"""Kinds of answers that may be columns: to questions with a number or a choice, and to items of a questionnaire."""


@dataclass(frozen=True)
class People:
    """`answers`: question or item -> participant -> the last answer, as text; `free`: questions answered in words."""

    answers: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    free: frozenset[str] = frozenset()

    def named(self, table: pd.DataFrame, names: Iterable[str]) -> list[str]:
        """Return which of the names are columns of people: answered questions that the table has no column for.

        Raises DataRefused on a question that was answered in the participant's own words.
        """
        new = [name for name in names if name not in table.columns]
        for name in new:
            if question_of(name) in self.free and question_of(name) not in self.answers:
                raise DataRefused(f"{name!r} was answered in the participants' own words, which no test may group by")
        return [name for name in dict.fromkeys(new) if question_of(name) in self.answers]

    def added(self, table: pd.DataFrame, names: Sequence[str]) -> pd.DataFrame:
        """Return the table with the answers as columns, and `session` as its number where it is among the names.

        A participant without an answer has none (NaN).
        """
        whose = table["participant"].astype(str)
        columns: dict[str, Any] = {
            name: whose.map(self.answers[question_of(name)]) for name in self.named(table, names)
        }
        if SESSION in names and SESSION in table.columns:
            columns[SESSION] = table[SESSION].astype(str).map(session_number)
        return table.assign(**columns) if columns else table


def question_of(name: str) -> str:
    """Return the name of the question, of a column that is called after it: `age` or `answer.age`."""
    return name.removeprefix(ANSWER)


def people_of(rows: Sequence[Mapping[str, Any]]) -> People:
    """Gather the answers of forms (session, participant, item, kind, value, number); a later session's count."""
    answers: dict[str, dict[str, str]] = {}
    free = set()
    for row in sorted(rows, key=lambda row: int(session_number(row["session"]))):
        if row["kind"] == "text":
            free.add(row["item"])
        elif row["kind"] in CLOSED and row["value"] != "null":
            level = row["value"] if row["number"] is None else f"{row['number']:.15g}"
            answers.setdefault(row["item"], {})[row["participant"]] = level
    return People(answers, frozenset(free))


def refuse_small_groups(table: pd.DataFrame, names: Sequence[str], least: int, whose: str) -> None:
    """Raise DataRefused where fewer than `least` participants gave the same answers, one to each of the questions.

    So few could be recognised in a table that is shared.
    """
    people = table[["participant", *names]].drop_duplicates()
    sizes = people.groupby(list(names), sort=True).size()
    small = sizes[sizes < least]
    if not len(small):
        return
    levels = small.index[0] if isinstance(small.index[0], tuple) else (small.index[0],)
    answers = ", ".join(f"{name} {level}" for name, level in zip(names, levels, strict=True))
    raise DataRefused(
        f"{whose!r}: {int(small.iloc[0])} of the participants have {answers}, and fewer than {least} could be"
        " recognised: leave them out with `where`, or ask for it with `least_people: 1` in the plan"
    )


OF_A_RATING = ("attribute", "value", "response_time_s", "revised")
"""The columns of a rating that its trial does not have."""
_NO_WORDS: Mapping[str, Any] = MappingProxyType({})
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
    versions: tuple[Input, ...] = ()
    """Where sessions had different versions of the study or of a model: every version, and how many had it."""

    @property
    def participants(self) -> tuple[str, ...]:
        """Everyone with an answered trial or form, in the order of their pseudonyms."""
        return tuple(sorted({*self.trials["participant"], *self.forms["participant"]}))


def read_material(
    engine: Engine, name: str, *, digest: str | None, include_incomplete: bool, simulated: bool | None,
    withdrawn: Collection[str] = (),
) -> Material:  # fmt: skip
    """Return the material of a study in a collected database. Raises what `read_ratings` raises."""
    options: dict[str, Any] = {
        "digest": digest, "include_incomplete": include_incomplete, "simulated": simulated, "withdrawn": withdrawn,
    }  # fmt: skip
    with engine.connect() as connection:
        study, choice = chosen(connection, name, **options)
        ratings = read_ratings(connection, name, **options) if gives_ratings(study) else None
        rows = Rows(*(_rows(connection, query, study, choice) for query in (_TRIALS, _WORDS, _ANSWERS)))
        versions = tuple(_versions(connection, study, choice))
    return replace(material_of(study, choice, ratings, rows), versions=versions)


def _versions(connection: Connection, study: Study, choice: Choice) -> Iterator[Input]:
    """Yield every version of the study and of each model, where the sample has several, and how many sessions had it.

    Only one version of the study is analysed, with whatever models its sessions had.
    """
    sessions = (*choice.kept, *(session for session, _ in choice.left_out))
    counts = Counter(session.study_digest for session in sessions)
    for digest, number in sorted(counts.items()) if len(counts) > 1 else ():
        left_out = "" if digest == choice.digest else ", left out"
        yield Input(f"study {study.study}", digest, f"{count(number, 'session')}{left_out}")
    if not any(NEEDS[need].plays_models for need in study.needs):
        return
    kept = {session.session for session in choice.kept}
    played: dict[str, dict[str, set[str]]] = {}
    for session, body in connection.execute(_REPLIES, {"study": study.study}):
        for name, sha256 in models_in(json.loads(body)) if session in kept else ():
            played.setdefault(name, {}).setdefault(sha256, set()).add(session)
    for name, versions in sorted(played.items()):
        for sha256, own in sorted(versions.items()) if len(versions) > 1 else ():
            yield Input(f"model {name}", sha256, count(len(own), "session"))


@dataclass(frozen=True)
class Rows:
    """Rows of the collected tables trials, words and answers, each with participant and group."""

    trials: list[dict[str, Any]]
    words: list[dict[str, Any]]
    answers: list[dict[str, Any]]


def material_of(study: Study, choice: Choice, ratings: Ratings | None, rows: Rows) -> Material:
    """Return the material of these sessions, wherever their rows come from."""
    trials = _trials(rows.trials, study)
    words = _words(rows.words, trials)
    forms = _forms(rows.answers)
    return Material(
        name=study.study,
        title=study.title or study.study,
        study=study,
        ratings=ratings,
        trials=trials,
        words=words,
        forms=forms,
        planned=Counter(row["session"] for row in rows.trials if not row["practice"]),
        simulated=any(session.simulated for session in choice.kept),
        seeds=tuple(sorted({session.seed for session in choice.kept if session.simulated})),
        inputs=inputs_of(study, choice),
        exclusions=ratings.exclusions if ratings is not None else left_out_sessions(choice),
        levels=study_levels(study, trials),
        people=people_of(rows.answers),
        sessions=choice.kept,
    )


def imported_material(ratings: Ratings, title: str) -> Material:
    """Return the material of an imported data set: its ratings; a trial is a participant's row of them."""
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
    """Return the levels of every text column in the order in which the study lists them."""
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
    """Return the statement's rows of the sessions that are kept, with the participant and the group of each."""
    kept = {session.session: session for session in choice.kept}
    rows = query(connection, statement, study.study)
    return [
        {"participant": kept[row["session"]].participant, "group": kept[row["session"]].group_name or "", **row}
        for row in rows
        if row["session"] in kept
    ]


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
    """Return the words of answers that count; one of no trial (a closing suggestion) has an empty stimulus."""
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
    """Return the answers outside trials, but for what was written freely in an interview: no report repeats that."""
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
