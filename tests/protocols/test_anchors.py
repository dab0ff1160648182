"""References that are felt before a block: declared, ordered, on record apart from the trials, simulated, refused."""

from statistics import pstdev

import pytest

from palpate.protocols.events import Ask, Fault, Present, Reply, ReplyError
from palpate.protocols.forms import AnchorForm
from palpate.protocols.plan import compile_plan
from palpate.protocols.reading import inconsistencies
from palpate.protocols.runner import Recorded, run
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.simulated_world import Simulated, VirtualClock
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.sessions.tables import answers_of
from tests.protocols.every_task import LAB, plan_of, study_of
from tests.protocols.test_every_task import device, ran, simulated
from tests.protocols.worlds_for_tests import MemoryLog

SOFT = {"id": "A", "label": "This is 0 of Soft.", "attribute": "Soft", "value": 0}
HARD = {"id": "D", "label": "This is 100 of Soft.", "attribute": "Soft", "value": 100}
BLOCKS = {"design": "as_listed", "within": "block", "blocks": {"by": "kind", "design": "as_listed"}}


def anchored(task="matching", stimuli=(SOFT, HARD), **changes):
    anchors = {"stimuli": list(stimuli), **changes.pop("anchors", {})}
    return plan_of(task, anchors=anchors, **changes)


def felt(events):
    """(block, stimulus) of every reference that was felt, and None for each trial, in their order."""
    order = []
    for event in events:
        if event.kind == "trial_started":
            order.append(None)
        if event.kind == "request" and event.value.get("form") == "anchor" and event.value["previous"] == {"felt": 0}:
            assert event.trial is None
            order.append((event.value["anchor"]["block"], event.value["anchor"]["id"]))
    return order


@pytest.mark.parametrize(("before", "again"), [("block", [("y", "A"), ("y", "D")]), ("session", [])])
def test_references_are_felt_before_each_block_or_once(before, again):
    plan = anchored(order=BLOCKS, practice={"stimuli": ["B"]}, anchors={"before": before}, simulation=None)
    blocks = [trial.block for trial in plan.trials]
    assert blocks == ["practice", "x", "x", "y", "y"]
    second = [("x", "A"), ("x", "D")] if before == "block" else []
    assert felt(ran(plan)) == [("practice", "A"), ("practice", "D"), None, *second, None, None, *again, None, None]


def test_a_standard_is_felt_before_each_trial_and_stands_for_an_answer():
    standard = {"id": "A", "label": "Call this one 10.", "attribute": "strength", "value": 10}
    plan = anchored("questions", [standard], anchors={"before": "trial", "rated": False}, simulation=None)
    assert list(inconsistencies(plan.study)) == [] and len(plan.trials) == 3
    assert felt(ran(plan)) == [("main", "A"), None] * 3


@pytest.mark.parametrize("task", ["matching", "similarity", "adjective_selection", "authoring"])
@pytest.mark.parametrize("cut", [9, 11, 13, 15, 19])
def test_a_session_with_references_replays_and_goes_on_from_any_cut(task, cut):
    wish = {"wish": {"Soft": 0}} if task == "authoring" else {}
    stands = {} if task in ("adjective_selection", "authoring") else {"attribute": "Soft", "value": 0}
    plan = anchored(task, [{"id": "A", "label": "Soft as can be.", **stands, **wish}])
    whole = ran(plan)
    log = MemoryLog(list(whole[:cut]))
    tape = Recorded(whole[:cut], simulated(plan, whole[cut - 1].t_ns), log)
    run(plan, tape, tape, {"study": "toy"})
    assert log.events == whole


def test_what_was_felt_of_references_stands_in_a_table_of_its_own():
    plan = anchored(simulation=None)
    events = ran(plan)
    answers = answers_of(plan, "toy/P001/1", events)
    rows = answers.anchors
    assert [(row["block"], row["number"], row["stimulus"], row["value"]) for row in rows] == [
        ("main", 1, "A", 0.0),
        ("main", 2, "D", 100.0),
    ]
    presented = [
        event.value["anchor"] for event in events if "anchor" in event.value and event.value["do"] == "present"
    ]
    assert [presented.count(number) for number in (1, 2)] == [row["felt"] for row in rows]
    assert {row["trial"] for row in answers.responses} == {trial.number for trial in plan.trials}
    assert "felt" not in {row["item"] for row in answers.answers}


