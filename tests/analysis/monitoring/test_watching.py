from __future__ import annotations

import json
import os
import shutil
import sqlite3
from dataclasses import replace
from datetime import datetime
from itertools import pairwise

import pytest

from palpate.analysis.monitoring import finished, following, watching
from palpate.analysis.monitoring.watching import MonitorError, People, Watch
from palpate.protocols.canonical import canonical
from palpate.protocols.events import Event, Fault, Present
from palpate.protocols.plan import compile_plan
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.sessions import session
from palpate.studies.sessions.ledger import open_for_append
from palpate.studies.sessions.record import read
from palpate.studies.sessions.rig import Rig, RigPlan
from palpate.studies.sessions.session_files import ledger_path
from palpate.studies.simulation.rig import simulated
from tests.analysis.monitoring.people_for_tests import PLAIN, play, run, straight
from tests.protocols.studies_for_tests import toy, toy_plan
from tests.studies.labs import Lab

AT = {"at": "2026-01-01T00:00:00+00:00"}


@pytest.fixture
def lab(tmp_path):
    return Lab(tmp_path)


def seen(lab, **how):
    return {session.participant: session for session in Watch(lab.path, **how).look().sessions}


def test_each_way_a_session_can_stand_is_distinguished(lab):
    run(lab, "P001")
    run(lab, "P002", stop_before=3)
    run(lab, "P003", asides=[(2, {"do": "abort", "text": "unwell"})])
    cut = lab.cut(20, "P004")
    ledger = open_for_append(cut, AT)
    standing = {
        who: (session.status, session.trials_done, session.trials_planned) for who, session in seen(lab).items()
    }
    ledger.close({**AT, "because": "interrupted"})
    assert standing == {
        "P001": ("complete", 4, 4),
        "P002": ("interrupted", 2, 4),
        "P003": ("aborted", 1, 4),
        "P004": ("running", standing["P004"][1], 4),
    }


def test_who_did_not_consent_declined(lab):
    path = ledger_path(lab.path, "toy", "P002")
    session.create(path, session.header_of(toy_plan("P002"), lab.rig), AT)
    ledger = open_for_append(path, AT)
    ledger.append(Event(1, 5, "session_ended", canonical({"trials": 4, "as": "declined"})))
    ledger.close({**AT, "because": "declined"})
    assert seen(lab)["P002"].status == "declined"


def test_going_back_does_not_make_more_trials_of_them(lab):
    lab.start("P001", simulation={"latents": {"Soft": {"size": 4.0}}, "revise_rate": 0.5})
    session = seen(lab)["P001"]
    assert (session.trials_done, session.trials_planned) == (4, 4)
    assert any(event.kind == "trial_ended" and event.value["as"] == "left" for event in lab.read("P001").events)


@pytest.mark.parametrize(("which", "left"), [("this", 1), ("last", 0)])
def test_a_trial_to_be_repeated_is_not_done_until_it_is_answered_again(lab, which, left):
    asides = [(2, {"do": "repeat", "which": which})]
    run(lab, "P001", asides=asides, stop_before=2)
    run(lab, "P002", asides=[(2, {"do": "repeat", "which": which})])
    sessions = seen(lab)
    assert (sessions["P001"].trials_done, sessions["P002"].trials_done) == (left, 4)
    assert sessions["P001"].notes[0].do == "repeat"


def test_the_time_left_is_the_participants_own_median_from_trial_to_trial(lab):
    plan = toy_plan("P001", **PLAIN)
    path = run(lab, "P001", stop_before=4)
    events = read(path).events
    marks = [next(e.t_ns for e in events if e.kind == "trial_started")]
    marks += [event.t_ns for event in events if event.kind == "trial_ended"]
    steps = sorted(b - a for a, b in pairwise(marks))
    assert len(steps) == 3
    assert seen(lab)["P001"].left_s == pytest.approx(steps[1] / 1e9)
    assert len(plan.trials) == 4


def test_before_three_trials_no_time_left_is_reported(lab):
    run(lab, "P001", stop_before=3)
    assert seen(lab)["P001"].left_s is None


def test_a_session_that_ran_by_the_wall_clock_tells_its_notes_by_it(lab):
    asides = [(2, {"do": "note", "text": "hand cold"}), (2, {"do": "pause"}), (2, {"do": "go_on"})]
    plan = toy_plan("P001", **PLAIN)
    rig = simulated(plan.study, lab.path)
    path = play(lab.path, plan, rig.__class__({"kind": "window"}, rig.check, rig.open), asides=asides)
    note, pause, go_on = seen(lab)["P001"].notes
    opened = json.loads(sqlite3.connect(path).execute("SELECT body FROM sittings WHERE n = 1").fetchone()[0])["at"]
    assert (note.do, note.text, note.trial, pause.do, go_on.do) == ("note", "hand cold", 2, "pause", "go_on")
    assert note.at == pytest.approx(datetime.fromisoformat(opened).timestamp() + note.at_s)


