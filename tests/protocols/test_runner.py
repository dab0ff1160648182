import pytest

from palpate.protocols.events import Ask, Present, Reply, ReplyError, Samples, Sense
from palpate.protocols.runner import Divergence, EndOfRecord, Recorded, run
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.simulated_world import Done, Simulated, VirtualClock
from palpate.protocols.study import Study
from palpate.protocols.tasks import TASKS
from tests.protocols.studies_for_tests import toy_plan
from tests.protocols.worlds_for_tests import BACK, MemoryLog, Scripted, rated

LISTED = {"order": {"design": "as_listed"}}


def ran(*replies, **changes):
    log, world = MemoryLog(), Scripted(iter(replies))
    run(toy_plan(**{**LISTED, **changes}), world, log, {"study": "toy"})
    return log, world


def test_the_events_of_a_session_are_in_order():
    log, _ = ran(rated(1, 2), rated(3, 4), rated(5, 6), rated(7, 8))
    trial = "present . ask answer )answered"
    assert " ".join(log.words()) == (
        f"session_started A1( {trial} B1( {trial} rest . C1( {trial} D1( {trial} session_ended"
    )
    assert log.events[0].value == {"study": "toy"}
    assert [e.trial for e in log.events[1:7]] == [1] * 6
    assert log.events[-1].value == {"trials": 4} and log.events[-1].trial is None


def test_instructions_come_first_and_practice_before_what_counts():
    log, _ = ran(*[rated(0, 0)] * 5, instructions="Feel it.", practice={"stimuli": ["D"]})
    assert log.words()[:4] == ["session_started", "instruct", ".", "D1("]
    assert log.events[3].value["block"] == "practice"
    rests = [e.value for e in log.events if e.kind == "request" and e.value["do"] == "rest"]
    assert rests == [{"do": "rest", "done": 2, "total": 4}]


def test_going_back_revises_the_trial_before_and_starts_the_left_one_over():
    log, world = ran(rated(1, 2), BACK, rated(9, 9), rated(3, 4), rated(5, 6), rated(7, 8))
    assert " ".join(log.words()[6:22]) == (
        ")answered B1( present . ask back )left A2( ask+ answer )answered B2( present . ask answer"
    )
    revision = [ask for ask in world.requests if isinstance(ask, Ask)][2]
    assert revision.trial.previous == {"Soft": 1, "Cold": 2} and revision.trial.attempt == 2


def test_going_back_twice_and_out_of_a_revision():
    log, _ = ran(
        rated(1, 1), rated(2, 2), BACK, BACK, rated(9, 9), rated(8, 8), rated(3, 3), rated(4, 4),
    )  # fmt: skip
    kinds = [word for word in log.words() if word.endswith("(") or word.startswith(")")]
    assert kinds == [
        "A1(", ")answered", "B1(", ")answered", "C1(", ")left", "B2(", ")left", "A2(", ")answered",
        "B3(", ")answered", "C2(", ")answered", "D1(", ")answered",
    ]  # fmt: skip
    assert log.words().count("rest") == 1


@pytest.mark.parametrize(
    ("replies", "message"),
    [
        ([BACK], "trial 1: the reply goes back, which this trial does not allow"),
        ([{"answers": {"Soft": 1}}], r"trial 1: answers to \['Soft', 'Cold'\] expected, found"),
        ([{"answers": None}], "found None"),
        ([{}], "found None"),
        ([rated(1, 10.5)], "trial 1: Cold = 10.5 is not on the study's scale"),
        ([rated(1, 0.5)], "Cold = 0.5 is not on"),
        ([rated(True, 1)], "Soft = True is not on"),
        ([rated("1", 1)], "Soft = '1' is not on"),
        ([rated(1, 2), rated(1, 2), rated(1, 2), {"answers": {}}], "trial 4: answers to"),
    ],
)
def test_a_reply_that_is_no_answer_is_refused_and_can_be_asked_for_again(replies, message):
    log, world = MemoryLog(), Scripted(iter(replies))
    with pytest.raises(ReplyError, match=message):
        run(toy_plan(**LISTED), world, log, {})
    assert log.events[-1].kind == "request" and log.events[-1].value["do"] == "ask"
    tape = Recorded(list(log.events), Scripted(iter([rated(0, 0)] * 4), t_ns=log.events[-1].t_ns), log)
    run(toy_plan(**LISTED), tape, tape, {})
    assert log.events[-1].kind == "session_ended"


def test_back_is_refused_where_the_study_only_goes_forward():
    with pytest.raises(ReplyError, match="does not allow"):
        ran(rated(1, 2), BACK, navigation="forward")


def test_a_request_is_on_record_before_it_is_performed():
    log = MemoryLog()

    class Watching(Scripted):
        def perform(self, request):
            assert log.events[-1].kind == "request" and log.events[-1].value == request.body()
            return super().perform(request)

    run(toy_plan(**LISTED), Watching(iter([rated(0, 0)] * 4)), log, {})


