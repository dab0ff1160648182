"""Every task runs from consent to the last form, replays, and refuses what is no answer to it."""

import pytest

from palpate.protocols.events import Ask, Reply, ReplyError, Samples
from palpate.protocols.forms import Demographics, LabForms, Question
from palpate.protocols.needs import NEEDS
from palpate.protocols.plan import PlanError, compile_plan
from palpate.protocols.reading import inconsistencies
from palpate.protocols.runner import Recorded, run
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.simulated_world import Done, Simulated, VirtualClock
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.procedures.advised import advised
from tests.protocols.every_task import ITEMS, LAB, PARTS, WORDS, plan_of, study_of
from tests.protocols.worlds_for_tests import MemoryLog

TASKS = sorted(PARTS)


def device(request, t_ns):
    return Done(Reply({"presented": True}, (Samples("tool", ("a",), ("m/s^2",), 1.0, t_ns, b"\0" * 4),)), 1.0)


def simulated(plan, t_ns=0):
    return advised(plan, Simulated(Perceiver(plan), device, VirtualClock(t_ns)))


def ran(plan):
    log = MemoryLog()
    run(plan, simulated(plan), log, {"study": "toy"})
    return log.events


def replies(events, form):
    forms = [e.value.get("form") if e.kind == "request" else None for e in events]
    return [events[n + 1].value for n, name in enumerate(forms) if name == form]


@pytest.mark.parametrize("task", TASKS)
def test_a_task_runs_from_consent_to_the_last_form_and_replays(task):
    events = ran(plan_of(task))
    forms = [e.value["form"] for e in events if e.kind == "request" and e.value["do"] == "ask"]
    assert forms[:2] == ["consent", "demographics"] and forms[-2:] == ["likert", "suggestions"]
    assert events[-1].value == {"trials": 4}
    tape = Recorded(events)
    run(plan_of(task), tape, tape, {"study": "toy"})
    tape.demand_end()


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("cut", [3, 9, 14, 22])
def test_a_task_cut_anywhere_goes_on_to_the_same_session(task, cut):
    whole = ran(plan_of(task))
    log = MemoryLog(list(whole[:cut]))
    tape = Recorded(whole[:cut], simulated(plan_of(task), whole[cut - 1].t_ns), log)
    run(plan_of(task), tape, tape, {"study": "toy"})
    assert log.events == whole


DEVICES = {"authoring": ["door_generator"], "capture": ["tool"]}


@pytest.mark.parametrize("task", TASKS)
def test_the_study_of_a_task_is_consistent_and_complete(task):
    assert list(inconsistencies(study_of(task, needs=DEVICES.get(task, [])))) == []


WITHOUT = {
    "slider_rating": ("attributes", "scale"),
    "adjective_selection": ("adjectives",),
    "capture": ("capture",),
    "similarity": ("sides", "scale"),
    "questions": ("ask",),
}


@pytest.mark.parametrize(("task", "part"), [(task, part) for task, parts in WITHOUT.items() for part in parts])
def test_a_part_that_the_task_needs_is_asked_for_by_name(task, part):
    data = {key: value for key, value in study_of(task).definition().items() if key != part}
    assert (part,) in [problem.path for problem in inconsistencies(Study.model_validate(data))]


@pytest.mark.parametrize(
    ("task", "changes", "message"),
    [
        ("free_lexicon", {"sides": ["a", "b"]}, "belongs to task similarity, and this one is free_lexicon"),
        ("similarity", {"sides": ["real", "real"]}, "two different sides"),
        ("capture", {"needs": ["door_sensors", "window"]}, "needs the device tool, which is not listed"),
        ("authoring", {"needs": ["door", "window"]}, "needs the device door_generator, which is not listed"),
        ("capture", {"navigation": "back_and_forward"}, "task capture goes forward only"),
        ("capture", {"capture": {"device": "tool", "seconds": "size"}}, "stimulus 'A' has '0' in 'size'"),
        ("capture", {"capture": {"device": "tool", "seconds": "kind"}}, "seconds from 0.1 to 3600"),
        ("adjective_selection", {"adjectives": {"words": ["Glassy", "glassy "]}}, "'glassy ' appears twice"),
        ("questions", {"ask": [{"name": "which", "kind": "choice", "of": "intervals"}]}, "this task has no intervals"),
        ("matching", {"closing": []}, "closing: [questionnaire] and questionnaire"),
        ("matching", {"questionnaire": {"items": ITEMS[:1] * 2}}, "the item 'Realism' appears twice"),
        ("matching", {"opening": ["consent", "consent"]}, "a form appears twice"),
        ("matching", {"simulation": {"latents": {"Sof": {"size": 1}}}}, "did you mean 'Soft'?"),
    ],
)
def test_parts_that_do_not_fit_are_named(task, changes, message):
    problems = [problem.message for problem in inconsistencies(study_of(task, **changes))]
    assert any(message in problem for problem in problems), problems


