"""From what was asked on the command line to plans that may be run: who, with which row, on which forms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from palpate.protocols.plan import Plan, compile_plan
from palpate.protocols.reading import StudyError
from palpate.protocols.shell_command import shell_command
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.protocols.yaml_text import YamlError
from palpate.studies.catalogue import read_study
from palpate.studies.launching.changes import StudyChanged, demand_unchanged
from palpate.studies.participants.admission import admit, demand_known_here, demand_not_finished
from palpate.studies.participants.allocations import place_told
from palpate.studies.participants.lab_forms import lab_forms
from palpate.studies.participants.row_assignment import AllocationError, allocate
from palpate.studies.sessions.record import LedgerError, read
from palpate.studies.sessions.session_files import fresh_path, ledger_path


def plans_of(
    study: Study, lab: Path, people: Sequence[str], seed: int, live: bool, language: str = "en",
    group: str | None = None, row: int | None = None, session: int = 1,
) -> list[Plan]:  # fmt: skip
    """A plan for every participant's session of this number.

    A real participant's row is the one that the lab's registry holds, or allocates now; a simulated one's follows
    from the pseudonym unless it is given or allocated. Raises ParticipantError, AllocationError or PlanError.
    """
    forms = lab_forms(study, lab, live, language)
    rows = [row_of(study, lab, each, live, group, row) for each in people]
    return [compile_plan(study, who, seed, forms, session) for who in rows]


def row_of(study: Study, lab: Path, participant: str, live: bool, group: str | None, row: int | None) -> ParticipantRow:
    """Group and row of a participant; see `plans_of`."""
    held = admit(lab, study, participant, live, group, row)
    if held is None:
        return allocate(study, participant, group, row)
    if (row is not None and row != held.row) or (group is not None and group != held.group):
        place = place_told((held.group, held.row))
        raise AllocationError(f"participant {participant} has {place} of {study.study}; leave --group and --row out")
    return held


def demand_new(lab: Path, study: str, participant: str, number: int) -> None:
    """Raise ParticipantError or LedgerError unless a live session of this number may be begun. Writes nothing.

    A start that is refused must take no row of the square, so this comes before one is allocated.
    """
    demand_known_here(lab, participant)
    fresh_path(lab, study, participant, number)
    if number == 1:
        demand_not_finished(lab, study, participant)


def demand_next(lab: Path, study: str, participant: str, number: int) -> None:
    """Raise LedgerError unless this is the participant's next session of the study: none is left out or open."""
    for earlier in range(1, number):
        path = ledger_path(lab, study, participant, earlier)
        if not path.is_file():
            raise LedgerError(f"{path}: {participant} has no session {earlier}; give --session {earlier}")
        status = read(path).status
        if status == "interrupted":
            raise LedgerError(f"{path}: session {earlier} is not over; resume it: {shell_command('resume', path)}")


def changed_since(header: Mapping[str, Any], file: Path, accept: bool) -> dict[str, Any]:
    """What goes on record where the study's file is not what the session began with; {} where it is.

    Raises StudyChanged naming the difference unless it is accepted; a file that cannot be read has changed, too.
    """
    try:
        current = read_study(file).study
    except (StudyError, YamlError) as error:
        if not accept:
            raise StudyChanged(
                f"{error}\nThe study's file cannot be read any more. Mend it, or go on with the study as it was "
                "recorded: --accept-change, which goes on record"
            ) from None
        return {"since_session": header["session"], "differences": "the study's file could not be read"}
    return demand_unchanged(header, current, accept) or {}
