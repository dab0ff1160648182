"""Whether a session comes when the study wants it: as one of those declared, and so many days after the one before."""

from __future__ import annotations

from datetime import date, datetime, timedelta
from pathlib import Path
from typing import Any

from palpate.protocols.study import Study
from palpate.protocols.wording import count
from palpate.studies.sessions.record import read
from palpate.studies.sessions.session_files import ledger_path


class WrongTime(ValueError):
    """The session is not one that the study declares, or comes too early or too late."""


def demand_in_time(
    lab: Path, study: Study, participant: str, number: int, accept: bool, today: date | None
) -> dict[str, Any] | None:
    """Return what goes on record where the session is none that the study declares; None where it is one.

    `today` is the date that a live session is on; None for a simulated one, between whose sessions no day passes.
    The date of the earlier session is that of its last sitting, both in the station's time zone.
    Raises WrongTime unless it is accepted, LedgerError where the earlier session cannot be read.
    """
    sample = study.participants
    if sample is None:
        return None
    if sample.sessions is not None and number > sample.sessions:
        told = f"the study declares {count(sample.sessions, 'session')}"
        return _accepted(f"{study.study}: this is session {number} of {participant}, and {told}", accept, {
            "session": number, "sessions": sample.sessions})  # fmt: skip
    earlier = ledger_path(lab, study.study, participant, number - 1)
    if today is None or sample.apart_days is None or not earlier.is_file():
        return None
    before = datetime.fromisoformat(read(earlier).sittings[-1].value["at"]).astimezone().date()
    days, (fewest, most) = (today - before).days, sample.apart_days
    if fewest <= days <= most:
        return None
    come = f"from {before + timedelta(fewest)} to {before + timedelta(most)}"
    message = (
        f"{study.study}: {participant} had session {number - 1} on {before}, {count(days, 'day')} before today; from "
        f"{fewest} to {count(most, 'day')} are declared: have session {number} {come}"
    )
    return _accepted(message, accept, {"since_session": number - 1, "days": days, "apart_days": [fewest, most]})


def _accepted(message: str, accept: bool, timing: dict[str, Any]) -> dict[str, Any]:
    if not accept:
        raise WrongTime(f"{message}; --accept-timing has it all the same and goes on record")
    return {"timing": timing}