FELT = {"door", "texture_renderer", "vibration"}
USED = dict.fromkeys(TASKS, FELT) | {
    "authoring": {"door_generator"}, "capture": FELT | {"tool"}, "intervals": {"vibration"},
}  # fmt: skip
"""Beside what any study may need, what a study of the task can present or record with."""


RECORDING = [name for name, need in NEEDS.items() if need.role == "records"]


@pytest.mark.parametrize("task", TASKS)
def test_a_need_that_nothing_presents_or_records_is_refused(task):
    always = {name for name, need in NEEDS.items() if need.role in (None, "beside")}
    for need in NEEDS:
        needs = list(dict.fromkeys([*DEVICES.get(task, []), need]))
        problems = [problem.message for problem in inconsistencies(study_of(task, needs=needs))]
        assert (not problems) == (need in always | USED[task]), (need, problems)
        assert all(f"{need}; leave it out" in problem for problem in problems if need not in {*FELT, *RECORDING})


@pytest.mark.parametrize("need", RECORDING)
@pytest.mark.parametrize("task", [task for task in TASKS if task != "capture"])
def test_a_need_that_nothing_records_is_refused_at_its_place_and_says_what_records(task, need):
    needs = [*DEVICES.get(task, []), "window", need]
    [problem] = inconsistencies(study_of(task, needs=needs))
    assert problem.path == ("needs", len(needs) - 1)
    assert (
        f"nothing in task {task} records with {need}: task capture does, by capture: {{device: {need}"
        in problem.message
    )
    assert "a key record:, for recording during other tasks, does not exist yet" in problem.message


@pytest.mark.parametrize("device", RECORDING)
def test_a_capture_records_with_its_own_device_alone(device):
    study = study_of("capture", capture={"device": device, "seconds": 2.0}, needs=["window", *RECORDING])
    problems = {problem.path: problem.message for problem in inconsistencies(study)}
    others = [need for need in RECORDING if need != device]
    assert problems == {
        ("needs", 1 + RECORDING.index(need)):
            f"task capture records with {device} alone, and nothing with {need}; leave it out"
        for need in others
    }  # fmt: skip


@pytest.mark.parametrize(
    ("needs", "message"),
    [
        (["door", "texture_renderer"], "texture_renderer would present nothing: door presents the stimuli"),
        (["window", "samples", "window"], "window appears twice"),
    ],
)
def test_a_need_beside_which_another_is_idle_is_refused(needs, message):
    problems = list(inconsistencies(study_of("slider_rating", needs=needs)))
    assert [problem.path[0] for problem in problems] == ["needs"] and message in problems[0].message


def test_words_are_shuffled_once_for_each_participant():
    orders = {who: {trial.form.words for trial in plan_of("adjective_selection", who).trials} for who in ("P1", "P2")}
    assert all(len(order) == 1 for order in orders.values()) and orders["P1"] != orders["P2"]
    assert sorted(next(iter(orders["P1"]))) == sorted(WORDS)
    [listed] = {trial.form.words for trial in plan_of("adjective_selection", adjectives={"words": WORDS}).trials}
    assert listed == tuple(WORDS)


def test_switches_lie_before_the_answer_and_alternate():
    for value in replies(ran(plan_of("similarity", simulation={"latents": {}})), "similarity"):
        sides = [switch["to"] for switch in value["switches"]]
        assert sides == [("real", "virtual")[n % 2] for n in range(len(sides))] and len(sides) >= 2
        assert value["switches"][-1]["at_s"] < min(value["at_s"].values()) <= value["seconds"]


def test_an_author_tries_what_was_wished_before_it_stands():
    events = ran(plan_of("authoring"))
    requests = [e.value for e in events if e.kind == "request" and e.value.get("form") == "authoring"]
    given = replies(events, "authoring")
    felt = [e.value["wish"] for e in events if e.kind == "request" and "wish" in e.value]
    assert felt == [value["answers"] for value in given if value.get("go") == "try"] and len(felt) >= 8
    finals = [value["answers"] for value in given if "go" not in value]
    assert len(finals) == 4 and all(final in felt for final in finals)
    assert [a["previous"] is None for a in requests].count(True) == 4


