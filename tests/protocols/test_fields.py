"""The composite form: its questions, their answers, and its table."""

from dataclasses import replace
from itertools import pairwise
from math import sqrt

import pytest
from pydantic import ValidationError

from palpate.protocols.events import Ask
from palpate.protocols.fields import Fields, questions_from
from palpate.protocols.forms import FORMS
from palpate.protocols.plan import compile_plan
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from tests.protocols.studies_for_tests import toy

ASKED = [
    {"name": "kind", "kind": "choice", "options": ["wood", "metal"]},
    {"name": "warm", "kind": "scale", "from": 1, "to": 5, "step": 1, "ends": ["cold", "warm"]},
    {"name": "size", "kind": "number", "above": 0, "unit": "mm"},
    {"name": "age", "kind": "number", "from": 18, "to": 99},
    {"name": "why", "kind": "text", "optional": True, "longest": 5},
    {"name": "sure", "kind": "confidence", "points": 3},
]
ANSWERS = {"kind": "wood", "warm": 3, "size": 2.5, "age": 18, "why": None, "sure": 3}


def form():
    return Fields(questions_from(ASKED))


def test_each_question_has_answers_of_its_kind():
    assert form().problem(ANSWERS) is None and form().items() == list(ANSWERS)


@pytest.mark.parametrize(
    ("name", "answer", "message"),
    [
        ("kind", "stone", "one of ['wood', 'metal']"),
        ("kind", None, "kind is not answered"),
        ("warm", 2.5, "is not on its scale"),
        ("warm", True, "is not on its scale"),
        ("size", 0, "a number above 0"),
        ("size", float("nan"), "a finite number"),
        ("size", float("inf"), "a finite number"),
        ("age", 17.9, "from 18 to 99"),
        ("why", "  ", "a text of 1 to 5 characters"),
        ("why", "too long", "a text of 1 to 5 characters"),
        ("sure", 4, "from 1 to 3"),
        ("sure", 2.0, "from 1 to 3"),
    ],
)
def test_an_answer_of_another_kind_is_refused_by_its_question(name, answer, message):
    assert message in form().problem({**ANSWERS, name: answer})


@pytest.mark.parametrize("answers", [{}, {**ANSWERS, "more": 1}, None, [1]])
def test_all_questions_are_answered_and_no_others(answers):
    assert "answers to ['kind'" in form().problem(answers)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ([], "a list of 1 to 12 questions"),
        ([*ASKED, ASKED[0]], "the question 'kind' appears twice"),
        ([{"name": "a", "kind": "scale", "from": 5, "to": 1}], "must be below to"),
        ([{"name": "a", "kind": "scale", "from": 1, "to": 5, "stepp": 1}], "Extra inputs are not permitted"),
        ([{"name": "a", "kind": "choice"}], "options: [TEXT, ...] or of: intervals"),
        ([{"name": "a", "kind": "choice", "options": ["x"]}], "two different ones or more"),
        ([{"name": "a", "kind": "slider"}], "found 'slider', expected choice"),
        ([{"kind": "text"}], "Field required"),
        ([{"name": "a", "kind": "number", "from": 2, "to": 1}], "must be below to"),
        ([{"name": "a", "kind": "text", "size": 2}], "unknown key; known: kind, name"),
    ],
)
def test_questions_that_cannot_be_are_named(asked, message):
    with pytest.raises((ValueError, ValidationError)) as raised:
        questions_from(asked)
    assert message in str(raised.value)


@pytest.mark.parametrize(
    "bounds",
    [{}, {"above": 0}, {"above": 0, "to": 0.5}, {"from": 0.01, "to": 0.04}, {"from": 1e6, "to": 1e6 + 1}, {"to": -5}],
)
def test_a_simulated_number_is_within_its_bounds(bounds):
    [question] = questions_from([{"name": "size", "kind": "number", **bounds}])
    assert [problem for n in range(1, 100) if (problem := question.problem(question.simulated(n / 100)))] == []
    assert len({question.simulated(n / 100) for n in range(1, 100)}) > 90


def test_simulated_people_answer_every_question_in_time():
    plan = compile_plan(toy(), ParticipantRow("P001"))
    reply, seconds = Perceiver(plan).answer(Ask(form(), plan.trials[0]))
    assert form().problem(reply.value["answers"]) is None
    times = list(reply.value["at_s"].values())
    assert times == sorted(times) and times[-1] == seconds and list(reply.value["at_s"]) == form().items()


def test_simulated_magnitudes_follow_the_percept_in_decades_with_a_modulus_of_the_persons_own():
    stimuli = [{"id": str(n), "columns": {"log_um": str(float(n))}} for n in range(1, 5)]  # z-scores: SD sqrt(5) / 2
    study = Study.model_validate({
        "study": "magnitudes", "task": "questions", "stimuli": stimuli, "order": {"design": "as_listed"},
        "ask": [{"name": "strength", "kind": "number", "above": 0},
                {"name": "size", "kind": "scale", "from": 0, "to": 9}],
        "simulation": {
            "latents": {"strength": {"log_um": 0.5}, "size": {"log_um": 20.0}},
            "noise_sd": 0, "gain_sd": 0, "bias_sd": 0.3,
        },
    })  # fmt: skip
    moduli = set()
    for row in range(3):
        plan = compile_plan(study, ParticipantRow(f"P00{row}"))
        given = [Perceiver(plan).answer(Ask(t.form, t))[0].value["answers"] for t in plan.trials]
        numbers, sizes = [answer["strength"] for answer in given], [answer["size"] for answer in given]
        assert all(number == float(f"{number:.2g}") for number in numbers)
        steps = [b / a for a, b in pairwise(numbers)]
        assert steps == pytest.approx([10 ** (0.5 * 2 / sqrt(5))] * 3, rel=0.08)  # rounded to two digits
        assert [b - a for a, b in pairwise(sizes)] == pytest.approx([0.09 * 20 * 2 / sqrt(5)] * 3, abs=0.01)
        moduli.add(numbers[0])
    assert len(moduli) == 3


def test_each_answer_is_a_row_of_the_table_fields_but_confidence_in_an_interval():
    reply = {"answers": ANSWERS, "at_s": {"size": 1.5}}
    rows = {row["question"]: row for row in FORMS["fields"].table.rows(form(), ANSWERS, reply, {})}
    assert list(rows) == ["kind", "warm", "size", "age", "sure"] and rows["sure"]["number"] == 3.0
    about_intervals = replace(form(), name="intervals")
    rows_beside_choices = FORMS["fields"].table.rows(about_intervals, ANSWERS, reply, {})
    assert [row["question"] for row in rows_beside_choices] == ["kind", "warm", "size", "age"]
    assert rows["size"] == {"question": "size", "kind": "number", "value": "2.5", "number": 2.5, "response_time_s": 1.5}
    assert rows["kind"]["number"] is None and rows["kind"]["value"] == "wood"
