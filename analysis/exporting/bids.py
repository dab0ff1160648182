"""BIDS: the files of a data set except recordings (the Brain Imaging Data Structure, here of behaviour only)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from palpate.analysis.exporting.bids_recordings import (
    RecordingCounts,
    file_stem,
    label,
    session_folder,
    write_recordings,
)
from palpate.analysis.exporting.description import (
    Description,
    changes_text,
    json_for_people,
    palpate_version,
    readme_text,
    redacted_lines,
    withheld_lines,
)
from palpate.analysis.exporting.guard import Guard
from palpate.analysis.exporting.session_rows import SessionRows
from palpate.analysis.exporting.source import SharedSession, Watch
from palpate.analysis.exporting.stimuli import FILE, StimulusFiles, copy_files, stimulus_files
from palpate.analysis.exporting.tables import ONSET, TRIAL, DataSet, shared_definition
from palpate.analysis.exporting.tabular import Column, Row, Table, write_tsv
from palpate.protocols.files import write_text
from palpate.protocols.tasks import TASKS

VERSION = "1.11.1"
"""The newest version that the validator's embedded schema (1.2.7) supports."""
BIDS_NAMES = {"onset_s": "onset", "response_time_s": "response_time"}
"""BIDS's own names of these columns, both in seconds."""
STATUS = Column("trial_status", "What became of the trial: answered and captured ones count.")
_FILE = Column("stim_file", "The stimulus' file, within the folder stimuli.")


def write_bids(
    data_set: DataSet, description: Description, guard: Guard, draft: Path, watch: Watch, recordings: bool
) -> None:
    """Write the whole data set.

    Raises as `write_recordings` does, and ExportRefused on data that BIDS cannot represent.
    """
    files = stimulus_files(data_set.source, data_set.without)
    task = label(data_set.source.study.study)
    _write_participants(data_set, guard, draft)
    _write_stimuli(data_set, guard, files, draft)
    # One sidecar for each kind of table, at the root: by the inheritance principle it holds for every session.
    for table in _behaviour_tables(data_set, task, bool(files.files)):
        about = {**table.about, **column_entries(table.columns)}
        write_text(draft / f"task-{table.task}_{table.suffix}.json", json_for_people(about))
    recorded = RecordingCounts()
    for session in watch(data_set.source.sessions, "writing"):
        _write_session(data_set, guard, session, task, bool(files.files), draft)
        if recordings and data_set.table("streams") is not None:
            recorded += write_recordings(data_set.source, session, task, draft, guard)
    write_text(draft / "code/study.json", json_for_people(shared_definition(data_set)))
    write_text(draft / "dataset_description.json", json_for_people(_data_set_description(description)))
    write_text(draft / "CHANGES", changes_text(data_set.source))
    streams = recorded.notes() if recordings else ["The recordings were left out (--no-recordings)."]
    contents = [*_file_lines(data_set.source.study.study, task), files.note, *streams]
    contents += [*withheld_lines(data_set), *redacted_lines(guard)]
    write_text(draft / "README.md", readme_text(description, data_set.source, contents))


def _data_set_description(description: Description) -> dict[str, Any]:
    """Return the entries of dataset_description.json."""
    return {
        "Name": description.name,
        "BIDSVersion": VERSION,
        "DatasetType": "raw",
        "License": description.licence,
        **{key: value for key, value in description.of_lab.items() if key != "License"},
        "GeneratedBy": [{"Name": "Palpate", "Version": palpate_version(), "Description": "palpate export --bids"}],
        "Simulated": description.simulated,
    }


def _file_lines(study: str, task: str) -> list[str]:
    """Return lines for the README that describe the files of the data set."""
    return [
        f"`sub-*/ses-*/beh/*_task-{task}_beh.tsv`: the trials of a session with their answers, one row for each answer;"
        " a trial without one has a row of its own. What the columns mean stands in `task-*_beh.json`.",
        "`participants.tsv`, `sub-*/sub-*_sessions.tsv`: who took part, and in which sessions.",
        f"`code/study.json`: the definition of the study {study}, stimuli included;"
        " `stimuli/stimuli.tsv`: its stimuli.",
    ]


def _write_stimuli(data_set: DataSet, guard: Guard, files: StimulusFiles, draft: Path) -> None:
    """Write the table of stimuli with its sidecar, and copy their files; do nothing if the study has no such table."""
    stimuli = data_set.table("stimuli")
    if stimuli is None:
        return
    guard.demand_columns("stimuli/stimuli.tsv", [column.name for column in stimuli.columns])
    write_tsv(draft / "stimuli/stimuli.tsv", stimuli, guard.watched(stimuli, "stimuli/stimuli.tsv"))
    write_text(draft / "stimuli/stimuli.json", json_for_people(column_entries(stimuli.columns)))
    copy_files(files, draft / "stimuli")


