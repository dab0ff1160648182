"""Rows of the counterbalancing square that a lab's sessions have taken."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from palpate.protocols.plan import Plan
from palpate.studies.participants.row_assignment import AllocationError
from palpate.studies.sessions.session_files import fresh_path, ledgers_in
from palpate.studies.sessions.session_headers import session_starts


def demand_free(lab: Path, plans: Sequence[Plan], number: int, shared: bool) -> None:
    """Refuse before anything starts: a session that exists, or a row of the square that another participant has.

    `shared` is set where the experimenter gave the row: a replacement inherits it. Raises LedgerError, AllocationError.
    """
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
    """(group, row) -> participants, over the lab's sessions of a study, simulated ones only where told.

    An unreadable ledger takes no row.
    """
    taken: dict[tuple[str | None, int], set[str]] = {}
    for each in session_starts(ledgers_in(lab, study)):
        if simulated or each.in_person:
            taken.setdefault((each.who.group, each.who.row), set()).add(each.who.participant)
    return taken
