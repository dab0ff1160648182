"""BIDS: the data set's files beside the recordings (the Brain Imaging Data Structure, here of behaviour alone)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from palpate.analysis.exporting.bids_recordings import Recorded, folder_of, label, stem_of, write_recordings
from palpate.analysis.exporting.description import About, as_json, changes, palpate_version, readme, redacted, withheld
from palpate.analysis.exporting.guard import Guard
from palpate.analysis.exporting.session_rows import SessionRows
from palpate.analysis.exporting.source import Sat, Watch
from palpate.analysis.exporting.stimuli import FILE, Files, copy_files, stimulus_files
from palpate.analysis.exporting.tables import ONSET, TRIAL, Shared, definition
from palpate.analysis.exporting.tabular import Column, Row, Table, write_tsv
from palpate.protocols.files import write_text
from palpate.protocols.study import Study
from palpate.protocols.tasks import TASKS

VERSION = "1.11.1"
"""The newest that the validator's embedded schema (1.2.7) knows."""


def write_bids(shared: Shared, of: About, guard: Guard, draft: Path, watch: Watch, recordings: bool) -> None:
    """The whole data set. Raises what `write_recordings` raises, and ExportRefused on what BIDS cannot hold."""
    files = stimulus_files(shared.source, shared.without)
    task = label(shared.source.study.study)
    _participants(shared, guard, draft)
    _stimuli(shared, guard, files, draft)
    _sidecars(shared, task, bool(files.files), draft)
    recorded = Recorded()
    for sat in watch(shared.source.kept, "writing"):
        _session(shared, guard, sat, task, bool(files.files), draft)
        if recordings and shared.table("streams") is not None:
            recorded += write_recordings(shared.source, sat, task, draft, guard)
    write_text(draft / "code/study.json", as_json(definition(shared)))
    write_text(draft / "dataset_description.json", as_json(_description(of)))
    write_text(draft / "CHANGES", changes(shared.source))
    streams = recorded.told() if recordings else ["The recordings were left out (--no-recordings)."]
    told = [*_holds(shared.source.study, task), files.told, *streams, *withheld(shared), *redacted(guard)]
    write_text(draft / "README.md", readme(of, shared.source, told))


def _description(of: About) -> dict[str, Any]:
    return {
        "Name": of.name,
        "BIDSVersion": VERSION,
        "DatasetType": "raw",
        "License": of.licence,
        **{key: value for key, value in of.of_lab.items() if key != "License"},
        "GeneratedBy": [{"Name": "Palpate", "Version": palpate_version(), "Description": "palpate export --bids"}],
        "Simulated": of.simulated,
    }


def _participants(shared: Shared, guard: Guard, draft: Path) -> None:
    table = shared.table("participants")
    if table is None:
        return
    guard.demand_columns("participants.tsv", [column.name for column in table.columns])
    watched = replace(table, rows=lambda: _as_subjects(guard.watched(table, "participants.tsv")))
    named = watched.renamed({"participant": "participant_id"})
    write_tsv(draft / "participants.tsv", named, named.rows())
    write_text(draft / "participants.json", as_json(described(named.columns)))


def _as_subjects(rows: Iterator[Row]) -> Iterator[Row]:
    for row in rows:
        yield {**row, "participant": f"sub-{row['participant']}"}


def _stimuli(shared: Shared, guard: Guard, files: Files, draft: Path) -> None:
    table = shared.table("stimuli")
    if table is None:
        return
    guard.demand_columns("stimuli/stimuli.tsv", [column.name for column in table.columns])
    write_tsv(draft / "stimuli/stimuli.tsv", table, guard.watched(table, "stimuli/stimuli.tsv"))
    write_text(draft / "stimuli/stimuli.json", as_json(described(table.columns)))
    copy_files(files, draft / "stimuli")


def _behs(shared: Shared, task: str, files: bool) -> Iterator[Beh]:
    """The tables of a session that the study can fill."""
    yield task_table(shared, task, files)
    for make in (questionnaire_table, suggestions_table, switch_table, anchor_table):
        if (found := make(shared, task)) is not None:
            yield found


def _sidecars(shared: Shared, task: str, files: bool, draft: Path) -> None:
    """One for each kind of table, at the root: by the inheritance principle it holds for every session."""
    for beh in _behs(shared, task, files):
        about = {**beh.about, **described(beh.columns)}
        write_text(draft / f"task-{beh.task}_{beh.suffix}.json", as_json(about))


