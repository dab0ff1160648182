"""The task intervals: what is presented in which interval, catch trials, practice, feedback, and bad declarations."""

from dataclasses import replace

import pytest

from palpate.protocols.events import Ask, Choose, Present, Reply, Show
from palpate.protocols.forms import FORMS
from palpate.protocols.plan import compile_plan, count_trials
from palpate.protocols.reading import StudyError, study_from
from palpate.protocols.study import Study
from palpate.protocols.tasks import TASKS, Answered, Stopped
from palpate.protocols.trial import ParticipantRow
from palpate.protocols.yaml_text import load

GRID = {"column": "level_db", "from": 0, "to": 10, "points": 11}
STAIRCASE = {"kind": "staircase", "level": GRID, "start": 5, "stop": {"trials": 12}}
AB = ({"id": "A"}, {"id": "B"})
PAPERS = [{"id": f"P{um}", "columns": {"grit_um": str(um)}} for um in (80, 100, 120, 140)]
ROWS = {"kind": "constant", "level": {"column": "grit_um", "of": "stimuli"}, "repeats": 2}


def plan(
    intervals=None, procedure=STAIRCASE, stimuli=({"id": "A"}, {"id": "B"}), seed=0, participant="P001", **changes
):
    data = {
        "study": "toy", "task": "intervals", "stimuli": list(stimuli), "intervals": intervals or {},
        "procedure": procedure, "order": {"design": "random"}, **changes,
    }  # fmt: skip
    return compile_plan(Study.model_validate(data), ParticipantRow(participant), seed)


def gone_through(trial, index=3, **answers):
    """Return the requests of a trial and its outcome, with these answers; the first choice unless one is given."""
    steps, requests, reply = TASKS["intervals"].steps(trial), [], None
    try:
        while True:
            request = steps.send(reply)
            requests.append(request)
            reply = Reply({})
            if isinstance(request, Choose):
                reply = Reply({"index": index, "level": trial.track.levels[index]})
            if isinstance(request, Ask):
                reply = Reply({"answers": {request.form.choice.name: request.form.choice.options[0], **answers}})
    except StopIteration as end:
        return requests, end.value


def presented(trial, index=3):
    """Return (stimulus, level, blank) of each interval, and what is right."""
    requests, _ = gone_through(trial, index)
    parts = [(r.trial.stimulus, r.part) for r in requests if isinstance(r, Present)]
    [asked] = [request for request in requests if isinstance(request, Ask)]
    shown = [(s.id, s.columns.get("level_db", s.columns.get("grit_um")), part.blank) for s, part in parts]
    return shown, asked.form.context["target"]


@pytest.mark.parametrize("count", [2, 4])
def test_one_interval_of_several_has_the_stimulus_and_the_others_are_blank(count):
    places = set()
    for trial in plan({"count": count}).trials:
        shown, target = presented(trial)
        assert [blank for *_, blank in shown].count(False) == 1 and len(shown) == count
        assert shown[int(target) - 1] == (trial.stimulus.id, "3", False)
        places.add(target)
    assert places == {str(n) for n in range(1, count + 1)}


def test_the_other_intervals_hold_a_standard_level():
    shown, target = presented(plan({"standard": 0}).trials[0])
    assert sorted(level for _, level, _ in shown) == ["0", "3"] and shown[int(target) - 1][1] == "3"


def test_levels_may_be_rows_of_the_table_compared_with_one_of_them():
    papers = plan({"standard": "P120"}, ROWS, PAPERS)
    assert {trial.track.levels for trial in papers.trials} == {(80.0, 100.0, 140.0)}
    assert len(papers.trials) == 6 == count_trials(papers.study, papers.study.stimuli)
    shown, target = presented(papers.trials[0], index=2)
    assert shown[int(target) - 1] == ("P140", "140", False) and {name for name, *_ in shown} == {"P140", "P120"}
    assert {stimulus.id for stimulus in papers.possible} == {"P80", "P100", "P120", "P140"}


def test_every_level_of_every_track_may_be_presented():
    possible = plan({"standard": 2.5}).possible
    assert {(s.id, s.columns["level_db"]) for s in possible} == {
        (name, level) for name in "AB" for level in [*map(str, range(11)), "2.5"]
    }