def _write_participants(data_set: DataSet, guard: Guard, draft: Path) -> None:
    table = data_set.table("participants")
    if table is None:
        return
    guard.demand_columns("participants.tsv", [column.name for column in table.columns])

    def subjects() -> Iterator[Row]:
        for row in guard.watched(table, "participants.tsv"):
            yield {**row, "participant": f"sub-{row['participant']}"}

    named = replace(table, rows=subjects).renamed({"participant": "participant_id"})
    write_tsv(draft / "participants.tsv", named, named.rows())
    write_text(draft / "participants.json", json_for_people(column_entries(named.columns)))


def _behaviour_tables(data_set: DataSet, task: str, files: bool) -> Iterator[BehaviourTable]:
    """Yield the tables of a session that the study has data for."""
    yield task_table(data_set, task, files)
    for make in (questionnaire_table, suggestions_table, switch_table, anchor_table):
        if (table := make(data_set, task)) is not None:
            yield table


def _write_session(
    data_set: DataSet, guard: Guard, session: SharedSession, task: str, files: bool, draft: Path
) -> None:
    """Write the tables of a session, and after the participant's last session the table of sessions."""
    for behaviour in _behaviour_tables(data_set, task, files):
        name = f"{session_folder(session)}/beh/{file_stem(session)}_task-{behaviour.task}_{behaviour.suffix}.tsv"
        table = Table(behaviour.task, "", behaviour.columns, lambda behaviour=behaviour: behaviour.rows(session))  # type: ignore[misc]
        guard.demand_columns(name, [column.name for column in behaviour.columns])
        write_tsv(draft / name, table, guard.watched(table, name))
    # sub-P001_sessions.tsv, when the participant's last session comes: one row for each
    mine = [other for other in data_set.source.sessions if other.participant == session.participant]
    sessions_table = data_set.table("sessions")
    if session != mine[-1] or sessions_table is None:
        return
    rows: list[Row] = []
    for one in mine:
        [row] = data_set.rows_of("sessions", one)
        when = str(row["started_at"]).replace("+00:00", "Z")
        rows.append({**row, "session_id": f"ses-{one.number:02d}", "acq_time": when})
    columns = tuple(c for c in sessions_table.columns if c.name not in ("participant", "session"))
    columns = tuple(replace(c, name="acq_time") if c.name == "started_at" else c for c in columns)
    session_id = Column("session_id", "The session, by its number among the participant's.", key=True)
    table = Table("sessions", "", (session_id, *columns), lambda: rows)
    where = draft / f"sub-{session.participant}/sub-{session.participant}_sessions"
    write_tsv(where.with_suffix(".tsv"), table, rows)
    write_text(where.with_suffix(".json"), json_for_people(column_entries(table.columns)))


def column_entries(columns: Sequence[Column]) -> dict[str, Any]:
    """Return a sidecar's entries for columns: Description, Units, Levels, Minimum and Maximum."""
    entries = {}
    for column in columns:
        levels = dict(column.levels) or ({"true": "yes", "false": "no"} if column.kind == "truth" else {})
        entries[column.name] = {
            "Description": column.description,
            **({"Units": column.unit} if column.unit else {}),
            **({"Levels": levels} if levels else {}),
            **({"Minimum": column.low} if column.low is not None else {}),
            **({"Maximum": column.high} if column.high is not None else {}),
        }
    return entries


@dataclass(frozen=True)
class BehaviourTable:
    """A table of each session: its task's label and suffix, columns, sidecar entries, and rows."""

    task: str
    suffix: str
    columns: tuple[Column, ...]
    about: dict[str, Any]
    rows: Callable[[SharedSession], Iterable[Row]]


def task_table(data_set: DataSet, task: str, files: bool) -> BehaviourTable:
    """Return the table of a session's trials, with one row per answer, and one for each trial without an answer."""
    study = data_set.source.study
    own = data_set.table(TASKS[study.task].answers)
    columns = own.columns if own is not None else ()
    order = _bids_columns([column for column in columns if column.name not in ("participant", "session", "form")])
    further = (STATUS, *((_FILE,) if files else ()))
    about = {"TaskName": study.study, "TaskDescription": TASKS[study.task].description}
    about |= {"Instructions": study.instructions} if study.instructions else {}
    return BehaviourTable(task, "beh", (*order, *further), about, lambda session: _trial_rows(data_set, session, files))


