"""The group and row of the counterbalancing square that a participant gets, and the rows that a lab's sessions use."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from palpate.protocols.plan import Plan
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow

_PSEUDONYM = re.compile(r"^[A-Za-z][A-Za-z0-9]{0,15}$")
_COUNTED = re.compile(r"^[A-Za-z]+0*([1-9][0-9]{0,6})$")


class AllocationError(ValueError):
    """The pseudonym cannot be used, or determines no row."""


def allocate(study: Study, participant: str, group: str | None = None, row: int | None = None) -> ParticipantRow:
    """Return group and row of a participant: the given ones, else those that follow from the pseudonym's number.

    P001, P002, ... go round the groups in turn, and take the next row of the square with every round. Raises
    AllocationError on an invalid pseudonym, or one without a number where it is needed.
    """
    if not _PSEUDONYM.fullmatch(participant):
        raise AllocationError(
            f"participant {participant!r}: a pseudonym of a letter and up to 15 letters or digits is expected, "
            "as P001; with --simulate also several, as P001..P040"
        )
    groups = sorted(study.groups)
    if row is not None and (group is not None or not groups):
        return ParticipantRow(participant, group, row)
    if (counted := _COUNTED.fullmatch(participant)) is None:
        raise AllocationError(f"participant {participant!r} has no number, as P001 has; give --group and --row")
    number = int(counted[1]) - 1
    chosen = group if group is not None or not groups else groups[number % len(groups)]
    return ParticipantRow(participant, chosen, number // max(1, len(groups)) if row is None else row)


def demand_free(lab: Path, plans: Sequence[Plan], number: int, shared: bool) -> None:
    """Raise LedgerError if a session exists already, AllocationError if another participant has the row.

    Called before anything starts. `shared` is set where the experimenter gave the row: a replacement inherits it.
    """
    from palpate.studies.sessions.session_files import fresh_path  # `plan` needs no database

    for plan in plans:
        fresh_path(lab, plan.study.study, plan.who.participant, number)
    taken = {} if shared else rows_taken(lab, plans[0].study.study)
    for plan in plans:
        holders = taken.setdefault((plan.who.group, plan.who.row), {plan.who.participant})
        if plan.who.participant not in holders:
            place = f"row {plan.who.row}" + (f" of group {plan.who.group}" if plan.who.group is not None else "")
            raise AllocationError(
                f"participant {plan.who.participant}: {place} is {min(holders)}'s; "
                "give --row (and --group) to say which, a replacement inherits one"
            )


def rows_taken(lab: Path, study: str, simulated: bool = True) -> dict[tuple[str | None, int], set[str]]:
    """Return (group, row) -> participants from the lab's sessions of a study; simulated ones count if `simulated`.

    An unreadable ledger takes no row.
    """
    from palpate.studies.sessions.session_files import ledgers_in, session_starts  # `plan` needs no database

    taken: dict[tuple[str | None, int], set[str]] = {}
    for start in session_starts(ledgers_in(lab, study)):
        if simulated or start.in_person:
            taken.setdefault((start.who.group, start.who.row), set()).add(start.who.participant)
    return taken
