"""What the experimenter does meanwhile is an event at once, and replays like any other."""

import pytest

from palpate.protocols.events import Aside, Ask, Present, ReplyError
from palpate.protocols.runner import EndOfRecord, Recorded, run
from tests.protocols.studies_for_tests import toy_plan
from tests.protocols.worlds_for_tests import Interrupting, MemoryLog, replay_record

PLAN = toy_plan(order={"design": "as_listed"})
NOTE = {"do": "note", "text": "sneezed"}
REPEAT, LAST = {"do": "repeat", "which": "this"}, {"do": "repeat", "which": "last"}


def desk_with(**asides):
    """A world in which the experimenter does these things at the n-th request."""
    return Interrupting(**{key: [Aside(value) for value in values] for key, values in asides.items()})


def ran(**asides):
    log, desk = MemoryLog(), desk_with(**asides)
    run(PLAN, desk, log, {})
    return log, desk


def test_a_note_stands_between_a_request_and_its_reply():
    log, _ = ran(n2=[NOTE, {"do": "pause"}, {"do": "go_on"}])
    assert log.words()[4:9] == ["ask", "experimenter", "experimenter", "experimenter", "answer"]
    assert log.events[5].value == NOTE and log.events[5].trial == 1
    replay_record(PLAN, log.events)


def test_a_rest_of_the_participants_is_on_record_and_replays():
    rest = [{"do": do, "by": "participant"} for do in ("pause", "go_on")]
    log, _ = ran(n2=rest)
    assert [event.value for event in log.events[5:7]] == rest
    replay_record(PLAN, log.events)
    for end in (6, 7):
        with pytest.raises(EndOfRecord):
            replay_record(PLAN, log.events[:end])


def test_a_note_is_recorded_before_the_answer():
    log, desk = MemoryLog(), desk_with(n2=[NOTE])
    seen = []
    log.on_append = lambda event: seen.append((event.kind, len(desk.script[2])))
    run(PLAN, desk, log, {})
    assert seen[5] == ("experimenter", 0) and seen[6][0] == "reply"


def test_a_trial_that_is_repeated_is_felt_again():
    log, _ = ran(n2=[REPEAT])
    assert " ".join(log.words()[1:12]) == ("A1( present . ask experimenter )repeated A2( present . ask answer")
    replay_record(PLAN, log.events)


def test_the_last_trial_is_repeated_and_its_answer_is_forgotten():
    log, desk = ran(n4=[LAST])
    assert " ".join(log.words()[7:21]) == (
        "B1( present . ask experimenter )repeated A2( present . ask answer )answered B2( present"
    )
    again = [request for request in desk.requests if isinstance(request, Ask)][2]
    assert again.trial.previous is None
    replay_record(PLAN, log.events)


def test_the_first_trial_has_none_before_it():
    log, _ = ran(n1=[LAST])
    assert " ".join(log.words()[1:7]) == "A1( present experimenter )repeated A2( present"


def test_a_session_that_is_aborted_is_over():
    log, desk = ran(n3=[NOTE, {"do": "abort", "text": "felt unwell"}])
    assert log.words()[-3:] == ["experimenter", "experimenter", "session_ended"]
    assert log.events[-1].value == {"trials": 4, "as": "aborted"} and log.events[-1].trial is None
    assert isinstance(desk.requests[-1], Present)
    replay_record(PLAN, log.events)


@pytest.mark.parametrize("cut", range(1, 12))
def test_a_record_with_asides_cut_anywhere_goes_on(cut):
    whole, _ = ran(n2=[NOTE, REPEAT])
    events = whole.events[:cut]
    with pytest.raises(EndOfRecord):
        tape = Recorded(events)
        run(PLAN, tape, tape, {})
    log = MemoryLog(list(events))
    desk = desk_with()
    desk.t_ns = 1000
    tape = Recorded(events, desk, log)
    run(PLAN, tape, tape, {})
    assert log.events[:cut] == events and log.events[-1].value == {"trials": 4}


def test_a_rest_cannot_be_repeated():
    with pytest.raises(ReplyError, match="'repeat' is unknown, or not to be done here"):
        ran(n5=[REPEAT])


def test_an_unknown_act_is_refused():
    with pytest.raises(ReplyError, match="'dance' is unknown"):
        ran(n2=[{"do": "dance"}])
    with pytest.raises(ReplyError, match="'repeat' is unknown, or not to be done here"):
        ran(n2=[{"do": "repeat", "which": "next"}])


def test_the_calibration_is_confirmed_where_there_is_one():
    log, desk = MemoryLog(), desk_with()
    run(PLAN, desk, log, {"calibration": {"px_per_mm": 3.6}})
    assert log.events[1].value == {"do": "confirm", "what": "calibration"} and log.events[3].kind == "trial_started"