def _session(shared: Shared, guard: Guard, sat: Sat, task: str, files: bool, draft: Path) -> None:
    for beh in _behs(shared, task, files):
        name = f"{folder_of(sat)}/beh/{stem_of(sat)}_task-{beh.task}_{beh.suffix}.tsv"
        table = Table(beh.task, "", beh.columns, lambda beh=beh: beh.rows(sat))  # type: ignore[misc]
        guard.demand_columns(name, [column.name for column in beh.columns])
        write_tsv(draft / name, table, guard.watched(table, name))
    _sessions(shared, sat, draft)


def _sessions(shared: Shared, sat: Sat, draft: Path) -> None:
    """sub-P001_sessions.tsv, when its last session comes: one row for each."""
    mine = [each for each in shared.source.kept if each.participant == sat.participant]
    found = shared.table("sessions")
    if sat != mine[-1] or found is None:
        return
    rows = [_session_row(shared, each) for each in mine]
    columns = tuple(c for c in found.columns if c.name not in ("participant", "session"))
    columns = tuple(replace(c, name="acq_time") if c.name == "started_at" else c for c in columns)
    session = Column("session_id", "The session, by its number among the participant's.", key=True)
    table = Table("sessions", "", (session, *columns), lambda: rows)
    where = draft / f"sub-{sat.participant}/sub-{sat.participant}_sessions"
    write_tsv(where.with_suffix(".tsv"), table, rows)
    write_text(where.with_suffix(".json"), as_json(described(table.columns)))


def _session_row(shared: Shared, sat: Sat) -> Row:
    [row] = shared.per_session("sessions", sat)
    when = str(row["started_at"]).replace("+00:00", "Z")
    return {**row, "session_id": f"ses-{sat.number:02d}", "acq_time": when}


def described(columns: Sequence[Column]) -> dict[str, Any]:
    """A sidecar's entries for columns: Description, Units, Levels, Minimum and Maximum."""
    return {column.name: _entry(column) for column in columns}


def _entry(column: Column) -> dict[str, Any]:
    levels = dict(column.levels) or ({"true": "yes", "false": "no"} if column.kind == "truth" else {})
    return {
        "Description": column.description,
        **({"Units": column.unit} if column.unit else {}),
        **({"Levels": levels} if levels else {}),
        **({"Minimum": column.low} if column.low is not None else {}),
        **({"Maximum": column.high} if column.high is not None else {}),
    }


def _holds(study: Study, task: str) -> list[str]:
    return [
        f"`sub-*/ses-*/beh/*_task-{task}_beh.tsv`: the trials of a session with their answers, one row for each answer;"
        " a trial without one has a row of its own. What the columns mean stands in `task-*_beh.json`.",
        "`participants.tsv`, `sub-*/sub-*_sessions.tsv`: who took part, and in which sessions.",
        f"`code/study.json`: the definition of the study {study.study}, stimuli included;"
        " `stimuli/stimuli.tsv`: its stimuli.",
    ]


IN_BIDS = {"onset_s": "onset", "response_time_s": "response_time"}
"""BIDS has names of its own for these; both in seconds."""
STATUS = Column("trial_status", "What became of the trial: answered and captured ones count.")


@dataclass(frozen=True)
class Beh:
    """A table that each session has: its task's label and suffix, columns, what its sidecar says, and its rows."""

    task: str
    suffix: str
    columns: tuple[Column, ...]
    about: dict[str, Any]
    rows: Callable[[Sat], Iterable[Row]]


def task_table(shared: Shared, task: str, files: bool) -> Beh:
    """The trials of a session, one row for each answer, and one for each trial without any."""
    study = shared.source.study
    own = next((shared.table(name) for name in _names(study) if shared.table(name) is not None), None)
    columns = own.columns if own is not None else ()
    order = _in_order([column for column in columns if column.name not in ("participant", "session", "form")])
    further = (STATUS, *((_FILE,) if files else ()))
    about = {"TaskName": study.study, "TaskDescription": TASKS[study.task].description}
    about |= {"Instructions": study.instructions} if study.instructions else {}
    return Beh(task, "beh", (*order, *further), about, lambda sat: _answers(shared, sat, files))


_FILE = Column("stim_file", "The stimulus' file, within the folder stimuli.")


def _names(study: Study) -> tuple[str, ...]:
    """The table whose rows are the answers to trials."""
    return (TASKS[study.task].answers,)


