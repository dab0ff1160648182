"""The noise that a participant has had today, by the lab's ledgers, and how much more the session may give."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from palpate.protocols.events import NS, Event
from palpate.protocols.plan import Plan
from palpate.studies.sessions.environment import wall_time
from palpate.studies.sessions.record import LedgerError, Record, read, read_header
from palpate.studies.sessions.session_files import ledgers_in

if TYPE_CHECKING:
    from palpate.devices.rig.opened import OpenRig
    from palpate.devices.sound.device import MaskingNoise


def demand_dose(rig: OpenRig, plan: Plan, lab: Path, now: Callable[[], str] = wall_time) -> None:
    """Limit the masking noise to what is left of the participant's dose of the day.

    Raises DeviceError if nothing is left, or less than the study's `minutes` need.
    """
    if "masking_noise" not in plan.study.needs:
        return
    noise = cast("MaskingNoise", rig.of("masking_noise")["masking_noise"])
    share = share_of_day_had(lab, plan.who.participant, local_day(now()))
    measured = noise.settings.db_spl_at_0_dbfs is not None
    noise.limit_dose(share, plan.study.minutes if measured else None)


def local_day(at: str) -> date:
    """Return the day of a moment by this machine's time zone."""
    return datetime.fromisoformat(at).astimezone().date()


def share_of_day_had(lab: Path, participant: str, day: date) -> float:
    """Return the share of the daily dose in a participant's live sessions of that day; 1 is the whole dose.

    Sessions at twins count too: a ledger does not know who listened. One that cannot be read counts nothing.
    """
    share = 0.0
    for path in ledgers_in(lab):
        try:
            header = read_header(path)
            if header["participant"] != participant or header["rig"]["kind"] != "live":
                continue
            if (db_a := _level(header)) is not None:
                share += share_in(read(path), db_a, day)
        except LedgerError:
            continue
    return share


def _level(header: dict[str, Any]) -> float | None:
    """Return the level of the masking noise in dB(A); None if there was none, or nobody measured it."""
    described = (header["rig"].get("devices") or {}).values()
    return next((float(one["db_a"]) for one in described if one.get("kind") == "masking_noise" and "db_a" in one), None)


def share_in(record: Record, db_a: float, day: date) -> float:
    """Return the share of the daily dose in the runs of a session that were begun on that day.

    The noise counts from a run's first presentation to its last event, without pauses.
    """
    from palpate.devices.sound.dose import share_of_day

    notes, share = record.run_notes, 0.0
    for place, note in enumerate(notes):
        if note.kind != "opened" or local_day(note.value["at"]) != day:
            continue
        end = next((later.events for later in notes[place + 1 :]), len(record.events))
        share += share_of_day(db_a, _seconds_on(record.events[note.events : end]))
    return share


def _seconds_on(events: tuple[Event, ...]) -> float:
    """Return the seconds from the first presentation to the last event, without pauses."""
    begun_ns = next((e.t_ns for e in events if e.kind == "request" and e.value["do"] == "present"), None)
    if begun_ns is None:
        return 0.0
    on_ns, since_ns = 0, begun_ns
    paused = False
    for event in (event for event in events if event.t_ns >= begun_ns and event.kind == "experimenter"):
        if event.value["do"] == "pause" and not paused:
            on_ns, paused = on_ns + event.t_ns - since_ns, True
        elif event.value["do"] == "go_on" and paused:
            since_ns, paused = event.t_ns, False
    return (on_ns + (0 if paused else events[-1].t_ns - since_ns)) / NS