@pytest.mark.parametrize(
    ("level", "rougher", "correct"),
    [(140.0, True, True), (140.0, False, False), (80.0, True, False), (80.0, False, True)],
)
def test_of_a_standard_that_is_the_greater_the_comparison_is_the_wrong_choice(level, rougher, correct):
    trial = plan({"standard": "P120"}, ROWS, PAPERS, feedback={"seconds": 0.5}).trials[0]
    index = trial.track.levels.index(level)
    _, target = presented(trial, index)
    other = {"1": "2", "2": "1"}[target]
    requests, outcome = gone_through(trial, index, chosen=target if rougher else other)
    assert outcome.step == (index, rougher)
    [shown] = [request.page for request in requests if isinstance(request, Show)]
    assert shown == ("right_answer" if correct else "wrong_answer")


@pytest.mark.parametrize(
    ("intervals", "options", "targets"),
    [
        ({"design": "yes_no", "catch": {"absent": {"every": 1}}}, ("yes", "no"), {"signal", "noise"}),
        ({"design": "same_different", "standard": 0, "catch": {"absent": {"every": 1}}}, ("same", "different"),
         {"same", "different"}),
        ({"design": "oddity", "standard": 0}, ("1", "2", "3"), {"1", "2", "3"}),
    ],
)  # fmt: skip
def test_each_design_has_its_answers_and_what_is_right(intervals, options, targets):
    trials = plan(intervals).trials
    assert trials[0].form.choice.options == options
    assert {presented(trial)[1] for trial in trials} == targets


def test_catch_trials_are_among_the_others_have_no_choice_and_do_not_count_for_the_track():
    trials = plan(
        {"design": "yes_no", "catch": {"absent": {"every": 3}, "easy": {"every": 6}}}, stimuli=[{"id": "A"}]
    ).trials
    kinds = [trial.catch for trial in trials]
    assert (kinds.count("none"), kinds.count("absent"), kinds.count("easy")) == (12, 4, 2)
    absent = next(trial for trial in trials if trial.catch == "absent")
    requests, outcome = gone_through(absent)
    assert not any(isinstance(request, Choose) for request in requests) and outcome.step is None
    assert presented(absent) == ([("A", None, True)], "noise")
    easy = next(trial for trial in trials if trial.catch == "easy")
    assert presented(easy) == ([("A", "10", False)], "signal") and gone_through(easy)[1].step is None


def test_practice_goes_on_until_its_goal_is_met():
    practice = {"stimuli": ["B", "A"], "until": {"correct": 3, "of": 4}, "at_most": 9}
    trials = plan(practice=practice, feedback={"after": "practice"}).trials
    practised = [trial for trial in trials if trial.practice]
    assert [trial.stimulus.id for trial in practised] == list("BABABABAB")
    assert {trial.index for trial in practised} == {10}
    requests, _ = gone_through(practised[0])
    assert isinstance(requests[-1], Show) and not any(isinstance(request, Choose) for request in requests)
    assert not any(isinstance(request, Show) for request in gone_through(trials[9])[0])
    met = replace(practised[5], past=((10, False), (10, True), (10, True), (10, False), (10, True), (10, True)))
    assert gone_through(met) == ([], Stopped())
    assert isinstance(gone_through(replace(met, past=met.past[:4]))[1], Answered)


def test_sides_are_presented_at_once():
    trial = plan({"standard": "P120", "at_once": True}, ROWS, PAPERS).trials[0]
    [present] = [request for request in gone_through(trial, 2)[0] if isinstance(request, Present)]
    assert sorted(present.part.sides) == ["P120", "P140"]
    assert present.part.sides[present.part.interval - 1] == "P140" and present.body()["sides"] == present.part.sides


def test_the_target_is_drawn_for_each_person_trial_and_attempt():
    trial = plan().trials[0]
    attempts = {presented(replace(trial, attempt=n))[1] for n in range(1, 9)}
    people = {presented(plan(participant=f"P{n}").trials[0])[1] for n in range(1, 9)}
    assert attempts == people == {"1", "2"}