def _bids_columns(columns: list[Column]) -> tuple[Column, ...]:
    """Return the columns with BIDS's names and onset first, as in other tables of trials."""
    named = [replace(column, name=BIDS_NAMES.get(column.name, column.name)) for column in columns]
    named = [column for column in named if column.name != "status"]
    return tuple(sorted(named, key=lambda column: column.name != "onset"))


def _trial_rows(data_set: DataSet, session: SharedSession, files: bool) -> Iterator[Row]:
    """Yield rows in the order of the trials."""
    rows = SessionRows(data_set.source, session)
    answers: dict[int, list[Row]] = {}
    name = TASKS[data_set.source.study.task].answers
    for row in data_set.rows_of(name, session) if name != "trials" else ():
        if row["trial"] is not None:
            answers.setdefault(int(row["trial"]), []).append(row)
    files_of = {stimulus.id: stimulus.columns.get(FILE) for stimulus in data_set.source.study.stimuli} if files else {}
    for trial in rows.trials():
        attempt = {"attempt": trial["attempts"]}
        for row in answers.get(int(trial["trial"] or 0)) or [{**trial, **attempt}]:
            more = {"trial_status": trial["status"], "stim_file": files_of.get(str(trial["stimulus"]))}
            yield {BIDS_NAMES.get(key, key): value for key, value in (row | more).items()}


def questionnaire_table(data_set: DataSet, task: str) -> BehaviourTable | None:
    """Return the questionnaire at the session's end: one row with a column per item; None without one."""
    form = data_set.source.study.questionnaire
    if form is None or "questionnaire" not in data_set.source.study.closing:
        return None
    points = {str(point): f"{point} of {form.points}" for point in range(1, form.points + 1)}
    ends = points | {"1": form.ends[0], str(form.points): form.ends[1]}
    columns = tuple(
        Column(item.name, item.text, "whole", levels=ends, low=1, high=form.points)
        for item in form.items if item.name not in data_set.without
    )  # fmt: skip
    about = {"TaskName": f"{data_set.source.study.study} questionnaire", "TaskDescription": "Statements at the end."}

    def rows(session: SharedSession) -> Iterator[Row]:
        answers = [row for row in data_set.rows_of("answers", session) if row["form"] == "likert"]
        if answers:
            yield {str(row["item"]): row["value_number"] for row in answers}

    return BehaviourTable(f"{task}questionnaire", "beh", columns, about, rows)


def suggestions_table(data_set: DataSet, task: str) -> BehaviourTable | None:
    """Return the words suggested at the session's end, one per row; None if the study asks for none."""
    if "suggestions" not in data_set.source.study.closing or "word" in data_set.without:
        return None
    columns = (
        Column("number", "The word's place among those of the answer, from 1.", "whole"),
        Column("word", "The word.", free_answer=True),
    )
    about = {
        "TaskName": f"{data_set.source.study.study} suggestions",
        "TaskDescription": "Words that are missing from the list.",
    }

    def rows(session: SharedSession) -> Iterator[Row]:
        return (row for row in data_set.rows_of("words", session) if row["trial"] is None)

    return BehaviourTable(f"{task}suggestions", "beh", columns, about, rows)


def anchor_table(data_set: DataSet, task: str) -> BehaviourTable | None:
    """Return the references felt before a block, one per row; None if the study has none."""
    table = data_set.table("anchors")
    if table is None:
        return None
    columns = _bids_columns([column for column in table.columns if column.name not in ("participant", "session")])
    about = {"TaskName": f"{data_set.source.study.study} references", "TaskDescription": "References before a block."}

    def rows(session: SharedSession) -> Iterator[Row]:
        for row in data_set.rows_of("anchors", session):
            yield {BIDS_NAMES.get(key, key): value for key, value in row.items()}

    return BehaviourTable(f"{task}references", "beh", columns, about, rows)


def switch_table(data_set: DataSet, task: str) -> BehaviourTable | None:
    """Return the times at which the participant switched sides of a comparison, as events; None without sides."""
    if not data_set.source.study.sides:
        return None
    sides = {side: f"the participant changed to {side}" for side in data_set.source.study.sides}
    columns = (
        replace(ONSET, name="onset", description="Since the session began."),
        Column("duration", "A change takes no time.", "number", "s"),
        Column("trial_type", "What the participant changed to.", levels=sides),
        TRIAL,
    )

    def rows(session: SharedSession) -> Iterator[Row]:
        for row in data_set.rows_of("switches", session):
            yield {"onset": row["onset_s"], "duration": 0, "trial_type": row["side"], "trial": row["trial"]}

    return BehaviourTable(task, "events", columns, {}, rows)