@pytest.mark.parametrize(
    ("blind", "text"), [({}, "door: A is too steep"), ({"blind": ["kind"]}, "door: … is too steep")]
)
def test_a_fault_names_no_stimulus_where_the_study_keeps_something_blind(lab, blind, text):
    plan = toy_plan("P001", **({"console": blind} if blind else {}), **PLAIN)

    class Fails:
        def __init__(self, world):
            self.world, self.faults = world, [Fault({"device": "door", "what": "refused", "message": "A is too steep"})]

        def now(self):
            return self.world.now()

        def perform(self, request):
            return self.faults.pop() if self.faults and isinstance(request, Present) else self.world.perform(request)

    inner = simulated(plan.study, lab.path)
    opened = RigPlan(inner.description, inner.check, lambda plan, t_ns: Rig(Fails(inner.open(plan, t_ns).world), int))
    session.start(lab.path, plan, opened)
    for _ in range(2):  # the second look takes the finished session from what is kept
        assert [note.text for note in seen(lab)["P001"].notes] == [text]


def test_the_last_events_age_is_that_of_the_file(lab):
    path = run(lab, "P001", stop_before=2)
    os.utime(path, (1000.0, 1000.0))
    assert seen(lab, now=lambda: 1042.0)["P001"].last_event_age_s == 42.0


def test_a_straight_liner_is_flagged_and_the_others_are_not(lab):
    changes = {"order": {"design": "williams", "repeats": 3}}
    run(lab, "P001", changes=changes)
    run(lab, "P002", changes=changes, change=straight(2.0))
    sessions = seen(lab)
    assert sessions["P001"].rated.flags == ()
    assert {sign.name for sign in sessions["P002"].rated.flags} >= {"same value on all items", "same answers in a row"}
    assert sessions["P001"].rated.signs[6].n == 2 * 4 * 2  # retest: two attributes, four stimuli, three meetings


def test_words_are_diagnosed_as_words_and_captures_not_at_all(lab):
    words = {"task": "adjective_selection", "adjectives": {"words": ["soft", "warm", "rough"]}, "attributes": (),
             "scale": None, "simulation": {"latents": {"soft": {"size": 1.0}}}}  # fmt: skip
    study = {key: value for key, value in {**toy(**PLAIN).definition(), **words}.items() if value is not None}
    plan = compile_plan(Study.model_validate(study), ParticipantRow("P001"), 0)
    play(lab.path, plan, simulated(plan.study, lab.path))
    session = seen(lab)["P001"]
    assert (session.rated.kind, session.trials_done) == ("words", 4)
    assert session.rated.signs[0].name == "words ticked"


def test_bad_ledgers_are_named_with_their_reason_and_the_others_are_shown(lab):
    run(lab, "P001")
    newer, damaged = run(lab, "P002"), run(lab, "P003")
    with sqlite3.connect(newer) as connection:
        connection.execute("PRAGMA user_version = 99")
    connection.close()
    with sqlite3.connect(damaged) as connection:
        connection.execute("UPDATE events SET body = body || ' ' WHERE seq = 3")
    connection.close()
    shutil.copy(newer, newer.with_name("copy of P002.sqlite"))
    view = Watch(lab.path).look()
    assert [session.participant for session in view.sessions] == ["P001"]
    reasons = {refusal.file: refusal.reason for refusal in view.refused}
    assert "a newer Palpate" in reasons["toy_P002_s1.sqlite"]
    assert "breaks at event 3" in reasons["toy_P003_s1.sqlite"]
    assert view.others == ("copy of P002.sqlite",)


def test_a_session_whose_trials_are_not_those_of_its_plan_is_refused(lab):
    path = ledger_path(lab.path, "toy", "P002")
    session.create(path, session.header_of(toy_plan("P002"), lab.rig), AT)
    ledger = open_for_append(path, AT)
    ledger.append(Event(1, 5, "trial_started", canonical({"stimulus": "Z", "block": "main"}), 1, 1))
    ledger.close({**AT, "because": "interrupted"})
    [refused] = Watch(lab.path).look().refused
    assert "now compiles to another order of trials" in refused.reason


