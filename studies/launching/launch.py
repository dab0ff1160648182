"""Plans from the options of the command line: who takes part, with which row, on which forms, and when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date, datetime, timedelta
from pathlib import Path
from typing import Any

from palpate.protocols.plan import Plan, compile_plan
from palpate.protocols.reading import StudyError
from palpate.protocols.shell_command import shell_command
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.protocols.wording import count
from palpate.protocols.yaml_text import YamlError
from palpate.studies.catalogue import read_study
from palpate.studies.launching.changes import StudyChanged, demand_unchanged
from palpate.studies.participants.admission import admit, demand_known_here, demand_not_finished
from palpate.studies.participants.allocations import describe_place
from palpate.studies.participants.lab_forms import lab_forms
from palpate.studies.participants.row_assignment import AllocationError, allocate
from palpate.studies.sessions.record import LedgerError, Record, read
from palpate.studies.sessions.session_files import fresh_path, ledger_path


def plans_of(
    study: Study, lab: Path, people: Sequence[str], seed: int, live: bool, language: str = "en",
    group: str | None = None, row: int | None = None, session: int = 1,
) -> list[Plan]:  # fmt: skip
    """Return one plan for each participant's session of this number.

    A real participant's row is the one that the lab's registry holds, or allocates now; a simulated one's follows
    from the pseudonym unless it is given or allocated. Raises ParticipantError, AllocationError or PlanError.
    """
    forms = lab_forms(study, lab, live, language)
    rows = [row_of(study, lab, person, live, group, row) for person in people]
    return [compile_plan(study, who, seed, forms, session) for who in rows]


def row_of(study: Study, lab: Path, participant: str, live: bool, group: str | None, row: int | None) -> ParticipantRow:
    """Return group and row of a participant, as `plans_of` does."""
    held = admit(lab, study, participant, live, group, row)
    if held is None:
        return allocate(study, participant, group, row)
    if (row is not None and row != held.row) or (group is not None and group != held.group):
        place = describe_place((held.group, held.row))
        raise AllocationError(f"participant {participant} has {place} of {study.study}; leave --group and --row out")
    return held


def demand_new(lab: Path, study: str, participant: str, number: int) -> None:
    """Raise ParticipantError or LedgerError unless a live session of this number may start. Writes nothing.

    A start that is refused must take no row of the square, so this comes before one is allocated.
    """
    demand_known_here(lab, participant)
    fresh_path(lab, study, participant, number)
    if number == 1:
        demand_not_finished(lab, study, participant)


def demand_next(lab: Path, study: str, participant: str, number: int) -> None:
    """Raise LedgerError unless this is the participant's next session of the study, and no earlier one is open."""
    for earlier in range(1, number):
        path = ledger_path(lab, study, participant, earlier)
        if not path.is_file():
            raise LedgerError(f"{path}: {participant} has no session {earlier}; give --session {earlier}")
        status = read(path).status
        if status == "interrupted":
            raise LedgerError(f"{path}: session {earlier} is not over; resume it: {shell_command('resume', path)}")


def changed_since(header: Mapping[str, Any], file: Path, accept: bool) -> dict[str, Any]:
    """Return what goes on record if the study's file differs from the study that the session began with, else {}.

    Raises StudyChanged naming the difference unless it is accepted; a file that cannot be read has changed, too.
    """
    try:
        current = read_study(file).study
    except (StudyError, YamlError) as error:
        if not accept:
            raise StudyChanged(
                f"{error}\nThe study's file cannot be read any more. Correct it, or resume with the study as it was "
                "recorded: --accept-change, which is recorded"
            ) from None
        return {"since_session": header["session"], "differences": "the study's file could not be read"}
    return demand_unchanged(header, current, accept) or {}


class WrongTime(ValueError):
    """The study does not declare the session, or the session is too early or too late."""


def demand_in_time(
    lab: Path, study: Study, participant: str, number: int, accept: bool, today: date | None
) -> dict[str, Any] | None:
    """Return what goes on record if the session is undeclared, too early or too late; None if it is in time.

    `today` is the date that a live session is on; None for a simulated one, between whose sessions no day passes. The
    date of the earlier session is that of its last run, both in the station's time zone. Raises WrongTime unless the
    time is accepted, LedgerError where the earlier session cannot be read.
    """
    sample = study.participants
    if sample is None:
        return None
    if sample.sessions is not None and number > sample.sessions:
        declared = f"the study declares {count(sample.sessions, 'session')}"
        return _accepted(f"{study.study}: this is session {number} of {participant}, and {declared}", accept, {
            "session": number, "sessions": sample.sessions})  # fmt: skip
    earlier = ledger_path(lab, study.study, participant, number - 1)
    if today is None or sample.apart_days is None or not earlier.is_file():
        return None
    before = datetime.fromisoformat(read(earlier).run_notes[-1].value["at"]).astimezone().date()
    days, (fewest, most) = (today - before).days, sample.apart_days
    if fewest <= days <= most:
        return None
    come = f"from {before + timedelta(fewest)} to {before + timedelta(most)}"
    message = (
        f"{study.study}: {participant} had session {number - 1} on {before}, {count(days, 'day')} before today; from "
        f"{fewest} to {count(most, 'day')} are declared: have session {number} {come}"
    )
    return _accepted(message, accept, {"since_session": number - 1, "days": days, "apart_days": [fewest, most]})


def demand_soon(record: Record, accept: bool, now: datetime) -> dict[str, Any] | None:
    """Return what goes on record if an interrupted session is resumed later than its study allows; None if in time.

    The time since its last event counts. Raises WrongTime unless that is accepted.
    """
    policy = record.header["study"].get("resume") or {}
    if (within_h := policy.get("within_h")) is None:
        return None
    note = record.run_notes[-1]  # of a killed run its beginning: what it did since is in its events
    before = record.events[note.events - 1].t_ns if note.events else 0
    ran = timedelta(microseconds=(record.events[-1].t_ns - before) / 1000)
    hours = (now - datetime.fromisoformat(note.value["at"]) - ran).total_seconds() / 3600
    if hours <= within_h:
        return None
    allowed = f"the study allows at most {within_h:g} h (resume: within_h)"
    message = f"{record.path}: interrupted {hours:.1f} h ago; {allowed}"
    if not accept:
        raise WrongTime(f"{message}; --accept-change resumes it all the same and is recorded")
    return {"resumed_after_h": round(hours, 2), "within_h": within_h}


def _accepted(message: str, accept: bool, timing: dict[str, Any]) -> dict[str, Any]:
    if not accept:
        raise WrongTime(f"{message}; --accept-timing runs it all the same and is recorded")
    return {"timing": timing}
