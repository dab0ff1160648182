"""How a live session ends: by the experimenter, by a signal, by a crash; and what then goes on."""

import signal

import pytest

from palpate.devices.window.calibration import Calibration, write_calibration
from palpate.protocols.events import Ask
from palpate.studies.catalogue import SHIPPED
from palpate.studies.participants.admission import admit
from palpate.studies.participants.people import add, status_of
from palpate.studies.participants.registry import open_registry
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.session_files import ledger_path
from tests.studies.window.robot import Robot, RunningSession, pending

pytestmark = pytest.mark.needs("psychopy", "xvfb")

STUDY = "texture_ratings"


def start_session(hand, lab, *arguments):
    ledger = ledger_path(lab, STUDY, "P001")
    return RunningSession(hand.display.get_display_name(), lab, ledger, list(arguments))


def begin(hand, lab, *more):
    session = start_session(hand, lab, "run", STUDY, "--participant", "P001", "--lab", str(lab), *more)
    return session, Robot(hand, session, SHIPPED / STUDY, *("ko",) * ("ko" in more))


def at_trial(number):
    """The form of a trial is before the participant."""
    return lambda request, record: (
        isinstance(request, Ask) and request.trial is not None and request.trial.number == number
    )


def test_a_killed_window_loses_nothing_and_goes_on_at_the_same_form(hand, lab):
    session, robot = begin(hand, lab)
    before = robot.go_on(at_trial(2))
    session.kill()
    killed = read(session.ledger)
    assert killed.events[: len(before.events)] == before.events and pending(killed).trial.number == 2

    session = start_session(hand, lab, "resume", str(session.ledger))
    robot = Robot(hand, session, SHIPPED / STUDY)
    after = robot.go_on(at_trial(3))
    assert after.events[: len(killed.events)] == killed.events
    session.process.send_signal(signal.SIGTERM)
    session.end(status=1)
    assert read(session.ledger).run_notes[-1].value["because"] == "interrupted by SIGTERM"
    assert not replay(session.ledger).complete


def test_what_the_experimenter_does_is_on_record_at_once_as_the_study_says_where_korean_is_read(hand, lab):
    session, robot = begin(hand, lab, "--language", "ko")
    record = robot.go_on(at_trial(1))
    for order, does in (("note the fan came on", {"do": "note", "text": "the fan came on"}), ("pause", {"do": "pause"}),
                        ("go on", {"do": "go_on"}), ("repeat", {"do": "repeat", "which": "this"})):  # fmt: skip
        session.order(order)
        record = session.record(len(record.events))
        assert does in [event.value for event in record.events if event.kind == "experimenter"]
    record = robot.go_on(at_trial(2))
    assert [e.value["as"] for e in record.events if e.kind == "trial_ended"] == ["repeated", "answered"]
    session.order("abort felt unwell")
    record = session.record(len(record.events))
    session.order("confirm")
    session.end(status=1)
    assert record.status == "aborted" and "aborted" in session.output()
    assert replay(session.ledger).events == len(record.events)

    assert record.header["rig"]["language"] == "ko"
    assert set(dict(robot.given)) >= {"consent", "demographics", "sliders"}
    requests = (event.value for event in record.events if event.kind == "request")
    assert all(item.isascii() for item in next(body["items"] for body in requests if body.get("form") == "sliders"))


def test_who_declines_takes_no_part_and_gives_up_the_row(hand, lab):
    session, robot = begin(hand, lab)
    record = robot.go_on(lambda request, _record: isinstance(request, Ask))
    page = robot.page_of(record)
    assert pending(record).form.name == "consent" and page is not None
    decline(robot, pending(record), page)
    record = session.record(len(record.events))
    session.order("confirm")
    session.end(status=1)
    assert record.status == "declined"
    registry = open_registry(lab)
    assert status_of(registry, "P001") == "active"
    add(registry, "P002")
    assert admit(lab, shipped_study(), "P002", live=True).row == record.header["row"]


def decline(robot, request, page):
    from PIL import Image

    from palpate.devices.window.build import screen_for

    mirror = screen_for(request, page, 0)
    robot._see(mirror, Image.new("RGB", (page.metrics.width_px, page.metrics.height_px)), "consent")
    [button] = [placed for placed in mirror.placed() if placed.name == "decline"]
    robot.hand.click(*button.box.middle)


def shipped_study():
    from palpate.studies.catalogue import read_study

    return read_study(SHIPPED / STUDY / "study.yaml").study


def withdrawn(lab):
    from palpate.studies.participants.withdrawal import withdraw

    withdraw(open_registry(lab), "P001", "asked to")


@pytest.mark.parametrize(
    ("prepare", "message"),
    [
        (lambda lab: (lab / "stations").rename(lab / "old"), "this station's screen is not calibrated"),
        (lambda lab: (lab / "consent.md").write_text("I agree, [name]."), "not filled in: [name] (1 in all)"),
        (withdrawn, "P001 has withdrawn"),
        (lambda lab: (lab / "participants" / "registry.sqlite").unlink(), "P001 is not known"),
    ],
)
def test_a_session_that_may_not_be_is_refused_before_the_screen_is_looked_at(lab, run_palpate, prepare, message):
    prepare(lab)
    assert message in run_palpate("run", STUDY, "--participant", "P001", "--lab", lab, status=2)
    assert not ledger_path(lab, STUDY, "P001").exists()


def test_a_screen_of_another_size_is_refused_before_anything_is_recorded(hand, lab):
    write_calibration(lab, Calibration((1024, 768), 3.6, 0, "2026-01-01"))
    session, _ = begin(hand, lab)
    session.end(status=2)
    assert "calibrated at 1024x768 px, the screen has 1280x720" in session.output()
    assert "Traceback" not in session.output() and not session.ledger.exists()
