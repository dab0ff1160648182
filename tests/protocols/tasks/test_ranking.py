"""Putting a set in order: every stimulus is felt and placed, then felt again as wished; the last order stands."""

import re

import pytest

from palpate.protocols.events import Ask, Fault, Present, Reply, ReplyError
from palpate.protocols.plan import compile_plan
from palpate.protocols.reading import inconsistencies
from palpate.protocols.runner import Recorded, run
from palpate.protocols.study import Study
from palpate.protocols.tasks import TASKS, TaskError
from palpate.protocols.trial import ParticipantRow
from palpate.studies.sessions.tables import answers_of
from tests.protocols.every_task import LAB, plan_of, study_of
from tests.protocols.test_every_task import ran, simulated
from tests.protocols.worlds_for_tests import MemoryLog

BY_KIND = {"design": "as_listed", "within": "block", "blocks": {"by": "kind", "design": "as_listed"}}
LISTED = {"design": "as_listed"}
PLAIN = {"opening": [], "closing": [], "questionnaire": None, "rest": None, "order": LISTED}
EXACT = {"latents": {"Soft": {"size": -4.0}}, "noise_sd": 0.0, "gain_sd": 0.0}


def ranks(**placed):
    return {name: placed.get(name, 0) for name in "ABCD"}


class Hand:
    """A participant who answers with these values in turn; a Fault comes instead of what is felt at that place."""

    def __init__(self, answers, faults=()):
        self.answers, self.faults, self.felt, self.t_ns = iter(answers), dict(faults), [], 0

    def now(self):
        self.t_ns += 1
        return self.t_ns

    def perform(self, request):
        if isinstance(request, Present):
            self.felt.append(request.trial.stimulus.id)
            return self.faults.get(len(self.felt)) or Reply({})
        return Reply(next(self.answers) if isinstance(request, Ask) else {})


def session(answers, faults=(), **changes):
    """A session of the toy study as listed: the events, and what was felt."""
    plan, hand, log = plan_of("ranking", **{**PLAIN, **changes}), Hand(answers, faults), MemoryLog()
    run(plan, hand, log, {"study": "toy"})
    return plan, log.events, hand.felt


def go(feel, **placed):
    return {"go": "try", "feel": feel, "answers": ranks(**placed)}


ONE_BY_ONE = [go("B", A=1), go("C", A=2, B=1), go("D", A=3, B=1, C=2)]
DONE = {"answers": ranks(A=3, B=1, C=2, D=4)}


def test_a_trial_is_a_set_and_stimuli_are_felt_in_the_order_of_the_plan():
    plan = plan_of("ranking", order=BY_KIND, practice={"stimuli": ["C", "B"]})
    sets = [(trial.block, trial.practice, [s.id for s in trial.stimuli], trial.stimulus.id) for trial in plan.trials]
    assert sets == [("practice", True, ["C", "B"], "C"), ("x", False, ["A", "C"], "A"), ("y", False, ["B", "D"], "B")]
    assert [trial.stimulus.id for trial in plan.presented] == list("CBACBD")


def test_each_stimulus_is_placed_before_the_next_and_any_can_be_felt_again():
    plan, events, felt = session([*ONE_BY_ONE, go("B", A=3, B=1, C=2, D=4), {"answers": ranks(A=4, B=1, C=2, D=3)}])
    assert felt == list("ABCDB")
    [row, *_] = rows = answers_of(plan, "toy/P001/1", events).own["rankings"]
    assert [(row["stimulus"], row["rank"]) for row in rows] == [("A", 4), ("B", 1), ("C", 2), ("D", 3)]
    assert row == {
        "session": "toy/P001/1", "seq": events[-3].seq, "participant": "P001", "session_number": 1,
        "trial": 1, "attempt": 1, "block": "main", "practice": False, "attribute": "Soft", "rank": 4, "stimulus": "A",
        "set_size": 4, "position": 1, "counts": True,
    }  # fmt: skip


def test_a_device_that_fails_meets_what_has_no_place_again_and_keeps_the_others():
    failed = Fault({"device": "door", "what": "stuck", "message": "door: stuck"})
    _, events, felt = session([*ONE_BY_ONE, DONE], {3: failed})
    assert felt == ["A", "B", "C", "C", "D"]
    assert [event.value["as"] for event in events if event.kind == "trial_ended"] == ["faulted", "answered"]


def test_whoever_goes_back_finds_the_order_and_feels_nothing_that_has_a_place():
    order, back = {**BY_KIND, "repeats": 1}, {"go": "back"}

    def placed(one, other, **more):
        return {"answers": {one: 1, other: 2}, **more}

    first = [placed("A", "C") | {"answers": {"A": 1, "C": 0}, "go": "try", "feel": "C"}, placed("A", "C")]
    second = [{"answers": {"B": 1, "D": 0}, "go": "try", "feel": "D"}, placed("B", "D")]
    plan, events, felt = session(
        [*first, back, placed("C", "A"), *second], order=order, navigation="back_and_forward"
    )  # fmt: skip
    assert felt == ["A", "C", "B", "B", "D"]
    rows = answers_of(plan, "toy/P001/1", events).own["rankings"]
    of_first = [(row["attempt"], row["stimulus"], row["rank"], row["counts"]) for row in rows if row["trial"] == 1]
    assert of_first == [(1, "A", 1, False), (1, "C", 2, False), (2, "A", 2, True), (2, "C", 1, True)]