def test_several_processes_read_what_one_reads(lab, monkeypatch):
    paths = [run(lab, who) for who in ("P001", "P002", "P003")]
    paths[1].write_bytes(paths[1].read_bytes()[:5000])
    one = Watch(lab.path).look()
    shutil.rmtree(lab.path / ".cache")
    monkeypatch.setattr(watching, "workers_for", lambda _ledgers: 2)
    two = Watch(lab.path, now=lambda: one.at).look()
    assert [session.participant for session in two.sessions] == ["P001", "P003"]
    assert (two.sessions, two.refused, two.balances) == (one.sessions, one.refused, one.balances)


def test_a_repaired_ledger_is_shown_again_and_a_deleted_one_is_not(lab):
    path = run(lab, "P001")
    good = path.read_bytes()
    path.write_bytes(good[:5000])
    watch = Watch(lab.path)
    assert len(watch.look().refused) == 1
    path.write_bytes(good)
    assert [session.status for session in watch.look().sessions] == ["complete"]
    path.unlink()
    view = watch.look()
    assert (view.sessions, view.refused) == ((), ())


def test_at_the_second_look_nothing_that_stayed_is_read(lab, monkeypatch):
    run(lab, "P001")
    run(lab, "P002", stop_before=2)
    watch = Watch(lab.path)
    first = watch.look()
    monkeypatch.setattr(following, "connect_to_read", lambda *_: pytest.fail("a ledger was opened"))
    monkeypatch.setattr(watching, "balance_of", lambda *_: pytest.fail("the balance was made anew"))
    again = watch.look()
    assert [session.file for session in again.sessions] == [session.file for session in first.sessions]
    assert again.balances == first.balances


def test_without_time_to_read_the_newest_come_first_and_the_rest_at_the_next_looks(lab):
    for number in range(1, 5):
        os.utime(run(lab, f"P00{number}"), (1000.0 + number, 1000.0 + number))
    watch = Watch(lab.path)
    assert watch.look(budget_s=-1).unread == 4
    assert watch.look().unread == 0
    assert watch.look(budget_s=-1).unread == 0


def test_a_lab_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(MonitorError, match="no such folder; give the lab's with --lab"):
        Watch(tmp_path / "nowhere").look()


def test_a_lab_without_sessions_is_shown_empty(tmp_path):
    view = Watch(tmp_path).look()
    assert (view.sessions, view.balances, view.refused) == ((), (), ())


def test_an_answer_off_the_scale_refuses_its_session_and_no_other(lab):
    whole = read(run(Lab(lab.path / "whole"), "P001", change=straight(7.0)))
    session.create(path := ledger_path(lab.path, "toy", "P001"), whole.header, AT)
    ledger = open_for_append(path, AT)
    for event in whole.events[1:]:  # No program writes such a ledger, but its hashes would be right.
        ledger.append(replace(event, body=event.body.replace(b"7.0", b"99.0")))
    ledger.close(AT)
    run(lab, "P002")
    watch = Watch(lab.path)
    for _ in range(2):
        view = watch.look()
        assert [session.participant for session in view.sessions] == ["P002"]
        assert [refusal.file for refusal in view.refused] == ["toy_P001_s1.sqlite"]
        assert "a finite number from -10 to 10 is expected" in view.refused[0].reason


def test_the_next_monitor_reads_no_finished_session_again(lab, monkeypatch):
    paths = [run(lab, "P001"), run(lab, "P002"), run(lab, "P003", stop_before=2)]
    first = Watch(lab.path, now=lambda: 1e9).look()
    opened = []
    monkeypatch.setattr(watching, "follow", lambda path: opened.append(path.name) or following.follow(path))
    again = Watch(lab.path, now=lambda: 1e9).look()
    assert again == first and opened == [paths[2].name]
    opened.clear()
    os.utime(paths[0], (1000.0, 1000.0))
    assert Watch(lab.path, now=lambda: 1e9).look() == first and opened == [paths[0].name, paths[2].name][::-1]
    opened.clear()
    (lab.path / finished.FILE).write_text('{"palpate monitor": "another"}\n{"damaged')
    assert Watch(lab.path, now=lambda: 1e9).look() == first and len(opened) == 3
    assert (lab.path / finished.FILE).read_text().count("\n") == 4  # the version, a study, two finished sessions


def test_a_finished_session_that_was_kept_is_marked_when_its_participant_withdraws(lab, monkeypatch):
    run(lab, "P001")
    assert Watch(lab.path).look().sessions[0].rated is not None
    monkeypatch.setattr(watching, "read_people", lambda *_: People(withdrawn=frozenset({"P001"})))
    [session] = Watch(lab.path).look().sessions
    assert session.withdrawn and session.rated is None
