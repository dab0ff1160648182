"""Sessions that come too early, too late or once too often, and what old and new ledgers of a session 2 say."""

import re
from datetime import date, datetime, timedelta
from pathlib import Path

import pytest

from palpate.studies.launching.launch import WrongTime, demand_in_time
from palpate.studies.sessions import session
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import recompiled, replay
from tests.protocols.studies_for_tests import toy

ROOT = Path(__file__).parents[3]
BY_THE_WALL_CLOCK = {
    "studies/sessions/environment.py": "wall_time, which dates sittings and the participants' records",
    "studies/commands_sessions.py": "the date of a live session, for the days between sessions",
    "devices/rig/commands_calibrate.py": "the date of a calibration",
    "devices/rig/commands_certify.py": "the date of a certificate",
    "devices/window/commands_calibrate.py": "the date of a calibration",
}


def test_nothing_of_a_session_is_timed_by_the_wall_clock():
    asks = re.compile(r"\btime\.time\b|\btime\.time_ns\b|datetime\.now|\bdate\.today|utcnow|CLOCK_REALTIME")
    files = [path for room in ("protocols", "signals", "devices", "studies") for path in (ROOT / room).rglob("*.py")]
    users = {path.relative_to(ROOT).as_posix() for path in files if asks.search(path.read_text("utf-8"))}
    assert users == set(BY_THE_WALL_CLOCK)


TWO = {"participants": {"sessions": 2, "apart_days": [1, 14]}}


def day_of(path):
    return datetime.fromisoformat(read(path).run_notes[-1].value["at"]).astimezone().date()


@pytest.mark.parametrize(
    ("fewest", "days", "reason"),
    [(1, 0, "0 days before today"), (2, 1, "1 day before today"), (1, 15, "15 days before today")],
)
def test_a_session_out_of_time_is_refused_or_accepted_on_record(lab, fewest, days, reason):
    two = {"participants": {"sessions": 2, "apart_days": [fewest, 14]}}
    study = toy(**two)
    first = day_of(lab.start(**two))
    today = first + timedelta(days)
    with pytest.raises(WrongTime, match=f"session 1 on {first}, {reason}; from {fewest} to 14 days .* --accept-timing"):
        demand_in_time(lab.path, study, "P001", 2, accept=False, today=today)
    timing = demand_in_time(lab.path, study, "P001", 2, accept=True, today=today)
    assert timing == {"timing": {"since_session": 1, "days": days, "apart_days": [fewest, 14]}}


def test_a_session_in_time_passes_and_simulated_ones_know_no_days(lab):
    study, first = toy(**TWO), day_of(lab.start(**TWO))
    for today in (first + timedelta(1), first + timedelta(14), None):
        assert demand_in_time(lab.path, study, "P001", 2, accept=False, today=today) is None
    with pytest.raises(
        WrongTime, match="session 3 of P001, and the study declares 2 sessions; --accept-timing runs it"
    ):
        demand_in_time(lab.path, study, "P001", 3, accept=False, today=None)
    assert demand_in_time(lab.path, toy(), "P001", 3, accept=False, today=date(2026, 1, 1)) is None


def test_a_later_session_of_before_repeats_the_first_and_one_of_now_is_its_own(lab):
    """A ledger of a session 2 that says nothing of its order is from before: it goes on by the rule it began with."""
    first = lab.start()
    before = session.start(lab.path, lab.plan(), lab.rig, 2).path
    now = session.start(lab.path, lab.plan(session=3), lab.rig, 3).path
    assert "over_sessions" not in read(before).header and read(now).header["over_sessions"] == "same"
    assert recompiled(read(before)) == recompiled(read(first)) and recompiled(read(now)).session == 3
    replies = [[e.value for e in read(path).events if e.kind == "reply"] for path in (first, before, now)]
    assert replies[0] == replies[1] and replies[0] != replies[2]
    assert all(replay(path).complete for path in (before, now))
