"""Samples are put on record as they come; a device that fails ends the trial, which is repeated."""

import pytest

from palpate.protocols.events import Ask, Chunk, Event, Fault, Present, Reply, ReplyError, Samples
from palpate.protocols.runner import EndOfRecord, Recorded, run
from palpate.protocols.simulated_participants.perceiver import Perceiver
from tests.protocols.every_task import plan_of
from tests.protocols.studies_for_tests import toy_plan
from tests.protocols.worlds_for_tests import Interrupting, MemoryLog, replay_record

PLAN = toy_plan(order={"design": "as_listed"})
GONE = Fault({"device": "door", "what": "link_lost", "message": "the cable is out"})


def chunk(first):
    block = Samples("door", ("angle",), ("deg",), 500.0, first * 2_000_000, bytes(4 * 250), first, "door")
    return Chunk({"streams": {"door": {"first": first, "count": 250, "lost": 0}}}, (block,))


def ran(**script):
    log, lab = MemoryLog(), Interrupting(**script)
    run(PLAN, lab, log, {})
    return log, lab


def kinds(events):
    return [event.kind for event in events]


def test_chunks_stand_between_a_request_and_its_reply():
    log, _ = ran(n1=[chunk(0), chunk(250)])
    assert kinds(log.events)[2:6] == ["request", "samples", "samples", "reply"]
    assert [event.samples[0].first for event in log.events[3:5]] == [0, 250]
    assert log.events[4].value == chunk(250).value
    replay_record(PLAN, log.events)


def test_a_fault_marks_the_trial_which_is_repeated():
    log, lab = ran(n1=[chunk(0), GONE])
    met = [(event.kind, event.attempt) for event in log.events if event.kind.startswith("trial_")][:4]
    assert met == [("trial_started", 1), ("trial_ended", 1), ("trial_started", 2), ("trial_ended", 2)]
    assert [event.value["as"] for event in log.events if event.kind == "trial_ended"][:2] == ["faulted", "answered"]
    assert next(event for event in log.events if event.kind == "fault").value == GONE.value
    assert lab.requests[0].trial.number == lab.requests[1].trial.number
    replay_record(PLAN, log.events)


def test_a_fault_outside_a_trial_ends_the_run_and_is_not_recorded():
    plan, log, lab = toy_plan(order={"design": "as_listed"}, instructions="Read."), MemoryLog(), Interrupting(n1=[GONE])
    with pytest.raises(ReplyError, match="outside a trial: the cable is out"):
        run(plan, lab, log, {})
    assert kinds(log.events) == ["session_started", "request"]


def gone_on(events: list[Event]):
    """Go on where the events end, with a lab in which nothing is scripted."""
    log, lab = MemoryLog(), Interrupting()
    log.events, lab.t_ns = list(events), events[-1].t_ns
    tape = Recorded(events, lab, log)
    run(PLAN, tape, tape, {})
    return log.events


@pytest.mark.parametrize("cut", range(2, 14))
def test_a_session_cut_anywhere_goes_on_and_never_mixes_two_recordings(cut):
    log, _ = ran(n1=[chunk(0), chunk(250)], n3=[chunk(0), GONE])
    events = gone_on(log.events[:cut])
    replay_record(PLAN, events)
    for request, *rest in _acts(events):
        rest_kinds = [event.kind for event in rest]
        broken_off = "samples" in kinds(events[request.seq : cut]) and not {"reply", "fault"} & {
            *kinds(events[request.seq : cut])
        }
        assert rest_kinds[-1] in ({"fault"} if broken_off else {"reply", "fault"})
        firsts = [event.samples[0].first for event in rest if event.kind == "samples"]
        assert firsts == sorted(set(firsts)), "one recording only"


def _acts(events):
    act = []
    for event in events:
        if event.kind == "request":
            act = [event]
        elif act and event.kind in {"samples", "fault", "reply"}:
            act.append(event)
            if event.kind != "samples":
                yield act


def test_a_recording_that_the_record_breaks_off_in_is_a_fault_of_the_session():
    log, _ = ran(n1=[chunk(0), chunk(250)])
    events = gone_on(log.events[:4])
    assert kinds(events)[3:7] == ["samples", "fault", "trial_ended", "trial_started"]
    assert events[4].value["what"] == "interrupted"


def test_the_record_alone_ends_in_the_middle_of_a_recording():
    log, _ = ran(n1=[chunk(0), chunk(250)])
    tape = Recorded(log.events[:4])
    with pytest.raises(EndOfRecord):
        run(PLAN, tape, tape, {})


class Author(Interrupting):
    """Sets sliders and tries them once; the door fails at the first try."""

    def __init__(self):
        super().__init__()
        self.forms, self.failed = [], False

    def perform(self, request):
        if isinstance(request, Ask) and request.form.name == "authoring":
            self.forms.append(request)
            answers = dict.fromkeys(request.form.items(), float(10 * len(self.forms)))
            tried = request.former is not None
            return Reply({"answers": answers, "seconds": 1.0, **({} if tried else {"go": "try"})})
        if isinstance(request, Ask):
            return Reply(Perceiver(self.plan).answer(request)[0].value)
        if isinstance(request, Present) and not self.failed:
            self.failed = True
            return GONE
        return Reply({})


def test_a_setting_that_a_fault_interrupts_stands_in_the_form_again():
    author, log = Author(), MemoryLog()
    author.plan = plan_of("authoring")
    run(author.plan, author, log, {})
    first, again, other = author.forms[0], author.forms[1], author.forms[3]
    assert first.previous is None
    assert again.trial.attempt == 2 and set(again.previous.values()) == {10.0}
    assert other.trial.number != first.trial.number and other.previous is None
    tape = Recorded(log.events)
    run(author.plan, tape, tape, {})
    tape.demand_end()