def test_tracks_stay_in_their_blocks():
    kinds = [{"id": name, "columns": {"finger": finger}} for name, finger in zip("ABCD", "xxyy", strict=True)]
    order = {"design": "random", "within": "block", "blocks": {"by": "finger"}}
    trials = plan(stimuli=kinds, order=order).trials
    blocks = [trial.block for trial in trials]
    assert blocks in (["x"] * 24 + ["y"] * 24, ["y"] * 24 + ["x"] * 24)
    assert {trial.block + trial.track.name for trial in trials} == {"xA", "xB", "yC", "yD"}


def test_several_procedures_are_interleaved_by_name():
    both = [{**STAIRCASE, "name": "low", "start": 2}, {**STAIRCASE, "name": "high", "start": 9}]
    trials = plan(procedure=both, stimuli=[{"id": "A"}]).trials
    names = [trial.track.name for trial in trials]
    assert sorted(set(names)) == ["A high", "A low"] and names.count("A low") == 12
    assert names not in (sorted(names), sorted(names, reverse=True))


def test_the_answers_are_rows_of_the_table_choices():
    trial = plan(
        {"standard": 2},
        ask=[{"name": "which", "kind": "choice", "of": "intervals"}, {"name": "sure", "kind": "confidence"}],
    ).trials[0]
    requests, _ = gone_through(trial, which="1", sure=3)
    asked = next(request for request in requests if isinstance(request, Ask))
    reply = {"answers": {"which": "1", "sure": 3}, "at_s": {"which": 0.7, "sure": 1.5}}
    [row] = FORMS["intervals"].table.rows(trial.form, reply["answers"], reply, asked.body())
    right = asked.form.context["target"] == "1"
    assert row == {
        "track": trial.stimulus.id, "stimulus": trial.stimulus.id, "other": None, "procedure": "staircase",
        "design": "forced_choice",
        "alternatives": 2, "level": 3.0, "level_2": None, "standard": 2.0, "target": asked.form.context["target"],
        "chosen": "1", "correct": right, "hit": right, "catch": "none", "confidence": 3.0, "rt_s": 0.7,
    }  # fmt: skip