@pytest.mark.parametrize("seed", range(5))
def test_an_author_settles_on_a_scale_of_two_steps_too(seed):
    """Where most wishes are equal, it must not be the same try for ever."""
    scale = {"from": 0, "to": 10, "step": 10}
    events = ran(plan_of("authoring", seed=seed, attributes=[["Soft", "Hard"]], scale=scale))
    assert events[-1].value == {"trials": 4} and len(replies(events, "authoring")) <= 4 * 8


def test_who_has_few_words_still_writes_enough():
    plan = plan_of("free_lexicon", lexicon={"at_least": 20}, simulation={"latents": {}, "vocabulary": ["stiff"]})
    for value in replies(ran(plan), "lexicon"):
        words = value["answers"]["words"]
        assert words[:2] == ["stiff", "stiff 2"] and len(set(words)) == len(words) >= 20


@pytest.mark.parametrize(
    ("low", "high"), [(None, None), (65, 99), (65, None), (-10, -1), (0.2, 0.4), (None, 10), (0, 120), (None, -3)]
)
def test_a_simulated_number_is_one_that_the_question_allows(low, high):
    question = Question("number", "How many?", "number", low=low, high=high, optional=False)
    plan = plan_of("matching")
    lab = LabForms("Do you agree?", (question,))
    for seed in range(5):
        person = Perceiver(compile_plan(plan.study, plan.who, seed, lab))
        answers = person.answer(Ask(Demographics((question,))))[0].value["answers"]
        assert question.problem(answers["number"]) is None


def test_simulated_people_are_adults_who_have_not_driven_since_before_they_were():
    age = Question("age", "How old are you?", "number", low=0, high=120)
    driving = Question("driving_experience", "How many years?", "number", low=0, high=100)
    form = Demographics((age, driving))
    people = [Perceiver(plan_of("matching", f"P{n}")).answer(Ask(form))[0].value["answers"] for n in range(100)]
    ages = [person["age"] for person in people]
    assert 19 <= min(ages) < 25 and 58 < max(ages) <= 64
    assert all(0 <= person["driving_experience"] <= person["age"] - 18 for person in people)
    assert len({person["driving_experience"] for person in people}) > 20


def test_latents_of_words_make_them_likely():
    people = [f"P{n}" for n in range(60)]
    latents = {"rough": {"size": 2.0}, "smooth": {"intercept": -6}}
    plans = [plan_of("adjective_selection", who, simulation={"latents": latents}) for who in people]
    ticked = {"A": 0, "D": 0}
    for plan in plans:
        for trial, value in zip(plan.trials, replies(ran(plan), "adjectives"), strict=True):
            assert "smooth" not in value["answers"]["ticked"]
            ticked[trial.stimulus.id] = ticked.get(trial.stimulus.id, 0) + ("rough" in value["answers"]["ticked"])
    assert ticked["A"] < 15 and ticked["D"] > 45


def test_the_lab_s_forms_are_part_of_the_plan_and_read_back():
    plan = plan_of("matching")
    assert LabForms.from_definition(LAB.definition()) == LAB
    other = LabForms("Another text", LAB.questions)
    assert compile_plan(plan.study, plan.who, 0, other).digest != plan.digest
    bare = compile_plan(plan.study, ParticipantRow("P001"))
    with pytest.raises(PlanError, match="opens with consent, demographics: the lab's forms are missing"):
        ran(bare)


def test_a_lab_without_questions_asks_none():
    plan = compile_plan(study_of("matching"), ParticipantRow("P001"), 0, LabForms("Do you agree?", ()))
    assert [form.name for form in plan.opening] == ["consent"]


def test_who_declines_takes_no_part():
    plan = plan_of("matching")
    log = MemoryLog()

    class Declines(Simulated):
        def perform(self, request):
            if isinstance(request, Ask) and request.form.name == "consent":
                return Reply({"answers": {"agreed": False}})
            return super().perform(request)

    run(plan, Declines(Perceiver(plan), device, VirtualClock()), log, {})
    assert [e.kind for e in log.events] == ["session_started", "request", "reply", "session_ended"]
    assert log.events[-1].value == {"trials": 4, "as": "declined"}


FIT = [{"name": "impairment", "text": "Is anything wrong?", "answer": "no"}]