@pytest.mark.parametrize(
    ("value", "says"),
    [
        (DONE | {"answers": ranks(A=1, B=1, C=2, D=3)}, "each once"),
        (DONE | {"answers": ranks(A=1, B=3)}, "ranks from 1 to 2"),
        (DONE | {"answers": {"A": 1}}, "ranks of"),
        (DONE | {"answers": ranks(A=1.0)}, "whole numbers"),
        (DONE | {"answers": ranks(A=True)}, "whole numbers"),
        (DONE | {"answers": ranks(A=1)}, "goes on, and these have no rank yet: B, C, D"),
        ({"answers": None}, "ranks of"),
    ],
)
def test_what_is_no_order_is_refused(value, says):
    with pytest.raises(ReplyError, match=says):
        session([value])


def test_only_what_is_of_the_set_can_be_felt():
    with pytest.raises(TaskError, match="'Z' is to be felt, which is not of its set"):
        session([go("Z", A=1)])


def test_a_simulated_participant_without_noise_orders_by_what_is_felt_and_lapses_anywhere():
    def orders(simulation):
        plans = [plan_of("ranking", who, simulation=simulation, order=LISTED) for who in ("P001", "P002", "P003")]
        answers = [[e.value.get("answers") or {} for e in ran(plan) if e.kind == "reply" and e.trial] for plan in plans]
        return [one[-1] for one in answers]

    assert orders(EXACT) == [ranks(A=4, B=3, C=2, D=1)] * 3
    assert len({str(order) for order in orders({**EXACT, "lapse_rate": 1.0})}) > 1


def test_now_and_then_a_simulated_participant_feels_one_again_where_the_study_lets_it():
    def presented(again):
        plans = [plan_of("ranking", f"P{n:03d}", settings={"again": again}, order=LISTED) for n in range(1, 13)]
        return [sum(e.value.get("do") == "present" for e in ran(plan) if e.kind == "request") for plan in plans]

    assert set(presented(False)) == {4} and set(presented(True)) == {4, 5}


@pytest.mark.parametrize("seed", [1, 2])
def test_killed_at_any_event_the_session_goes_on_to_the_same_end(seed):
    plan = plan_of("ranking", seed=seed, practice={"stimuli": ["D", "A"]}, navigation="back_and_forward")
    whole = ran(plan)
    for cut in range(1, len(whole)):
        log = MemoryLog(list(whole[:cut]))
        tape = Recorded(whole[:cut], simulated(plan, whole[cut - 1].t_ns), log)
        run(plan, tape, tape, {"study": "toy"})
        assert log.events == whole, cut


@pytest.mark.parametrize(
    ("changes", "path", "says"),
    [
        ({"attributes": [["Soft", "Hard"], ["Cold", "Warm"]]}, ("attributes",), "one pair"),
        ({"attributes": []}, ("attributes",), "required for task ranking"),
        ({"scale": {"from": 0, "to": 9}}, ("scale",), "this one is ranking"),
        ({"practice": {"stimuli": ["A"]}}, ("practice", "stimuli"), "2 to 12 stimuli .* found 1"),
        ({"practice": {"stimuli": ["A", "B", "A"]}}, ("practice", "stimuli"), "different stimuli"),
        ({"groups": {"1": {"size": ["2"]}}}, ("stimuli",), "group 1: .* found 1"),
        ({"stimuli": [f"S{n}" for n in range(13)], "order": LISTED}, ("stimuli",), r"found 13 \(main\)"),
    ],
)
def test_what_cannot_be_put_in_order_is_a_complaint(changes, path, says):
    data = {**study_of("ranking").definition(), **changes}
    data["stimuli"] = [{"id": stimulus} if isinstance(stimulus, str) else stimulus for stimulus in data["stimuli"]]
    problems = [(p.path, p.message) for p in inconsistencies(Study.model_validate({**data, "simulation": None}))]
    assert [place for place, _ in problems] == [path]
    assert re.search(says, problems[0][1])


def test_columns_that_are_missing_are_named_where_they_are_used():
    for changes in ({"order": {**BY_KIND, "blocks": {"by": "sort"}}}, {"groups": {"1": {"sort": ["x"]}}}):
        messages = [problem.message for problem in inconsistencies(study_of("ranking", **changes))]
        assert messages == ["found 'sort', expected a column of the stimulus table; known: kind, size"], messages


def test_settings_are_part_of_the_plan_digest_and_may_be_left_out():
    plans = [plan_of("ranking", settings=settings) for settings in ({}, {"again": True}, {"again": False})]
    assert [plan.trials[0].form.again for plan in plans] == [True, True, False]
    assert len({plan.digest for plan in plans}) == 3
    again = [Study.model_validate(plan.study.definition()) for plan in plans]
    assert [compile_plan(study, ParticipantRow("P001"), 0, LAB).digest for study in again] == [p.digest for p in plans]
    without = {key: value for key, value in study_of("ranking").definition().items() if key != "settings"}
    assert compile_plan(Study.model_validate(without), ParticipantRow("P001"), 0, LAB).trials[0].form.again


def test_the_task_says_what_it_asks():
    assert TASKS["ranking"].summary(study_of("ranking")) == "an order from Soft to Hard"
