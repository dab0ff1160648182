"""Sessions at a live rig in virtual time: what the experimenter does, and what stands in the ledger then."""

import itertools

import pytest

from palpate.devices.samples import HandMounted
from palpate.protocols.events import Aside, Present, Reply
from palpate.protocols.plan import compile_plan
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.simulated_world import Done
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.live.opening import last_page
from palpate.studies.live.world import LiveWorld, Mounted, Station, TwinInRealTime, clock_from, compose_station
from palpate.studies.sessions.interrupts import Interrupted
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.session import resume, start
from tests.studies.live.halls import Hall, Stage, sheets, sheets_plan

ALL = [(0.0, "confirm")] * 8


def run_in(lab, hall, plan=None):
    return read(start(lab, plan or sheets_plan(), hall.rig).path)


def of_kind(record, kind):
    return [event.value for event in record.events if event.kind == kind]


def replies_to(record, do):
    """(request, reply) of every request of this kind that was answered."""
    pairs = zip(record.events, record.events[1:], strict=False)
    return [(a.value, b.value) for a, b in pairs if a.kind == "request" and a.value["do"] == do and b.kind == "reply"]


def test_every_sample_is_mounted_by_the_experimenter_and_the_session_replays(tmp_path):
    hall = Hall(ALL)
    record = run_in(tmp_path, hall)
    assert record.complete and record.header["rig"] == {"kind": "live", "window": {"stage": True}, "twins": [],
                                                        "language": "en"}  # fmt: skip
    presented = [reply for _, reply in replies_to(record, "present")]
    assert [(reply["presented"], reply["by"]) for reply in presented] == [(True, "experimenter")] * 4
    demands = [line for line in hall.paper.lines if line.startswith(">")]
    assert demands[0] == "> Put in place: T07 (sandpaper P60, box 3) (confirm when it is done)"
    assert demands[3] == "> Put in place: T41 (felt) (confirm when it is done)"
    assert hall.stage.pages[:2] == ["changing_sample", "ask"] and hall.stage.pages[-1] == "end"
    assert hall.stage.closed and hall.paper.closed and hall.desk.source.closed
    replay(record.path)


def test_a_presentation_takes_as_long_as_the_experimenter_does(tmp_path):
    record = run_in(tmp_path, Hall([(3.0, "confirm"), *ALL]))
    assert replies_to(record, "present")[0][1]["seconds"] == pytest.approx(3.0, abs=0.11)


def test_a_note_goes_on_record_where_it_was_written_and_disturbs_nothing(tmp_path):
    record = run_in(tmp_path, Hall([(0.0, "confirm"), (1.0, "note the fan came on"), *ALL]))
    [noted] = [event for event in record.events if event.kind == "experimenter"]
    assert noted.value == {"do": "note", "text": "the fan came on"} and noted.trial == 1
    assert record.events[noted.seq - 1].value["do"] == "ask" and record.events[noted.seq + 1].kind == "reply"
    assert replies_to(record, "present")[0][0]["stimulus"] == "T07"
    replay(record.path)


def test_a_computer_that_was_suspended_is_noted_and_the_answer_stays(tmp_path):
    hall = Hall([(0.0, "confirm"), *ALL])
    hall.suspended_ns = lambda: 3600 * 10**9 * (hall.time.t_ns > 10**9)
    record, plain = run_in(tmp_path / "suspended", hall), run_in(tmp_path / "plain", Hall([(0.0, "confirm"), *ALL]))
    [noted] = [event for event in record.events if event.kind == "experimenter"]
    assert noted.value == {"do": "note", "text": "The computer was suspended for 3600.0 s."} and noted.trial == 1
    assert of_kind(record, "reply") == of_kind(plain, "reply")
    replay(record.path)


@pytest.mark.parametrize(("at_s", "confirm_s"), [(0.5, 3.0), (2.0, 0.0)])
def test_pauses_are_on_record_and_in_no_time(tmp_path, at_s, confirm_s):
    orders = sorted(
        [(at_s, "pause"), (at_s + 30.0, "go on"), (confirm_s + (31.0 if confirm_s > at_s else 0), "confirm")]
    )
    hall = Hall([*orders, *[(99.0, "confirm")] * 4])
    record = run_in(tmp_path, hall)
    assert [value["do"] for value in of_kind(record, "experimenter")] == ["pause", "go_on"]
    first = next(event for event in record.events if event.kind == "trial_ended")
    present, ask = of_kind(record, "reply")[:2]
    assert first.t_ns / 1e9 > 31
    assert present["seconds"] == pytest.approx(confirm_s + (1.0 if confirm_s > at_s else 0), abs=0.4)
    assert ask["seconds"] == pytest.approx(2.0, abs=0.11)
    assert "pause" in hall.stage.pages
    replay(record.path)


