"""BIDS: the data set's files beside the recordings (the Brain Imaging Data Structure, here of behaviour alone)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from palpate.analysis.exporting.about import About, as_json, changes, palpate_version, readme
from palpate.analysis.exporting.bids_names import folder_of, label, stem_of
from palpate.analysis.exporting.bids_recordings import Recorded, write_recordings
from palpate.analysis.exporting.bids_tables import (
    Beh,
    anchor_table,
    questionnaire_table,
    suggestions_table,
    switch_table,
    task_table,
)
from palpate.analysis.exporting.cells import write_tsv
from palpate.analysis.exporting.codebook import definition
from palpate.analysis.exporting.guard import Guard
from palpate.analysis.exporting.plain import redacted, withheld
from palpate.analysis.exporting.source import Sat, Watch
from palpate.analysis.exporting.stimuli import Files, copy_files, stimulus_files
from palpate.analysis.exporting.tables import Shared
from palpate.analysis.exporting.tabular import Column, Row, Table
from palpate.protocols.files import write_text
from palpate.protocols.study import Study

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
