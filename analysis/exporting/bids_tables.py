"""What a session's tables hold in BIDS: trials with answers, questionnaire, suggestions, changes of side."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from palpate.analysis.exporting.session_rows import SessionRows
from palpate.analysis.exporting.source import Sat
from palpate.analysis.exporting.stimuli import FILE
from palpate.analysis.exporting.tables import ONSET, TRIAL, Shared
from palpate.analysis.exporting.tabular import Column, Row
from palpate.protocols.study import Study
from palpate.protocols.tasks import TASKS

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