@pytest.mark.parametrize("name", TASKS)
def test_the_keys_of_every_task_are_keys_of_a_study_file(name):
    task = TASKS[name]
    assert {*task.required} <= {*task.keys} <= {*Study.model_fields} and task.description.endswith(".")


def recorded(*replies):
    return ran(*replies)[0].events


FOUR = (rated(1, 2), BACK, rated(9, 9), rated(3, 4), rated(5, 6), rated(7, 8))


def test_a_record_replays_event_for_event():
    tape = Recorded(recorded(*FOUR))
    run(toy_plan(**LISTED), tape, tape, {"study": "toy"})
    assert tape.position == len(tape.events)


@pytest.mark.parametrize("cut", range(1, 38))
def test_a_record_cut_anywhere_goes_on_to_the_same_session(cut):
    whole = simulated_session()
    assert len(whole) == 38
    log = MemoryLog(list(whole[:cut]))
    plan = toy_plan(**SECOND_THOUGHTS)
    tape = Recorded(whole[:cut], simulated(plan, whole[cut - 1].t_ns), log)
    run(plan, tape, tape, {})
    assert log.events == whole


SECOND_THOUGHTS = {"simulation": {"latents": {}, "revise_rate": 0.3, "lapse_rate": 0.2}}


def simulated(plan, t_ns=0):
    def device(request, t_ns):
        block = Samples("door", ("angle", "force"), ("deg", "N"), 100.0, t_ns, b"\0" * 16)
        return Done(Reply({"presented": request.trial.stimulus.id}, (block,)), 1.5)

    return Simulated(Perceiver(plan), device, VirtualClock(t_ns))


def simulated_session():
    log, plan = MemoryLog(), toy_plan(**SECOND_THOUGHTS)
    run(plan, simulated(plan), log, {})
    return log.events


def test_a_simulated_session_takes_virtual_time_and_carries_samples():
    events = simulated_session()
    assert "back" in MemoryLog(events).words()
    block = next(e for e in events if e.samples).samples[0]
    assert block.count == 2
    assert events[-1].t_ns > 60e9


def test_the_record_ends_where_it_ends():
    tape = Recorded(recorded(*FOUR)[:10])
    with pytest.raises(EndOfRecord):
        run(toy_plan(**LISTED), tape, tape, {"study": "toy"})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"attributes": [["Soft", "Hard"], ["Chilly", "Warm"]]}, r"event 4 \(request, trial 1\): \$\.items\[1\]: "
         'recorded "Cold", now "Chilly"'),
        ({"instructions": "Feel."}, r"event 1 \(trial_started, trial 1\): the code now gives a request"),
        ({"rest": {"every": 1}}, r"event 7 \(trial_started, trial 2\): the code now gives a request of trial None"),
    ],
)  # fmt: skip
def test_a_changed_session_diverges_at_a_named_event(changes, message):
    tape = Recorded(recorded(*FOUR))
    with pytest.raises(Divergence, match=message):
        run(toy_plan(**{**LISTED, **changes}), tape, tape, {"study": "toy"})


def test_a_record_without_a_reply_diverges():
    events = recorded(*FOUR)
    tape = Recorded(events[:3] + events[4:])
    with pytest.raises(Divergence, match=r"event 4 \(request, trial 1\): a reply to 'present' is expected there"):
        run(toy_plan(**LISTED), tape, tape, {"study": "toy"})


def test_a_difference_in_time_alone_is_seen():
    from dataclasses import replace

    from palpate.protocols.runner import demand_equal

    event = recorded(*FOUR)[3]
    with pytest.raises(Divergence, match="event 3"):
        demand_equal(event, replace(event, t_ns=event.t_ns + 1))


def test_sensing_and_instructions_pass_through_a_simulated_world():
    plan = toy_plan()
    world = simulated(plan)
    reply = world.perform(Sense("door", 2.0, plan.trials[0]))
    assert reply.samples and world.now() == 1_500_000_000
    assert Sense("door", 2.0, plan.trials[0]).body() == {"do": "sense", "device": "door", "seconds": 2.0}
    assert Present(plan.trials[0]).body()["stimulus"] == plan.trials[0].stimulus.id


def test_a_person_who_always_has_second_thoughts_comes_to_an_end():
    log, plan = MemoryLog(), toy_plan(simulation={"latents": {}, "revise_rate": 1.0})
    run(plan, simulated(plan), log, {})
    assert log.events[-1].kind == "session_ended"
    assert log.words().count(")left") == 3


def test_what_is_recorded_after_the_end_is_noticed():
    from dataclasses import replace

    events = recorded(*FOUR)
    tape = Recorded([*events, replace(events[-1], seq=len(events), kind="reply")])
    run(toy_plan(**LISTED), tape, tape, {"study": "toy"})
    with pytest.raises(Divergence, match=rf"event {len(events)} \(reply\): recorded, but the session is over"):
        tape.demand_end()
