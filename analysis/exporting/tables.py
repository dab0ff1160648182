"""The tables of a data set with the meaning of their columns, which is the codebook of every format."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from palpate.analysis.exporting.demographics import FORM, ParticipantTable, participant_table, without_small_groups
from palpate.analysis.exporting.session_rows import SessionRows
from palpate.analysis.exporting.source import SharedSession, Source
from palpate.analysis.exporting.stimuli import stimulus_table
from palpate.analysis.exporting.tabular import Column, ExportRefused, Row, Table, cell_text
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.forms import FORMS, tables_with
from palpate.protocols.study import Study
from palpate.protocols.tasks import TASKS

PerSession = Callable[[SessionRows], Iterable[Row]]
SESSION_COLUMNS = (
    Column("participant", "Pseudonym of the participant.", key=True),
    Column("session", "Number of the session among the participant's.", "whole", key=True),
)
TRIAL = Column("trial", "Number of the trial in the session, from 1.", "whole", key=True)
ATTEMPT = Column("attempt", "Which attempt at the trial: a participant may go back, and a trial may be repeated.",
                 "whole", key=True)  # fmt: skip
TRIAL_COLUMNS = (
    TRIAL,
    Column("block", "Block of the session that the trial belongs to."),
    Column("practice", "Whether it was a practice trial, whose answers do not count.", "truth", key=True),
    Column("stimulus", "The stimulus, as in the table of stimuli.", key=True),
)
ONSET = Column("onset_s", "When this attempt at the trial began, since the session did.", "number", "s")
SECONDS = Column("response_time_s", "From the form's appearance to this answer.", "number", "s")
ANCHOR_COLUMNS = (
    Column("block", "Block of the session that the reference was felt before.", key=True),
    Column("number", "The reference's place among those before the block, from 1.", "whole", key=True),
    Column("stimulus", "The stimulus, as in the table of stimuli.", key=True),
    Column("label", "What the participant read of it."),
    Column("attribute", "The attribute that the word expresses, where the study declares one."),
    Column("value", "Its place on that attribute's scale.", "number"),
    Column("felt", "How often it was felt.", "whole"),
    Column("onset_s", "When the participant was last asked to feel it or to go on, since the session began.", "number",
           "s"),
)  # fmt: skip
COUNTS = Column("counts", "Whether this is the final answer: false where a later one replaced it.", "truth",
                key=True)  # fmt: skip
TRIAL_STATUS = {
    "answered": "has a final answer", "captured": "was recorded", "left": "was left by going back",
    "repeated": "was to be repeated, was not", "started": "was started, not finished", "not met": "was not met",
    "faulted": "a device failed",
}  # fmt: skip
PLANNED_TRIAL_COLUMNS = (
    *TRIAL_COLUMNS,
    Column("attempts", "How often it was presented.", "whole"),
    Column("status", "What became of it.", levels=TRIAL_STATUS),
    replace(ONSET, description="When the last attempt at the trial began, since the session did."),
)
STREAM_COLUMNS = (
    TRIAL, replace(ATTEMPT, key=False),
    Column("recording", "The how-manieth recording of this stream in the attempt.", "whole"),
    Column("stream", "The stream.", key=True),
    Column("channels", "Its channels, divided by commas."),
    Column("units", "Their units, divided by commas."),
    Column("rate_hz", "Nominal rate; 0 where things were noted as they happened.", "number", "Hz"),
    Column("start_s", "When its first sample was taken, since the session began.", "number", "s"),
    Column("samples", "Samples that were recorded.", "whole"),
    Column("lost", "Samples that are missing before the last recorded one.", "whole"),
    Column("gaps", "Places where samples are missing.", "whole"),
)  # fmt: skip
ROWS: dict[str, PerSession] = {
    "sessions": lambda session: [session.session_row()],
    "trials": lambda session: session.trials(),
    "ratings": lambda session: session.ratings(),
    "words": lambda session: session.words(),
    "answers": lambda session: session.answers(),
    "switches": lambda session: session.switches(),
    "anchors": lambda session: session.anchors(),
    "streams": lambda session: session.streams(),
}
"""By table: a function that returns the rows of a session."""
CODEBOOK_COLUMNS = (
    Column("table", "The table."),
    Column("column", "The column."),
    Column("kind", "What kind of value it holds: text, number, whole (number), truth (true or false)."),
    Column("unit", "The unit of a number."),
    Column("description", "What it means."),
    Column("levels", "The values that it may hold, each with its meaning: value = meaning, divided by ' | '."),
)


@dataclass(frozen=True)
class DataSet:
    """A data set: its source, its tables, and the columns that were deliberately left out."""

    source: Source
    tables: tuple[Table, ...]
    without: tuple[str, ...]
    withheld: tuple[str, ...] = ()
    """What was withheld or averaged because few participants gave the same answer."""

    def table(self, name: str) -> Table | None:
        """Return a table by name, None if there is none."""
        return next((table for table in self.tables if table.name == name), None)

    def rows_of(self, name: str, session: SharedSession) -> list[Row]:
        """Return the rows of one session in a table by session."""
        return list(_rows_of(name, SessionRows(self.source, session)))


def build_data_set(
    source: Source, without: Iterable[str] = (), dates: bool = False, free_text: bool = False, least_people: int = 1
) -> DataSet:
    """Return the data set's tables, without those that the study has no data for.

    `without` names columns, or questions to participants, to be left out everywhere; `dates` includes the times at
    which sessions began, `free_text` what was written in an interview. Answers about themselves that fewer than
    `least_people` real participants share are withheld. Raises ExportRefused on an unknown name, or one that a table
    needs.
    """
    left_out = frozenset(without)
    participants = participant_table(source)
    withheld: tuple[str, ...] = ()
    if least_people > 1 and source.of_people:
        participants, withheld = without_small_groups(participants, least_people)
    tables = (
        participants.table(),
        *(_with_protected_answers(table, participants) for table in _session_tables(source, dates)),
        stimulus_table(source),
    )
    items = {str(row["item"]) for session in source.sessions for row in SessionRows(source, session).answers()}
    known = {column.name: column for table in tables for column in table.columns}
    for name in sorted(left_out):
        if name not in known and name not in items:
            raise ExportRefused(f"--without {name}: no such column; {nearest(name, [*known, *sorted(items)])}")
        if name in known and known[name].key:
            raise ExportRefused(f"--without {name}: the tables mean nothing without this column; it cannot be left out")
    shared_tables = tuple(_without_answers(table.without(left_out), left_out, free_text) for table in tables)
    return DataSet(source, shared_tables, tuple(sorted(left_out)), withheld)


def _with_protected_answers(table: Table, who: ParticipantTable) -> Table:
    """Return a table with answers about people protected as in the table of people."""
    if table.name != "answers":
        return table
    by_person = {str(row["participant"]): row for row in who.rows}

    def rows() -> Iterator[Row]:
        for row in table.rows():
            name, kind = who.kinds.get(str(row["item"]), ("", "")) if row["form"] == FORM else ("", "")
            if kind in ("choice", "number"):
                value = by_person[str(row["participant"])].get(name)
                number = value if kind == "number" else None
                yield {**row, "value": cell_text(value) or None, "value_number": number}
            else:
                yield row

    return replace(table, rows=rows)


def _without_answers(table: Table, items: frozenset[str], free_text: bool) -> Table:
    """Return a table without the answers to questions that are left out.

    Free text of an interview is left out too unless `free_text`: it leaves the lab only on request.
    """
    if table.name == "fields" and not free_text:
        return replace(table, rows=lambda: (row for row in table.rows() if row["kind"] != "text"))
    if table.name != "answers":
        return table

    def rows() -> Iterator[Row]:
        return (row for row in table.rows() if row["item"] not in items and (free_text or row["form"] != "interview"))

    return replace(table, rows=rows)


def _session_tables(source: Source, dates: bool) -> Iterator[Table]:
    study = source.study
    yield _table(source, "sessions", "One row for each session.", _session_columns(dates))
    yield _table(source, "trials", "One row for each planned trial, whatever became of it.", PLANNED_TRIAL_COLUMNS)
    if TASKS[study.task].answers == "ratings":
        description = "One row for each rating, revised ones too."
        yield _table(source, "ratings", description, _rating_columns(study))
    asks_more = any(question.has_row for question in study.ask)
    for own in tables_with(TASKS[study.task].answers):
        if own.name == "fields" and not asks_more:
            continue
        columns = tuple(
            Column(column.name, column.description, column.kind, column.unit, key=column.key) for column in own.columns
        )
        names = {column.name for column in columns}
        columns = (*(c for c in TRIAL_COLUMNS if c.name not in names), ATTEMPT, ONSET, *columns, COUNTS)
        yield _table(source, own.name, own.description, columns)
    if TASKS[study.task].answers == "words" or "suggestions" in study.closing:
        yield _table(source, "words", "One row for each word that was ticked or written.", _word_columns())
    if study.opening or {"questionnaire", "interview"} & set(study.closing):
        description = "One row for each question outside trials: about the person, or the questionnaire."
        yield _table(source, "answers", description, _answer_columns(study))
    if study.sides:
        description = "One row for each change between the sides of a comparison."
        columns = (
            TRIAL,
            Column("number", "The change's place among those of the trial, from 1.", "whole"),
            Column("side", "What the participant changed to.", levels=dict.fromkeys(study.sides, "a side")),
            Column("at_s", "Since the form appeared.", "number", "s"),
            Column("onset_s", "Since the session began.", "number", "s"),
        )
        yield _table(source, "switches", description, columns)
    if study.anchors is not None:
        description = "One row for each reference that was felt before a block; references are not trials."
        yield _table(source, "anchors", description, ANCHOR_COLUMNS)
    if any(True for session in source.sessions for _ in SessionRows(source, session).streams()):
        yield _table(source, "streams", "One row for each recording of a stream; samples not included.", STREAM_COLUMNS)


def _table(source: Source, name: str, description: str, columns: tuple[Column, ...]) -> Table:
    def rows() -> Iterator[Row]:
        for session in source.sessions:
            yield from _rows_of(name, SessionRows(source, session))

    return Table(name, description, (*SESSION_COLUMNS, *columns), rows)


def _rows_of(name: str, session: SessionRows) -> Iterable[Row]:
    return ROWS[name](session) if name in ROWS else session.own(name)


def _session_columns(dates: bool) -> tuple[Column, ...]:
    status = {
        "complete": "came to its regular end", "interrupted": "not resumed", "aborted": "by the experimenter",
    }  # fmt: skip
    when = (Column("started_at", "When the session began, by the station's clock (UTC)."),) if dates else ()
    return (
        Column("group", "Group of the study."),
        Column("counterbalancing_row", "Row of the counterbalancing square, from 0.", "whole"),
        Column("status", "How the session ended.", levels=status),
        Column("simulated", "Whether no person, or no real device, gave the answers.", "truth"),
        Column("seed", "Seed of the session's random orders.", "whole"),
        Column("trials_planned", "Trials that were planned.", "whole"),
        Column("trials_answered", "Trials that were answered or recorded.", "whole"),
        Column("sittings", "How many runs the session had: more than 1 where it was interrupted.", "whole"),
        Column("duration_s", "From the session's first event to its last.", "number", "s"),
        Column("study_digest", "SHA-256 of the study's definition."),
        Column(
            "head_hash", "Last hash of the chain over the session's events: proves which record this row comes from."
        ),
        Column("palpate_version", "Palpate's version that recorded the session."),
        *when,
    )


def _rating_columns(study: Study) -> tuple[Column, ...]:
    scale = study.scale
    low, high = (scale.low, scale.high) if scale is not None else (None, None)
    ends = {
        attribute.name: f"from {attribute.low} ({low}) to {attribute.high} ({high})"
        + (f"; {attribute.category}" if attribute.category else "")
        + (f". {attribute.explanation}" if attribute.explanation else "")
        for attribute in study.attributes
    }
    labels = {f"{value:g}": text for value, text in scale.labelled} if scale is not None else {}
    step = f", in steps of {scale.step}" if scale is not None and scale.step is not None else ""
    return (
        *TRIAL_COLUMNS, ATTEMPT, ONSET,
        Column("attribute", "The attribute that was rated, by the name that the study gives it, else by the low end of "
               "its scale.", levels=ends, key=True),
        Column("antonym", "The adjective at the high end of the scale."),
        Column("value", f"The rating: {low} where the attribute fits completely, {high} where its antonym does{step}. "
               "The marker was unset until touched.", "number", key=True, low=low, high=high, levels=labels),
        SECONDS,
        Column("revised", "Whether the form began with answers that were given before.", "truth", key=True),
        COUNTS,
    )  # fmt: skip


def _word_columns() -> tuple[Column, ...]:
    kinds = {"ticked": "in the list of the study", "further": "added to the list", "words": "the participant's own"}
    return (
        *(replace(column, key=column.name == "trial") for column in TRIAL_COLUMNS), replace(ATTEMPT, key=False), ONSET,
        Column("form", "The form that asked for words.", levels={
            name: kind.title for name, kind in FORMS.items() if kind.title and kind.table == "words"}),
        Column("kind", "Where the word comes from.", levels=kinds, key=True),
        Column("number", "The word's place among those of the answer, from 1.", "whole"),
        Column("word", "The word.", free_answer=True),
        replace(SECONDS, description="From the form's appearance to the whole answer."),
        COUNTS,
    )  # fmt: skip


def _answer_columns(study: Study) -> tuple[Column, ...]:
    items = {item.name: item.text for item in study.questionnaire.items} if study.questionnaire else {}
    items |= {item.name: item.text for item in study.interview}
    return (
        Column(
            "form",
            "The form.",
            levels={name: kind.title for name, kind in FORMS.items() if kind.title and kind.table is None},
            key=True,
        ),
        Column("item", "The question.", levels=items, key=True),
        Column("value", "The answer as text; empty where none was given.", free_answer=True, key=True),
        Column("value_number", "The answer as a number, where it is one.", "number", free_answer=True),
    )


def codebook(data_set: DataSet) -> Table:
    """Return a table with one row for each column of each table."""

    def rows() -> Iterator[Row]:
        for table in data_set.tables:
            for column in table.columns:
                levels = " | ".join(f"{value} = {meaning}" for value, meaning in column.levels.items())
                yield {"table": table.name, "column": column.name, "kind": column.kind, "unit": column.unit,
                       "description": column.description, "levels": levels}  # fmt: skip

    return Table("codebook", "What every column of every table means.", CODEBOOK_COLUMNS, rows)


def shared_definition(data_set: DataSet) -> dict[str, Any]:
    """Return the study's definition as compiled, without the stimulus columns that were left out."""
    definition = dict(data_set.source.definition)
    definition["stimuli"] = [
        {**stimulus, "columns": {k: v for k, v in stimulus.get("columns", {}).items() if k not in data_set.without}}
        for stimulus in definition["stimuli"]
    ]
    return definition
