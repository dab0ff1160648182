"""kill -9 of 20 sessions at random instants (10 in the bare run): nothing is lost but the act in progress."""

import subprocess
import sys
from collections import Counter
from pathlib import Path

from palpate.protocols.plan import Plan
from palpate.studies.sessions.record import read
from palpate.studies.sessions.session import resume, start
from palpate.studies.sessions.session_files import ledger_path
from tests.studies.sessions import nursery

ROOT = Path(__file__).resolve().parents[3]
NURSERIES = (1, 2)
KILLS_EACH = {False: 5, True: 10}
"""By whether it is the full run."""


def test_killed_at_any_instant_a_session_goes_on_to_the_uninterrupted_one(tmp_path, full_run):
    kills = KILLS_EACH[full_run]
    commands = [
        [sys.executable, "-m", "tests.studies.sessions.nursery", str(tmp_path / str(seed)), str(seed), str(kills)]
        for seed in NURSERIES
    ]
    processes = [subprocess.Popen(command, cwd=ROOT) for command in commands]
    assert [process.wait(timeout=900) for process in processes] == [0, 0]
    plan = nursery.the_plan()
    whole = timeless(read(start(tmp_path / "whole", plan, nursery.the_rig()).path))
    labs = [tmp_path / str(seed) / str(number) for seed in NURSERIES for number in range(kills)]
    fates = Counter(fate(lab, plan, whole) for lab in labs)
    assert sum(fates.values()) == 2 * kills
    # about two thirds are expected, on a quiet machine: 5 are four standard deviations fewer than 13
    assert fates["in the middle"] >= (5 if full_run else 2), fates
    assert fates["before it began"] >= 2 or not full_run, fates


def fate(lab: Path, plan: Plan, whole: list[tuple[object, ...]]) -> str:
    """Check one killed session; say where the kill found it."""
    path = ledger_path(lab, "door_ratings", "P001")
    if not path.exists():
        assert start(lab, plan, nursery.the_rig()).complete
        assert timeless(read(path)) == whole
        return "before it began"
    killed = read(path)
    assert timeless(killed) == whole[: len(killed.events)]
    if killed.complete:
        return "after it ended"
    assert resume(path, nursery.the_rig()).complete
    assert timeless(read(path)) == whole
    return "in the middle" if len(killed.events) > 1 else "at its beginning"


def timeless(record):
    """The events without their times."""
    return [(e.seq, e.kind, e.trial, e.attempt, e.body, tuple(s.data for s in e.samples)) for e in record.events]