STUDY = """
study: toy
task: intervals
stimuli: [A, B]
intervals: {{design: forced_choice{intervals}}}
procedure: {{kind: {kind}, level: {level}{procedure}}}
order: {{design: random}}
{more}
"""
OPTIONS = {
    "kind": "staircase",
    "level": "{column: x, from: 0, to: 9, points: 10}",
    "intervals": "",
    "procedure": ", start: 5, stop: {trials: 9}",
    "more": "",
}
QUEST = (
    "questplus",
    ", model: {threshold: {from: -9, to: 9, points: 9}, slope: 3, guess: 0.5, scale: db}, stop: {trials: 9}",
)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"procedure": ", start: 5"}, "procedure.stop: this key is required"),
        ({"procedure": ", start: 5, stop: {reversals: 8}"}, "procedure.stop.trials: this key is required"),
        (
            {"procedure": ", start: 5, stop: {trials: 9, series: 8}"},
            "procedure.stop.series: series is not a rule of kind: staircase",
        ),
        ({"procedure": ", start: 5, stopp: {trials: 9}"}, "procedure.stopp: unknown key; did you mean 'stop'?"),
        ({"procedure": ", start: 5, stop: {trails: 9}"}, "procedure.stop.trails: unknown key; did you mean 'trials'?"),
        ({"procedure": ", start: 5.5, stop: {trials: 9}"}, "start (5.5) is not a level of the grid"),
        ({"procedure": ", start: 5, down: 5, stop: {trials: 9}"}, "procedure.down: found 5"),
        ({"kind": "pest"}, "kind: found 'pest', expected constant, limits, staircase, questplus"),
        ({"kind": "limits", "procedure": ", stop: {trials: 9}"}, "stop: {trials: N, series: N} is expected"),
        ({"kind": "constant", "procedure": ""}, "procedure.repeats: this key is required"),
        ({"level": "{column: x, from: 9, to: 0, points: 10}"}, "from (9) must be below to (0)"),
        ({"level": "{column: x, from: 0, to: 9}"}, "one of {from, to, points}, {values} and {of: stimuli}"),
        ({"level": "{column: x, of: stimuli}"}, "stimulus 'A' has '' in 'x', not a finite number"),
        ({"level": "{column: x, values: [0, 5, 5]}"}, "values: different levels are expected"),
        ({"kind": "questplus", "procedure": ", stop: {trials: 9}"}, "procedure.model: this key is required"),
        ({"kind": QUEST[0], "procedure": QUEST[1].replace("scale: db", "scale: linear")}, "needs values above 0"),
        (
            {"kind": QUEST[0], "procedure": QUEST[1].replace("guess: 0.5", "guess: 1.5")},
            "guess: rates from 0 to below 1",
        ),
        ({"kind": QUEST[0], "procedure": QUEST[1].replace("{from: -9, to: 9, points: 9}", "3")}, "two or more values"),
        ({"kind": QUEST[0], "procedure": QUEST[1] + ", easier: lower"}, "easier: lower goes with shape: logistic"),
        ({"kind": QUEST[0], "procedure": QUEST[1].replace("9}, s", "9000}, s")}, "procedure.model.threshold"),
        ({"intervals": ", count: 1"}, "count: at least 2 for design: forced_choice, found 1"),
        ({"intervals": ", names: [left]"}, "names: 2 names are expected, found 1"),
        ({"intervals": ", standard: C"}, "found 'C', expected a stimulus id or a level"),
        ({"intervals": ", catch: {absent: {every: 2}}"}, "catch.absent: absent has no place in design forced_choice"),
        ({"intervals": ", desing: oddity"}, "intervals.desing: unknown key; did you mean 'design'?"),
        ({"more": "ask: [{name: sure, kind: confidence}]"}, "one question of: intervals is expected, found 0"),
        ({"more": "ask: [{name: q, kind: choise, of: intervals}]"}, "kind: found 'choise'"),
        ({"more": "navigation: back_and_forward"}, "task intervals goes forward only"),
        ({"more": "practice: {stimuli: [A], at_most: 5}"}, "until: {correct: N, of: N} and at_most: N go together"),
    ],
)
def test_a_declaration_that_cannot_be_is_named_with_its_place(changes, message):
    document = load(STUDY.format(**{**OPTIONS, **changes}).encode(), "study.yaml")
    with pytest.raises(StudyError) as raised:
        study_from(document, [{"id": "A"}, {"id": "B"}], "study.yaml")
    assert message in str(raised.value) and str(raised.value).startswith("study.yaml: line ")


LARGE = (
    QUEST[1]
    .replace("to: 9, points: 9", "to: 9, points: 99")
    .replace("slope: 3", "slope: {from: 1, to: 9, points: 900}")
)
VIBRATION = "needs: [vibration]"
TWO = "[{column: x, from: 0, to: 9, points: 10}, {column: y, values: [0, 1]}]"
TWO_DIMENSIONS = {"kind": QUEST[0], "level": TWO, "procedure": QUEST[1].replace("slope", "gradient: [0, 1], slope")}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"more": "needs: [door]"}, "task intervals is presented by vibration, or by samples"),
        ({"more": VIBRATION, "intervals": ", seconds: 1"},
         "procedure.level.column: the column 'x' changes nothing that is presented"),
        ({"more": VIBRATION}, "seconds: N is expected: how long is an interval that is blank?"),
        ({"more": VIBRATION, "intervals": ", at_once: true"}, "it cannot present two at once"),
        ({"procedure": ", start: 5, stop: {trials: 9}, stimuli: [A]"}, "no procedure is for the stimulus 'B'"),
        ({"procedure": ", start: 5, stop: {trials: 9}, stimuli: [C]"},
         "procedure.stimuli[0]: found 'C', expected a stimulus id"),
        ({**TWO_DIMENSIONS, "intervals": ", standard: 3"}, "a level as a standard has one dimension"),
        ({"kind": QUEST[0], "procedure": QUEST[1].replace("slope: 3", "slope: [3, 1]")}, "slope: different values"),
        ({"kind": QUEST[0], "level": "{column: x, from: 0, to: 9, points: 1000}", "procedure": LARGE},
         "at most 20,000,000 are"),
        ({"level": "{column: x, from: 1, to: 1.00000000000001, points: 10}"}, "cannot be told apart"),
        ({"more": "practice: {stimuli: [A]}", "intervals": ", standard: A"},
         "'A' is the standard, which is in no track"),
        ({"more": "resume: {repeat: [block]}"}, "the study has no blocks"),
        ({"more": "simulation: {observer: {threshold: {a: 1}}}"}, "found 'a', expected a stimulus or a track"),
    ],
)  # fmt: skip
def test_a_declaration_that_could_not_run_is_refused_before(changes, message):
    document = load(STUDY.format(**{**OPTIONS, **changes}).encode(), "study.yaml")
    with pytest.raises(StudyError) as raised:
        study_from(document, [{"id": "A"}, {"id": "B"}], "study.yaml")
    assert message in str(raised.value)