def test_a_reference_is_felt_anew_after_a_fault_and_goes_on_only_once_felt():
    plan, log, faults = (
        anchored(simulation=None),
        MemoryLog(),
        [Fault({"device": "door", "what": "lost", "message": "gone"})],
    )

    class Fails(Simulated):
        def perform(self, request):
            if isinstance(request, Present) and faults:
                return faults.pop()
            return super().perform(request)

    run(plan, Fails(Perceiver(plan), device, VirtualClock()), log, {})
    assert felt(log.events)[:3] == [("main", "A"), ("main", "A"), ("main", "D")]
    tape = Recorded(log.events)
    run(plan, tape, tape, {})
    anchor = plan.anchors[0][0]
    ask = Ask(anchor.form, anchor, {"felt": 0})
    ask.demand_answer(Reply({"go": "try", "answers": {"felt": 0}}))
    for answers, message in (
        ({"felt": 0}, "not felt yet"),
        ({"felt": "once"}, "a whole number"),
        ({}, "a whole number"),
    ):
        with pytest.raises(ReplyError, match=f"anchor: .*{message}"):
            ask.demand_answer(Reply({"answers": answers}))


def test_references_that_are_not_rated_are_no_trials():
    rated, apart = anchored(), anchored(anchors={"rated": False})
    assert [trial.stimulus.id for trial in apart.trials] == [
        t.stimulus.id for t in rated.trials if t.stimulus.id in "BC"
    ]
    assert {trial.stimulus.id for trial in apart.presented} == set("ABCD") and rated.digest != apart.digest


def test_a_wish_leaves_other_attributes_in_the_middle():
    plan = anchored("authoring", [{"id": "A", "label": "Soft.", "wish": {"Soft": 100}}])
    form = plan.anchors[0][0].form
    assert isinstance(form, AnchorForm) and form.wish == {"Soft": 100.0, "Cold": 50.0}
    [wish, *_] = [e.value["wish"] for e in ran(plan) if e.value.get("anchor") == 1 and "wish" in e.value]
    assert wish == form.wish


def test_references_take_away_what_they_anchor_of_a_person_s_own_bias():
    def biases(attribute, **simulation):
        study = study_of("matching", anchors={"stimuli": [SOFT]}, simulation={"latents": {}, **simulation})
        people = [compile_plan(study, ParticipantRow(f"P{n}"), 0, LAB) for n in range(30)]
        return [Perceiver(plan).bias(study.attributes[attribute]) for plan in people]

    assert pstdev(biases(0, anchored=0.75)) == pytest.approx(0.25 * pstdev(biases(0)))
    assert biases(1, anchored=0.75) == biases(1)


@pytest.mark.parametrize(
    ("task", "anchor", "more", "message"),
    [
        ("matching", {"id": "E"}, {}, "expected a stimulus id"),
        ("matching", {"attribute": "Sof", "value": 1}, {}, "did you mean 'Soft'?"),
        ("matching", {"attribute": "Soft", "value": 101}, {}, "101 is not on the study's scale"),
        ("matching", {"wish": {"Soft": 1}}, {}, "task authoring, and to no others"),
        ("authoring", {}, {}, "belongs to the anchors of task authoring"),
        ("authoring", {"wish": {"Soft": -1}}, {}, "-1 is not on the study's scale"),
        ("authoring", {"wish": {"Soft": 1}}, {"rated": False}, "leave rated out"),
        ("adjective_selection", {"attribute": "Soft", "value": 1}, {}, "expected an attribute"),
        ("capture", {}, {}, "nothing to anchor"),
    ],
)
def test_references_that_do_not_fit_are_named(task, anchor, more, message):
    study = study_of(task, anchors={"stimuli": [{"id": "A", "label": "So.", **anchor}], **more})
    assert any(message in problem.message for problem in inconsistencies(study))


def test_something_is_left_for_trials_and_half_a_value_is_refused():
    every = [{"id": name, "label": "So."} for name in "ABCD"]
    study = study_of("matching", anchors={"stimuli": every, "rated": False})
    assert any("nothing is left for trials" in problem.message for problem in inconsistencies(study))
    with pytest.raises(ValueError, match="attribute: NAME and value: NUMBER go together"):
        Study.model_validate({**study.definition(), "anchors": {"stimuli": [{**every[0], "value": 3}]}})
