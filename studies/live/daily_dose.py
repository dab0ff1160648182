"""The noise and vibration that a participant has had today, by the lab's ledgers, and how much more may follow."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import date, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from palpate.devices.vibrator.settings import Limits
from palpate.protocols.events import NS, Event
from palpate.protocols.plan import Plan
from palpate.studies.sessions.environment import wall_time
from palpate.studies.sessions.record import LedgerError, Record, read, read_header
from palpate.studies.sessions.session_files import ledgers_in

if TYPE_CHECKING:
    from palpate.devices.rig.opened import OpenRig
    from palpate.devices.sound.device import MaskingNoise
    from palpate.devices.vibrator.device import Vibrator


def demand_dose(rig: OpenRig, plan: Plan, lab: Path, now: Callable[[], str] = wall_time) -> None:
    """Limit masking noise and vibration to what is left of the participant's dose of the day.

    Raises DeviceError if nothing is left, or less noise than the study's `minutes` need.
    """
    who = plan.who.participant
    if "masking_noise" in plan.study.needs:
        noise = cast("MaskingNoise", rig.of("masking_noise")["masking_noise"])
        measured = noise.settings.db_spl_at_0_dbfs is not None
        noise.limit_dose(noise_had(lab, who, local_day(now())), plan.study.minutes if measured else None)
    if "vibration" in plan.study.needs:
        vibrator = cast("Vibrator", rig.of("vibration")["vibrator"])
        vibrator.limit_dose(vibration_had(lab, who, local_day(now())))


def local_day(at: str) -> date:
    """Return the day of a moment by this machine's time zone."""
    return datetime.fromisoformat(at).astimezone().date()


def noise_had(lab: Path, participant: str, day: date) -> float:
    """Return the share of the daily dose of noise in a participant's live sessions of that day; 1 is all of it."""
    from palpate.devices.sound.dose import share_of_day

    return sum(
        share_of_day(db_a, _seconds_on(events))
        for header, events in runs_of(lab, participant, day)
        if (db_a := _level(header)) is not None
    )


def vibration_had(lab: Path, participant: str, day: date) -> float:
    """Return the weighted energy of the vibrations in a participant's live sessions of that day, in m^2/s^3.

    One that was broken off, by a pause, a repeat, a fault or the end of the program, counts as the strongest of its run
    that was played to its end, or else as the most that its driver allows.
    """
    total = 0.0
    for header, events in runs_of(lab, participant, day):
        if "vibration" not in header["study"].get("needs", ()):
            continue
        whole = [
            float(event.value["vibration"].get("hand_arm_m2_s3", 0.0))
            for event in events
            if event.kind == "reply" and "vibration" in event.value
        ]
        total += sum(whole) + _broken_off(events) * max(whole or [_most_energy(header)])
    return total


def _broken_off(events: tuple[Event, ...]) -> int:
    """Return how many vibrations of a run began and were not played to their end."""
    count, playing = 0, False
    for event in events:
        if event.kind == "request":
            playing = event.value["do"] == "present" and not event.value.get("blank", False)
        elif event.kind == "reply":
            playing = False
        elif playing and (event.kind == "fault" or event.value.get("do") in ("pause", "repeat", "abort")):
            count, playing = count + 1, event.value.get("do") == "pause"
    return count + playing


def _most_energy(header: dict[str, Any]) -> float:
    """Return the most energy that the session's vibrator allows within its window."""
    devices = (header["rig"].get("devices") or {}).values()
    limits = [Limits.model_validate(one.get("limits", {})) for one in devices if one.get("kind") == "vibrator"]
    return max(one.hand_arm_m_s2**2 * one.window_s for one in limits or [Limits()])


def runs_of(lab: Path, participant: str, day: date) -> Iterator[tuple[dict[str, Any], tuple[Event, ...]]]:
    """Yield the header of each live session of the participant and the events of each run that was started that day.

    Sessions at twins count too: a ledger does not know who took part. One that cannot be read is left out.
    """
    for path in ledgers_in(lab):
        try:
            header = read_header(path)
            if header["participant"] == participant and header["rig"]["kind"] == "live":
                yield from ((header, events) for events in runs_on(read(path), day))
        except LedgerError:
            continue


def _level(header: dict[str, Any]) -> float | None:
    """Return the level of the masking noise in dB(A); None if there was none, or nobody measured it."""
    described = (header["rig"].get("devices") or {}).values()
    return next((float(one["db_a"]) for one in described if one.get("kind") == "masking_noise" and "db_a" in one), None)


def runs_on(record: Record, day: date) -> Iterator[tuple[Event, ...]]:
    """Yield the events of each run of a session that was started on that day."""
    notes = record.run_notes
    for place, note in enumerate(notes):
        if note.kind == "opened" and local_day(note.value["at"]) == day:
            end = next((later.events for later in notes[place + 1 :]), len(record.events))
            yield record.events[note.events : end]


def _seconds_on(events: tuple[Event, ...]) -> float:
    """Return how long the noise was on: from a run's first presentation to its last event, without pauses.

    A run may begin within a presentation, that of the run before.
    """
    first = next((e for e in events if e.value.get("do") == "present" or "presented" in e.value), None)
    if first is None:
        return 0.0
    first_ns = events[0].t_ns if first.kind == "reply" else first.t_ns
    on_ns, since_ns = 0, first_ns
    paused = False
    for event in (event for event in events if event.t_ns >= first_ns and event.kind == "experimenter"):
        if event.value["do"] == "pause" and not paused:
            on_ns, paused = on_ns + event.t_ns - since_ns, True
        elif event.value["do"] == "go_on" and paused:
            since_ns, paused = event.t_ns, False
    return (on_ns + (0 if paused else events[-1].t_ns - since_ns)) / NS
