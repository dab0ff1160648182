import json
import sqlite3
from dataclasses import replace

import pytest

from palpate.protocols.events import Event
from palpate.protocols.runner import Divergence
from palpate.protocols.tasks import Task
from palpate.studies.sessions.record import LedgerError, read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.rig import Rig, RigError
from palpate.studies.sessions.session import resume, start
from palpate.studies.sessions.session_files import ledger_path
from tests.studies.labs import HEADER, Lab, stopping


def same(one, other) -> bool:
    """Event for event equal except times."""

    def timeless(event: Event):
        samples = [(s.stream, s.channels, s.units, s.rate_hz, s.data) for s in event.samples]
        return event.seq, event.kind, event.trial, event.attempt, event.body, samples

    return [timeless(e) for e in one.events[1:]] == [timeless(e) for e in other.events[1:]]


def test_a_session_runs_to_its_end_and_explains_itself(lab):
    record = read(lab.start())
    assert record.complete and record.path == lab.path / "sessions" / "toy_P001_s1.sqlite"
    header = record.header
    assert header["plan"] == lab.plan().digest and header["trials"] == 4
    assert header["rig"] == {"kind": "simulated", "twins": []}
    assert set(header["environment"]) == {"palpate", "code", "python", "platform", "packages"}
    assert len(header["environment"]["code"]) == 64
    assert record.run_notes[-1].value["because"] == "complete"


def test_two_runs_of_one_seed_are_equal(lab, tmp_path):
    one, other = read(lab.start()), read(Lab(tmp_path / "other").start())
    assert one.events == other.events


@pytest.mark.parametrize("events", [1, 2, 3, 4, 5, 6, 7, 8, 14, 20, 27])
def test_a_session_cut_at_any_event_goes_on_to_the_uninterrupted_one(lab, events):
    path = lab.cut(events)
    assert len(read(path).events) == events
    result = resume(path, lab.rig)
    assert result.complete and read(path).events == lab.__class__(lab.path / "whole").read().events
    replay(path)


@pytest.mark.parametrize("acts", [0, 1, 5, 9])
def test_an_interrupted_session_is_laid_down_safe_and_goes_on(lab, tmp_path, acts):
    path = lab.start(rig=stopping(lab.rig, acts))
    record = read(path)
    assert not record.complete
    assert record.run_notes[-1].value["because"] == "interrupted by SIGTERM"
    assert record.events[-1].kind == "request"
    assert resume(path, stopping(lab.rig, 2)).reason == "interrupted by SIGTERM"
    assert resume(path, lab.rig).complete
    assert same(read(path), read(Lab(tmp_path / "whole").start()))
    kinds = [s.kind for s in read(path).run_notes]
    assert kinds == ["created", *["opened", "closed"] * 3]


def order_of_ends(lab, monkeypatch, safe_fails=False, **how):
    from palpate.studies.sessions.ledger import Ledger

    ends, close = [], Ledger.close

    def safe():
        ends.append("safe")
        if safe_fails:
            raise OSError("the brake does not answer")

    def closing(self, body):
        ends.append("closed")
        close(self, body)

    monkeypatch.setattr(Ledger, "close", closing)

    planned = stopping(lab.rig, 3, **how)

    def opened(plan, t_ns):
        ends.append("opened")
        return Rig(planned.open(plan, t_ns).world, safe)

    try:
        lab.start(rig=replace(planned, open=opened))
    except Exception as error:
        ends.append(str(error))
    return ends


def test_the_rig_is_safe_before_the_ledger_is_closed(lab, monkeypatch):
    assert order_of_ends(lab, monkeypatch) == ["opened", "safe", "closed"]


def test_the_ledger_is_closed_where_the_rig_cannot_be_made_safe(lab, monkeypatch):
    assert order_of_ends(lab, monkeypatch, safe_fails=True) == ["opened", "safe", "closed", "the brake does not answer"]


def test_a_failing_device_ends_the_session_safe_and_is_reported(lab, monkeypatch):
    ends = order_of_ends(lab, monkeypatch, error=lambda: RuntimeError("the motor stalled"))
    assert ends == ["opened", "safe", "closed", "the motor stalled"]
    assert lab.read().run_notes[-1].value["because"] == "failed: RuntimeError: the motor stalled"
    assert resume(lab.read().path, lab.rig).complete


def test_a_finished_session_is_not_resumed(lab):
    path = lab.start()
    before = path.read_bytes()
    with pytest.raises(LedgerError, match="the session is complete"):
        resume(path, lab.rig)
    assert path.read_bytes() == before


def test_a_participant_has_one_session_of_a_number(lab):
    lab.start()
    with pytest.raises(LedgerError, match=r"P001 has had session 1 of toy \(complete\); .* give --session 2"):
        lab.start()
    assert start(lab.path, lab.plan(), lab.rig, 2).complete
    assert ledger_path(lab.path, "toy", "P001", 2).exists()


