"""Live sessions with an experimenter at work are killed at any instant, resumed, and lose nothing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from palpate.studies.sessions.ledger import open_for_append
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.session import create, resume
from tests.studies.live.halls import Hall
from tests.studies.live.nursery import KILLS, begin, ledger

ROOT = Path(__file__).resolve().parents[3]


def go_on(path):
    """Go on with an experimenter who only mounts samples."""
    resume(path, Hall([(0.0, "confirm")] * 9).rig)


def left_paused(record) -> bool:
    does = [event.value["do"] for event in record.events if event.kind == "experimenter"]
    return does.count("pause") != does.count("go_on")


@pytest.mark.needs("posix")
def test_a_killed_live_session_keeps_every_aside_and_goes_on(tmp_path):
    subprocess.run([sys.executable, "-m", "tests.studies.live.nursery", str(tmp_path)], cwd=ROOT, check=True)
    whole = read(ledger(tmp_path / "whole"))
    assert whole.complete and sum(event.kind == "experimenter" for event in whole.events) == 8
    cut_at = set()
    for number in range(KILLS):
        path = ledger(tmp_path / str(number))
        if not path.exists():
            continue
        recorded = read(path)
        cut_at.add(len(recorded.events))
        assert recorded.events == whole.events[: len(recorded.events)]
        if not recorded.ended:
            go_on(path)
        record = read(path)
        assert record.complete and record.events[: len(recorded.events)] == recorded.events and not left_paused(record)
        replay(path)
    assert len(cut_at) > 2, "the kills fell on different places"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The record of a busy session that nothing disturbs."""
    lab = tmp_path_factory.mktemp("whole")
    begin(lab)
    return read(ledger(lab))


@pytest.mark.parametrize("events", range(2, 30))
def test_a_live_session_cut_at_any_event_goes_on(tmp_path, whole, events):
    path, at = ledger(tmp_path), {"at": "2026-01-01T00:00:00+00:00"}
    create(path, whole.header, at)
    cut = open_for_append(path, at)
    for event in whole.events[1:events]:
        cut.append(event)
    cut.close(at)
    go_on(path)
    record = read(path)
    assert record.complete and record.events[:events] == whole.events[:events] and not left_paused(record)
    replay(path)