def test_who_is_not_eligible_takes_no_part_and_only_that_is_on_record():
    plan = plan_of("matching", opening=["consent", "eligibility", "demographics"], eligible=FIT)
    log = MemoryLog()

    class Unfit(Simulated):
        def perform(self, request):
            if isinstance(request, Ask) and request.form.name == "eligibility":
                return Reply({"answers": {"eligible": False}})
            return super().perform(request)

    run(plan, Unfit(Perceiver(plan), device, VirtualClock()), log, {})
    assert log.events[-1].value == {"trials": 4, "as": "ineligible"}
    assert [event.value.get("form") for event in log.events if event.kind == "request"] == ["consent", "eligibility"]
    tape = Recorded(log.events)
    run(plan, tape, tape, {})
    tape.demand_end()
    assert "demographics" in [event.value.get("form") for event in ran(plan)], "simulated people are eligible"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"eligible": FIT}, "opening: [eligibility] and eligible"),
        ({"opening": ["eligibility"]}, "opening: [eligibility] and eligible"),
        ({"opening": ["eligibility"], "eligible": FIT * 2}, "the question 'impairment' appears twice"),
    ],
)
def test_the_eligibility_form_and_its_questions_go_together(changes, message):
    assert any(message in problem.message for problem in inconsistencies(study_of("matching", **changes)))


def test_the_steps_of_setting_up_are_confirmed_first_and_on_record():
    plan = plan_of("capture", setup=["Plates of 5 mm.", "The box is closed."])
    events = ran(plan)
    steps = [event.value for event in events if event.value.get("do") == "confirm"]
    assert [step["text"] for step in steps] == ["Plates of 5 mm.", "The box is closed."]
    assert [event.kind for event in events[:5]] == ["session_started", "request", "reply", "request", "reply"]
    assert events[2].value == {"confirmed": True}


def test_an_interview_is_answered_freely_or_left_empty():
    questions = [{"name": "felt", "text": "What did you feel?"}]
    plan = plan_of("matching", closing=["questionnaire", "interview"], interview=questions)
    form = plan.closing[-1]
    assert form.problem({"felt": "A buzz,\nthen nothing."}) is None and form.problem({"felt": ""}) is None
    assert form.problem({"felt": None}) and form.problem({})
    assert ran(plan)[-2].value["answers"] == {"felt": ""}
    problems = inconsistencies(study_of("matching", closing=["interview"], questionnaire=None))
    assert any("closing: [interview] and interview" in problem.message for problem in problems)


def at_first(task):
    return plan_of(task).trials[0]


NO_ANSWERS = [
    (at_first("adjective_selection"), {"ticked": ["rough", "rough"], "further": []}, "different words of the list"),
    (at_first("adjective_selection"), {"ticked": ["green"], "further": []}, "different words of the list"),
    (at_first("adjective_selection"), {"ticked": [], "further": [""]}, "words are expected"),
    (at_first("adjective_selection"), {"ticked": []}, "ticked and further words expected"),
    (at_first("free_lexicon"), {"words": ["one"]}, "at least 2 words expected, found 1"),
    (at_first("free_lexicon"), {"words": "rough"}, "words expected"),
    (at_first("matching"), {"Soft": 1.0}, "answers to"),
    (at_first("matching"), {"Soft": 101.0, "Cold": 3.0}, "not on the study's scale"),
]


@pytest.mark.parametrize(("trial", "answers", "message"), NO_ANSWERS)
def test_what_is_no_answer_is_refused(trial, answers, message):
    with pytest.raises(ReplyError, match=f"trial 1: .*{message}"):
        Ask(trial.form, trial).demand_answer(Reply({"answers": answers}))


@pytest.mark.parametrize(
    ("place", "answers", "message"),
    [
        (0, {"agreed": "yes"}, "true or false"),
        (1, {"age": 17, "handedness": None, "remark": None}, "from 18 to 99"),
        (1, {"age": None, "handedness": None, "remark": None}, "age is not answered"),
        (1, {"age": 30, "handedness": "both", "remark": None}, "one of"),
        (1, {"age": 30, "handedness": "left"}, "answers to"),
        (1, {"age": 30, "handedness": "left", "remark": 3}, "a text is expected"),
        (-2, {"Realism": 8, "Ease": 1}, "from 1 to 7"),
        (-2, {"Realism": 4.0, "Ease": 1}, "from 1 to 7"),
    ],
)
def test_what_is_no_answer_to_a_form_outside_trials_is_refused(place, answers, message):
    plan = plan_of("matching")
    form = [*plan.opening, *plan.closing][place]
    with pytest.raises(ReplyError, match=f"{form.name}: .*{message}"):
        Ask(form).demand_answer(Reply({"answers": answers}))


def test_trying_out_is_only_for_authors():
    trial = at_first("matching")
    with pytest.raises(ReplyError, match="goes 'try'"):
        Ask(trial.form, trial).demand_answer(Reply({"go": "try", "answers": {"Soft": 1.0, "Cold": 1.0}}))