def test_a_changed_task_is_not_resumed_into(lab, monkeypatch):
    from palpate.protocols.tasks import steps

    path = lab.start(rig=stopping(lab.rig, 5))
    before = read(path).events

    def eager(trial):
        return steps.outcome_of((yield steps.Ask(trial.form, trial)))

    monkeypatch.setattr("palpate.protocols.runner.TASKS", {"slider_rating": Task("", eager)})
    with pytest.raises(Divergence, match=r"event 2 \(request, trial 1\): \$\.back: not recorded, now false"):
        resume(path, lab.rig)
    assert read(path).events == before


def test_a_plan_that_compiles_to_another_digest_is_refused(lab, monkeypatch):
    path = lab.start()
    monkeypatch.setattr("palpate.protocols.plan.williams_row", lambda n, row: tuple(range(n)))
    with pytest.raises(LedgerError, match="now compiles to another plan: the order of the trials differs"):
        replay(path)


def test_a_replay_says_how_fast_it_was(lab):
    result = replay(lab.start())
    assert result.complete and result.events > 20
    assert result.speed == result.session_s / result.seconds > 20


def test_an_interrupted_session_replays_to_where_it_ends(lab):
    result = replay(lab.start(rig=stopping(lab.rig, 5)))
    assert not result.complete


def test_without_a_device_nothing_can_be_sensed(lab):
    from palpate.protocols.events import Sense

    plan = lab.plan()
    with pytest.raises(RigError, match="no device of this study can do 'sense'"):
        lab.rig.open(plan, 0).world.perform(Sense("door", 1.0, plan.trials[0]))


def test_the_error_that_ended_a_session_is_the_one_reported(lab, monkeypatch):
    from palpate.studies.sessions.ledger import Ledger

    record = Ledger.record_run_note

    def full(self, kind, body):
        if kind == "closed":
            raise LedgerError("the note could not be kept")
        record(self, kind, body)

    monkeypatch.setattr(Ledger, "record_run_note", full)
    with pytest.raises(RuntimeError, match="the motor stalled"):
        lab.start(rig=stopping(lab.rig, 3, error=lambda: RuntimeError("the motor stalled")))
    monkeypatch.undo()
    assert resume(lab.read().path, lab.rig).complete


def test_a_rig_that_cannot_be_had_leaves_nothing_behind(lab):
    def no(_plan):
        raise RigError("the door is not there")

    with pytest.raises(RigError):
        start(lab.path, lab.plan(), replace(lab.rig, check=no))
    assert not (lab.path / "sessions").exists()


def test_a_header_that_declares_nothing_is_refused(lab):
    from palpate.studies.sessions.ledger import create

    path = lab.path / "sessions" / "toy_P001_s1.sqlite"
    create(path, HEADER, {"at": "2026-01-01T00:00:00+00:00"})
    with pytest.raises(LedgerError, match="its first event declares no session that this version reads"):
        replay(path)


def test_events_after_the_end_are_noticed(lab):
    from palpate.studies.sessions.ledger import open_for_append

    path = lab.start()
    ledger = open_for_append(path, {"at": "2026-01-01T00:00:00+00:00"})
    last = ledger.record.events[-1]
    ledger.append(Event(last.seq + 1, last.t_ns, "experimenter", b'{"do":"note"}'))
    ledger.close({"at": "2026-01-01T00:00:00+00:00"})
    for act in (lambda: replay(path), lambda: resume(path, lab.rig)):
        with pytest.raises(Divergence, match="recorded, but the session is over before it"):
            act()


def test_the_receipt_counts_what_was_planned_written_and_read_back(lab):
    result = start(lab.path, lab.plan(), lab.rig)
    record = read(result.path)
    expected = {"planned": result.events, "written": result.events, "read_back": result.events, "digest": record.head}
    assert result.receipt.good and result.receipt.to_dict() == expected == record.run_notes[-1].value["receipt"]
    assert str(result.receipt) == (
        f"receipt: {result.events} events planned, {result.events} written, {result.events} read back from the disk; "
        f"digest {record.head[:16]}"
    )
    stopped = start(lab.path, lab.plan("P002"), stopping(lab.rig, 5))
    assert stopped.status == "interrupted" and stopped.receipt.good
    assert resume(stopped.path, lab.rig).receipt.good


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        ("DELETE FROM events WHERE seq = (SELECT max(seq) FROM events)", "read back from the disk"),
        ("UPDATE events SET body = '{}' WHERE seq = 3", "the hash chain breaks at event 3"),
    ],
)
def test_a_receipt_shows_in_red_what_the_disk_does_not_hold(lab, monkeypatch, capsys, damage, message):
    from click.exceptions import Exit

    from palpate.studies.commands_sessions import report

    def damaged():
        connection = sqlite3.connect(lab.path / "sessions" / "toy_P001_s1.sqlite")
        connection.execute(damage)
        connection.commit()
        connection.close()

    result = start(lab.path, lab.plan(), with_safe(lab.rig, damaged))
    assert result.complete and not result.receipt.good
    with pytest.raises(Exit):
        report([result], False, None)
    assert message in capsys.readouterr().out
    with pytest.raises(Exit):
        report([result], True, None)
    assert json.loads(capsys.readouterr().out)[0]["receipt"]["planned"] == result.events


def with_safe(rig, act):
    """The same rig, which does something else when it is made safe."""

    def opened(plan, t_ns):
        return replace(rig.open(plan, t_ns), safe=act)

    return replace(rig, open=opened)