def test_a_repeated_trial_starts_over_with_its_sample(tmp_path):
    record = run_in(tmp_path, Hall([(0.0, "confirm"), (1.0, "repeat"), *ALL]))
    firsts = [(e.trial, e.attempt) for e in record.events if e.kind == "trial_started"]
    assert firsts[:3] == [(1, 1), (1, 2), (2, 1)]
    assert [r["stimulus"] for r, _ in replies_to(record, "present")] == ["T07", "T07", "T12", "T33", "T41"]
    assert record.complete
    replay(record.path)


def test_the_last_trial_is_repeated_and_then_this_one(tmp_path):
    hall = Hall([(0.0, "confirm"), (0.0, "confirm"), (4.0, "repeat last"), *ALL])
    record = run_in(tmp_path, hall)
    firsts = [(e.trial, e.attempt) for e in record.events if e.kind == "trial_started"]
    assert firsts[:4] == [(1, 1), (2, 1), (1, 2), (2, 2)]
    assert hall.desk.status.done == {1, 2, 3, 4}


def test_a_repeat_takes_the_demand_away_with_its_trial(tmp_path):
    hall = Hall([(1.0, "repeat"), (2.0, "abort enough")])
    record = run_in(tmp_path, hall)
    assert [value["do"] for value in of_kind(record, "experimenter")] == ["repeat", "abort"]
    prompts = [view.prompt is not None for view in hall.paper.views]
    assert prompts[-1] is False and sum(a != b for a, b in itertools.pairwise(prompts)) >= 3


def test_an_aborted_session_says_why_and_is_over(tmp_path):
    hall = Hall([(0.0, "confirm"), (1.0, "abort felt unwell")])
    record = run_in(tmp_path, hall)
    assert of_kind(record, "experimenter") == [{"do": "abort", "text": "felt unwell"}]
    assert record.status == "aborted" and record.ended
    assert "the session is aborted" in hall.paper.lines[-1]


def test_nothing_can_be_repeated_outside_a_trial(tmp_path):
    hall = Hall([(0.5, "repeat"), (0.6, "repeat last"), *[(5.0, "confirm")] * 4])
    record = run_in(tmp_path, hall, compile_plan(sheets(instructions="Feel and rate."), ParticipantRow("P001")))
    assert record.complete and not of_kind(record, "experimenter")
    assert hall.paper.lines.count("no trial is under way: nothing to repeat now") == 2


def test_quitting_lays_the_session_down_and_resuming_goes_on_at_the_act(tmp_path):
    hall = Hall([(0.0, "confirm"), (1.0, "note first"), (1.5, "quit")])
    result = start(tmp_path, sheets_plan(), hall.rig)
    assert result.reason == "interrupted by QUIT" and hall.stage.closed and hall.paper.closed
    again = Hall([(1.5, "confirm")] * 4)
    assert resume(result.path, again.rig).complete
    assert again.paper.lines[0].startswith("trial 1 of 4: T07 (sandpaper P60, box 3); next T12")
    assert "note: first" not in again.paper.lines
    replay(result.path)


def test_a_session_left_in_a_pause_goes_on_when_it_is_resumed(tmp_path):
    result = start(tmp_path, sheets_plan(), Hall([(0.0, "confirm"), (1.0, "pause"), (20.0, "quit")]).rig)
    assert of_kind(read(result.path), "experimenter") == [{"do": "pause"}]
    hall = Hall([(1.5, "confirm")] * 4)
    assert resume(result.path, hall.rig).complete
    assert [value["do"] for value in of_kind(read(result.path), "experimenter")] == ["pause", "go_on"]
    assert not hall.desk.status.paused
    replay(result.path)


def twin_taking(seconds):
    """A twin that takes so long and says so."""

    def twin(request, t_ns):
        return Done(Reply({"presented": True, "seconds": seconds}), seconds)

    return twin


def test_a_stand_in_takes_its_time_and_its_replies_say_so(tmp_path):
    hall = Hall(station=Station(TwinInRealTime("door", twin_taking(4.0))))
    record = run_in(tmp_path, hall)
    times = [b.t_ns - a.t_ns for a, b in zip(record.events, record.events[1:], strict=False)
             if a.kind == "request" and a.value["do"] == "present"]  # fmt: skip
    assert all(4.0 <= t / 1e9 <= 4.21 for t in times)
    assert {reply["by"] for _, reply in replies_to(record, "present")} == {"twin"}
    assert hall.stage.pages[0] == "feel_now" and hall.desk.view.states["door"] == "simulated, idle"