def _in_order(columns: list[Column]) -> tuple[Column, ...]:
    """BIDS's names; onset first, as in its other tables of trials."""
    named = [replace(column, name=IN_BIDS.get(column.name, column.name)) for column in columns]
    named = [column for column in named if column.name != "status"]
    return tuple(sorted(named, key=lambda column: column.name != "onset"))


def _answers(shared: Shared, sat: Sat, files: bool) -> Iterator[Row]:
    """Rows in the order of the trials."""
    rows = SessionRows(shared.source, sat)
    answers: dict[int, list[Row]] = {}
    [name] = _names(shared.source.study)
    for row in shared.per_session(name, sat) if name != "trials" else ():
        if row["trial"] is not None:
            answers.setdefault(int(row["trial"]), []).append(row)
    files_of = {each.id: each.columns.get(FILE) for each in shared.source.study.stimuli} if files else {}
    for trial in rows.trials():
        attempt = {"attempt": trial["attempts"]}
        for row in answers.get(int(trial["trial"] or 0)) or [{**trial, **attempt}]:
            more = {"trial_status": trial["status"], "stim_file": files_of.get(str(trial["stimulus"]))}
            yield {IN_BIDS.get(key, key): value for key, value in (row | more).items()}


def questionnaire_table(shared: Shared, task: str) -> Beh | None:
    """The questionnaire at the session's end: one row, a column for each item."""
    asked = shared.source.study.questionnaire
    if asked is None or "questionnaire" not in shared.source.study.closing:
        return None
    points = {str(point): f"{point} of {asked.points}" for point in range(1, asked.points + 1)}
    ends = points | {"1": asked.ends[0], str(asked.points): asked.ends[1]}
    columns = tuple(
        Column(item.name, item.text, "whole", levels=ends, low=1, high=asked.points)
        for item in asked.items if item.name not in shared.without
    )  # fmt: skip
    about = {"TaskName": f"{shared.source.study.study} questionnaire", "TaskDescription": "Statements at the end."}
    return Beh(f"{task}questionnaire", "beh", columns, about, lambda sat: _questionnaire(shared, sat))


def _questionnaire(shared: Shared, sat: Sat) -> Iterator[Row]:
    answers = [row for row in shared.per_session("answers", sat) if row["form"] == "likert"]
    if answers:
        yield {str(row["item"]): row["value_number"] for row in answers}


def suggestions_table(shared: Shared, task: str) -> Beh | None:
    """Words that were suggested at the session's end, one a row."""
    if "suggestions" not in shared.source.study.closing or "word" in shared.without:
        return None
    columns = (
        Column("number", "The word's place among those of the answer, from 1.", "whole"),
        Column("word", "The word.", said=True),
    )
    about = {"TaskName": f"{shared.source.study.study} suggestions", "TaskDescription": "Words that the list lacks."}
    return Beh(f"{task}suggestions", "beh", columns, about, lambda sat: _suggestions(shared, sat))


def _suggestions(shared: Shared, sat: Sat) -> Iterator[Row]:
    return (row for row in shared.per_session("words", sat) if row["trial"] is None)


def anchor_table(shared: Shared, task: str) -> Beh | None:
    """References that were felt before a block, one a row."""
    table = shared.table("anchors")
    if table is None:
        return None
    columns = _in_order([column for column in table.columns if column.name not in ("participant", "session")])
    about = {"TaskName": f"{shared.source.study.study} references", "TaskDescription": "References before a block."}
    return Beh(f"{task}references", "beh", columns, about, lambda sat: _anchors(shared, sat))


def _anchors(shared: Shared, sat: Sat) -> Iterator[Row]:
    for row in shared.per_session("anchors", sat):
        yield {IN_BIDS.get(key, key): value for key, value in row.items()}


def switch_table(shared: Shared, task: str) -> Beh | None:
    """When the participant changed between the sides of a comparison, as events."""
    if not shared.source.study.sides:
        return None
    sides = {side: f"the participant changed to {side}" for side in shared.source.study.sides}
    columns = (
        replace(ONSET, name="onset", description="Since the session began."),
        Column("duration", "A change takes no time.", "number", "s"),
        Column("trial_type", "What the participant changed to.", levels=sides),
        TRIAL,
    )
    return Beh(task, "events", columns, {}, lambda sat: _switches(shared, sat))


def _switches(shared: Shared, sat: Sat) -> Iterator[Row]:
    for row in shared.per_session("switches", sat):
        yield {"onset": row["onset_s"], "duration": 0, "trial_type": row["side"], "trial": row["trial"]}
