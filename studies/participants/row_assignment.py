"""Which group and which row of the square a participant gets."""

from __future__ import annotations

import re

from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow

_PSEUDONYM = re.compile(r"^[A-Za-z][A-Za-z0-9]{0,15}$")
_COUNTED = re.compile(r"^[A-Za-z]+0*([1-9][0-9]{0,6})$")


class AllocationError(ValueError):
    """The pseudonym cannot be used, or does not say which row it gets."""


def allocate(study: Study, participant: str, group: str | None = None, row: int | None = None) -> ParticipantRow:
    """Group and row of a participant: those given, else those that the pseudonym's number says.

    P001, P002, ... go round the groups in turn, and take the next row of the square with every round.
    Raises AllocationError on a name that is no pseudonym, or one without a number where it is needed.
    """
    if not _PSEUDONYM.fullmatch(participant):
        raise AllocationError(
            f"participant {participant!r}: a pseudonym of a letter and up to 15 letters or digits is expected, "
            "as P001; with --simulate also several, as P001..P040"
        )
    groups = sorted(study.groups)
    if row is not None and (group is not None or not groups):
        return ParticipantRow(participant, group, row)
    number = _number(participant)
    chosen = group if group is not None or not groups else groups[number % len(groups)]
    return ParticipantRow(participant, chosen, number // max(1, len(groups)) if row is None else row)


def _number(participant: str) -> int:
    counted = _COUNTED.fullmatch(participant)
    if counted is None:
        raise AllocationError(f"participant {participant!r} has no number, as P001 has; give --group and --row")
    return int(counted[1]) - 1