def test_a_stand_in_stands_still_in_a_pause(tmp_path):
    hall = Hall([(1.0, "pause"), (50.0, "go on")], station=Station(TwinInRealTime("door", twin_taking(4.0))))
    record = run_in(tmp_path, hall)
    reply = next(event for event in record.events if event.kind == "reply")
    assert reply.t_ns / 1e9 == pytest.approx(53.2, abs=0.4)


def test_a_sample_is_mounted_before_a_device_presents_with_it(tmp_path):
    station = Station(Mounted(TwinInRealTime("texture_renderer", twin_taking(2.0)), HandMounted()))
    hall = Hall([(3.0, "confirm"), (4.0, "note now it renders"), *ALL], station=station)
    record = run_in(tmp_path, hall)
    assert record.complete and hall.stage.pages[:3] == ["changing_sample", "feel_now", "ask"]
    present = next(event for event in record.events if event.kind == "reply").value
    assert present["by"] == "experimenter, twin" and present["seconds"] == pytest.approx(5.0, abs=0.3)
    assert hall.paper.lines.count("> Put in place: T07 (sandpaper P60, box 3) (confirm when it is done)") == 1


def papers(**changes):
    """Two papers compared with a third, which a person mounts one after the other."""
    stimuli = [{"id": f"P{grit}", "columns": {"grit": str(grit)}} for grit in (60, 120, 180)]
    data = {
        "study": "papers", "task": "intervals", "stimuli": stimuli, "intervals": {"standard": "P120"},
        "procedure": {"kind": "constant", "level": {"column": "grit", "of": "stimuli"}, "repeats": 1},
        "order": {"design": "random"}, "needs": ["window", "samples"],
        "simulation": {"observer": {"threshold": 100, "slope": 0.1}},
    }  # fmt: skip
    return Study.model_validate({**data, **changes})


def test_samples_in_intervals_are_mounted_and_felt_one_after_the_other(tmp_path):
    hall = Hall([(0.0, "confirm")] * 8, station=compose_station(papers(), None, {}))
    record = run_in(tmp_path, hall, compile_plan(papers(), ParticipantRow("P001")))
    assert record.complete
    assert hall.stage.pages[:5] == ["changing_sample", "interval 1", "changing_sample", "interval 2", "ask"]
    prompts = [line for line in hall.paper.lines if line.startswith("> Interval")]
    assert len(prompts) == 8 and prompts[1] == "> Interval 1 of 2: confirm when it was felt (confirm when it is done)"
    assert {prompt.partition(": ")[2].partition(" (")[0] for prompt in (prompts[0], prompts[2])} >= {
        "put in place P120"
    }


def test_a_stand_in_shows_the_number_of_the_interval(tmp_path):
    hall = Hall(station=Station(TwinInRealTime("vibrator", twin_taking(0.6))))
    run_in(tmp_path, hall, compile_plan(papers(), ParticipantRow("P001")))
    assert hall.stage.pages[:3] == ["interval 1", "interval 2", "ask"]


def test_the_window_has_its_last_page_for_every_end(tmp_path):
    hall = Hall([(0.0, "abort")])
    run_in(tmp_path, hall)
    assert last_page(hall.desk) == "aborted"


def test_session_time_goes_on_from_where_the_record_ends():
    counted = iter([1_000, 1_500, 4_000])
    now = clock_from(70, lambda: next(counted))
    assert (now(), now()) == (570, 3_070)


def test_a_side_is_shown_while_it_is_on(tmp_path):
    """The experimenter guides the hand when the participant switches (thesis 4.7.1)."""
    hall = Hall()

    class Sides(Stage):
        def perform(self, request, desk, now_ns):
            hall.desk.tell({"side": "virtual"})
            assert hall.desk.view.states["side"] == "virtual"
            return super().perform(request, desk, now_ns)

    hall.orders = ALL
    hall._stage = lambda plan: Sides(Perceiver(plan), hall.time)
    run_in(tmp_path, hall)
    assert "side" not in hall.desk.view.states


def test_an_interruption_in_the_desk_reaches_the_session(tmp_path):
    hall = Hall([(0.0, "quit")])
    plan = sheets_plan()
    rig = hall.rig.open(plan, 0)
    with pytest.raises(Interrupted, match="QUIT"):
        rig.world.perform(_first_request(plan))


def _first_request(plan):
    return Present(plan.trials[0])


def test_an_aside_comes_back_while_a_sample_is_waited_for():
    hall, plan = Hall([(0.0, "note x")]), sheets_plan()
    world = hall.rig.open(plan, 0).world
    assert isinstance(world, LiveWorld)
    assert world.perform(_first_request(plan)) == Aside({"do": "note", "text": "x"})
    assert hall.desk.view.prompt is not None