def test_a_stimulus_cannot_have_the_name_of_practice():
    document = load(STUDY.format(**OPTIONS).encode(), "study.yaml")
    with pytest.raises(StudyError, match="'practice' is the name of the practice trials"):
        study_from(document, [{"id": "A"}, {"id": "practice"}], "study.yaml")


def test_after_the_last_trial_the_procedure_is_asked_for_its_estimate():
    trial = plan(stimuli=AB[:1]).trials[-1]
    requests, outcome = gone_through(replace(trial, past=((3, True),) * 11))
    assert [type(request) for request in requests] == [Choose, Present, Present, Ask, Choose]
    assert len(requests[-1].trial.past) == 12 and outcome.step is not None


@pytest.mark.parametrize(("level", "chosen_is_correct"), [(3, True), (0, False)])
def test_where_hits_become_rarer_with_the_level_less_is_the_right_choice(level, chosen_is_correct):
    settings = {**STAIRCASE, "easier": "lower"}
    trial = plan({"standard": 1.5}, settings, AB[:1], feedback={"seconds": 0.5}).trials[0]
    index = trial.track.levels.index(float(level))
    _, target = presented(trial, index)
    requests, _ = gone_through(trial, index, chosen=target)
    [shown] = [request.page for request in requests if isinstance(request, Show)]
    assert shown == ("wrong_answer" if chosen_is_correct else "right_answer")


def test_two_sides_are_equal_where_there_is_no_difference():
    intervals = {"design": "same_different", "standard": "P120", "at_once": True, "catch": {"absent": {"every": 1}}}
    absent = next(trial for trial in plan(intervals, ROWS, PAPERS).trials if trial.catch == "absent")
    [present] = [request for request in gone_through(absent)[0] if isinstance(request, Present)]
    assert present.part.sides == ("P120", "P120") and present.trial.stimulus.id == "P120"


def test_the_declaration_that_the_others_change_is_good():
    document = load(STUDY.format(**OPTIONS).encode(), "study.yaml")
    study = study_from(document, [{"id": "A"}, {"id": "B"}], "study.yaml")
    assert Study.model_validate(study.definition()) == study


def test_a_guess_rate_that_the_design_contradicts_gets_a_note():
    """Three intervals are guessed right in a third of the trials: 0.33 is not noted, 0.5 is."""

    def notes_on(guess):
        text = STUDY.format(**{
            **OPTIONS, "kind": QUEST[0], "procedure": QUEST[1].replace("guess: 0.5", f"guess: {guess}"),
            "intervals": ", count: 3", "more": "simulation: {observer: {threshold: 3}}",
        })  # fmt: skip
        study = study_from(load(text.encode(), "s"), [{"id": "A"}, {"id": "B"}], "s")
        return [*TASKS["intervals"].notes(study)]

    assert notes_on(0.5) == [
        "procedure.model.guess is 0.5; who guesses among 3 intervals is right in 0.33",
        "simulation.observer.guess is 0.5; who guesses among 3 intervals is right in 0.33",
    ]
    assert notes_on("[0.2, 0.33]") == notes_on(0.5)[1:]
